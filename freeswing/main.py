"""The command `freeswing`: flags, the choice of a command, and the one place where failures end."""

from __future__ import annotations

import argparse
import importlib
import os
import sys
import warnings
from collections.abc import Sequence
from types import ModuleType

from freeswing import __version__
from freeswing.console import Console
from freeswing.errors import DONE, INTERRUPTED, describe, exit_status, short_name

# Each command with the room of `freeswing/commands` that its file stands in, as help lists them.
COMMANDS = {
    "demo": "session",
    "new": "session",
    "check": "session",
    "calibrate": "session",
    "track": "session",
    "identify": "session",
    "diagnose": "session",
    "report": "session",
    "compare": "session",
    "run": "session",
    "watch": "session",
    "convert": "files",
    "export": "files",
    "simulate": "robot",
    "linearise": "robot",
    "drive": "session",
    "effects": "robot",
    "board": "files",
    "home": "robot",
    "excite": "robot",
    "design": "control",
    "servo": "control",
    "tensions": "control",
    "doctor": "program",
    "completion": "program",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit status is 0 done, 1 no result from the data, 2 wrong input.

    Args:
        arguments: the words after `freeswing`; those of the process when None.
    """
    parser = build_parser()
    options = parser.parse_args(arguments)
    options.parser = parser  # for `completion`, which prints what it knows
    for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        # Processes share the cores; small matrices only lose by threads of their own.
        os.environ.setdefault(threads, "1")
    if (
        arguments is None and not options.verbose
    ):  # what Python's packages mutter is no sentence for a user
        warnings.simplefilter("ignore")
        os.environ.setdefault("PYTHONWARNINGS", "ignore")  # nor what they do in workers
    with Console(as_json=options.json, quiet=options.quiet) as console:
        try:
            options.run(options, console)
            sys.stdout.flush()
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        except KeyboardInterrupt:
            console.complain("interrupted; the results that were there before are untouched")
            return INTERRUPTED
        except Exception as failure:
            if options.verbose:
                raise
            console.complain(f"[{short_name(failure)}] {describe(failure)}")
            return exit_status(failure)
    return DONE


def build_parser() -> argparse.ArgumentParser:
    """The parser of all commands; each file in `freeswing/commands` adds its own flags."""
    parser = argparse.ArgumentParser(
        prog="freeswing",
        description="Recorded free swings of a cable-suspended platform in; its inertial "
        "parameters, how far to trust them, and what the model still lacks, out.",
        epilog="Exit status: 0 done, 1 the data cannot give a result, "
        "2 wrong usage or an unreadable file, 130 interrupted. A failure's short name, as in "
        "[keys], is explained in docs/errors.md.",
    )
    parser.add_argument("--version", action="version", version=f"freeswing {__version__}")
    choices = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name, room in COMMANDS.items():
        _add_command(choices, name, importlib.import_module(f"freeswing.commands.{room}.{name}"))
    return parser


def _add_command(choices: argparse._SubParsersAction, name: str, command: ModuleType) -> None:
    summary = (command.__doc__ or "").strip().splitlines()[0]
    parser = choices.add_parser(name, help=summary.rstrip("."), description=summary)
    command.add_arguments(parser)
    common = parser.add_argument_group("common to all commands")
    common.add_argument("--json", action="store_true", help="print the result file on stdout")
    common.add_argument("--quiet", action="store_true", help="no progress and no summary")
    common.add_argument("--verbose", action="store_true", help="show the traceback of a failure")
    parser.set_defaults(run=command.run)


if __name__ == "__main__":
    sys.exit(main())
