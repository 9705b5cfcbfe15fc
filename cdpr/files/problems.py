"""The two errors a user can cause, and a list that collects what is wrong with one file."""

from __future__ import annotations

from pathlib import Path

MOST_LINES = 40


class InputError(ValueError):
    """A file is wrong or cannot be read (exit status 2)."""


class DataError(ValueError):
    """The data are readable but cannot give a result (exit status 1)."""


class Problems:
    """Everything that is wrong with a file, so that the user sees it at once."""

    def __init__(self) -> None:
        self._lines: dict[str, None] = {}

    def add(self, key: str, text: str) -> None:
        """Record that `key` is wrong and why; a repeated line is kept once."""
        self._lines[f"{key}: {text}"] = None

    @property
    def lines(self) -> tuple[str, ...]:
        """The recorded lines, in order."""
        return tuple(self._lines)

    def __bool__(self) -> bool:
        return len(self._lines) > 0

    def raise_if_any(self, path: Path | str) -> None:
        """Raise one InputError naming the file and every problem, if there is any."""
        if not self._lines:
            return
        shown = list(self._lines)[:MOST_LINES]
        more = len(self._lines) - len(shown)
        tail = [f"... and {more} more"] if more else []
        count = f"{len(self._lines)} problem{'s' if len(self._lines) > 1 else ''}"
        raise InputError("\n  ".join([f"{path}: {count}", *shown, *tail]))
