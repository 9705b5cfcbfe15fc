"""Print what makes a shell complete commands, flags and folders."""

from __future__ import annotations

from argparse import Action, ArgumentParser, Namespace

from freeswing.console import Console

SHELLS = ("bash", "zsh", "tcsh")
FOLDERS = ("session", "folder", "results")
CHOSEN = ("EFFECT", "N")  # positionals that are no files


def add_arguments(parser: ArgumentParser) -> None:
    """The shell."""
    parser.add_argument(
        "shell",
        choices=SHELLS,
        help='bash: eval "$(freeswing completion bash)" in ~/.bashrc; zsh and tcsh: the file into '
        "a folder of $fpath, or sourced",
    )


def run(options: Namespace, console: Console) -> None:
    """The script, on stdout."""
    import shtab

    parser: ArgumentParser = options.parser
    for one in _parsers(parser):
        for action in one._actions:
            _complete(action)
    script = shtab.complete(parser, shell=options.shell)
    console.say_json({"format": "freeswing-completion/1", "shell": options.shell, "script": script})
    console.say(script)


def _parsers(parser: ArgumentParser) -> list[ArgumentParser]:
    """A parser and those of its commands."""
    below = [
        one
        for action in parser._actions
        if isinstance(action.choices, dict)
        for one in action.choices.values()
    ]
    return [parser, *below]


def _complete(action: Action) -> None:
    """Folders where a session is meant, files where any other place is."""
    import shtab

    if action.choices is not None or action.nargs == 0 or action.type is not None:
        return
    if action.dest in FOLDERS:
        action.complete = shtab.DIRECTORY  # pyright: ignore[reportAttributeAccessIssue]
    elif not action.option_strings and action.metavar not in CHOSEN:
        action.complete = shtab.FILE  # pyright: ignore[reportAttributeAccessIssue]
