"""What a command says: a summary on stdout, progress and complaints on stderr."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, TextIO

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


# First words of lines that say how bad something is.
STYLES = {"error": "bold red", "warning": "yellow", "note": "dim"}


def has_desktop() -> bool:
    """Whether a browser can be shown here."""
    shown = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return sys.platform in ("win32", "darwin") or bool(shown)


def has_colours(stream: TextIO) -> bool:
    """Whether a stream is a terminal whose person has not asked for plain text."""
    plain = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb"
    return stream.isatty() and not plain


def _write(stream: TextIO, text: str, style: str = "") -> None:
    """One line; the style colours its first word, on a terminal alone."""
    head, space, rest = text.partition(" ")
    if not style or not has_colours(stream):
        stream.write(text + "\n")
        return
    from rich.console import Console as RichConsole
    from rich.text import Text

    line = Text.assemble((head, style), space + rest)
    RichConsole(file=stream).print(line, soft_wrap=True, highlight=False)


class Console:
    """The two streams of a command.

    Progress and colours are drawn only on a terminal; a pipe or file gets plain text. With
    `as_json` the result file is the only thing on stdout; with `quiet` nothing but complaints is
    printed.
    """

    def __init__(self, *, as_json: bool = False, quiet: bool = False) -> None:
        self._summary = not as_json and not quiet
        self._json = as_json
        self._draws = sys.stderr.isatty() and not quiet and os.environ.get("TERM") != "dumb"
        self._bar: Progress | None = None
        self._tasks: dict[str, TaskID] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stop_bar()

    def say(self, text: str = "") -> None:
        """One line of the summary."""
        if self._summary:
            self._stop_bar()
            _write(sys.stdout, text, STYLES.get(text.partition(" ")[0], ""))
            sys.stdout.flush()

    def complain(self, text: str) -> None:
        """A failure or a warning, on stderr."""
        self._stop_bar()
        _write(sys.stderr, f"freeswing: {text}", "bold red")

    def show_file(self, path: Path) -> None:
        """With `--json`: the result file, whole, on stdout."""
        if self._json:
            self._stop_bar()
            sys.stdout.write(path.read_text(encoding="utf-8").rstrip("\n") + "\n")

    def say_json(self, document: Mapping[str, Any]) -> None:
        """With `--json`: a result that is no file, on stdout."""
        if self._json:
            self._stop_bar()
            sys.stdout.write(json.dumps(document, indent=1, ensure_ascii=False) + "\n")

    def progress(self, label: str, fraction: float) -> None:
        """How far a step has come, from 0 to 1."""
        if not self._draws:
            return
        bar = self._bar or self._start_bar()
        if label not in self._tasks:
            self._tasks[label] = bar.add_task(label, total=1.0)
        bar.update(self._tasks[label], completed=min(max(fraction, 0.0), 1.0))

    def _start_bar(self) -> Progress:
        from rich.console import Console as RichConsole
        from rich.progress import Progress

        self._bar = Progress(console=RichConsole(stderr=True), transient=True)
        self._bar.start()
        return self._bar

    def _stop_bar(self) -> None:
        if self._bar is not None:
            self._bar.stop()
            self._bar, self._tasks = None, {}
