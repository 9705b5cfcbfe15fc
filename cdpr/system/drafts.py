"""Files that appear under their name whole or not at all, and what killed writers left of them.

A draft stands beside the file that it becomes. Its writer holds a lock on it, which ends with the
process however that ends: a draft that nobody holds is a leftover.
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

_DRAFT = re.compile(r"\.[0-9a-f]{16}\.part")


@contextmanager
def draft_of(path: Path) -> Iterator[BinaryIO]:
    """A file beside `path`, open for writing, which takes its place where the block ends well.

    Folders above are made, leftovers beside it cleared.

    Raises:
        OSError: it cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    clear_leftovers(path.parent)
    place, file = _opened(path)
    try:
        with file:
            yield file
            file.flush()
            os.fsync(file.fileno())
            if sys.platform != "win32":  # which moves no open file; elsewhere the lock lasts
                place.replace(path)
        if sys.platform == "win32":
            place.replace(path)
    finally:
        with contextlib.suppress(OSError):
            place.unlink(missing_ok=True)


def is_draft(name: str) -> bool:
    """Whether a file of this name is a draft."""
    return _DRAFT.fullmatch(name) is not None


def clear_leftovers(folder: Path) -> None:
    """Remove the drafts of one folder that no process writes any more, where that is allowed."""
    with contextlib.suppress(OSError):
        for path in folder.iterdir():
            if is_draft(path.name):
                clear_leftover(path)


def clear_leftover(path: Path) -> None:
    """Remove a draft, unless a process holds it."""
    with contextlib.suppress(OSError), path.open("rb+") as file:
        if sys.platform == "win32":
            file.close()
        elif not _locks(file):
            return
        path.unlink()


def _opened(path: Path) -> tuple[Path, BinaryIO]:
    """A new draft under lock."""
    while True:
        place = path.with_name(f".{secrets.token_hex(8)}.part")
        file = place.open("xb")
        _locks(file)
        if os.fstat(file.fileno()).st_nlink or sys.platform == "win32":
            return place, file
        file.close()  # taken for a leftover before it was locked


def _locks(file: BinaryIO) -> bool:
    """Whether the file is now locked by this process; some network disks know no locks."""
    if sys.platform == "win32":
        return True
    import fcntl

    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
