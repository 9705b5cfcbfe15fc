"""One rule for everything that is read and written: links do not lead out of the folder.

What a file names is looked for in its own folder, what a command writes goes to one results
folder. Both are followed through all links before anything is opened.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path, PureWindowsPath

from freeswing.cdpr.files.problems import InputError
from freeswing.cdpr.system.drafts import clear_leftover, is_draft


def results_folder(home: Path, results: Path | str | None = None) -> Path:
    """The folder that takes what a command writes; drafts that killed commands left are cleared.

    Args:
        home: the folder of the command's file; its `results` are used where none are named.
        results: another folder, as a person named it.

    Raises:
        InputError: it, or anything in it, leads out of `home`, or out of `results`.
    """
    folder = home / "results" if results is None else Path(results)
    bound = home if results is None else folder
    remedy = "nothing is read or written there; remove it, or name another place with --results DIR"
    for path in _plain_files(folder, bound, remedy):
        if is_draft(path.name):
            clear_leftover(path)
    return folder


def inside(folder: Path | str, relative: str, key: str = "path") -> Path:
    """The path `relative` in `folder`; neither it nor anything in it may lead out of the folder.

    Raises:
        InputError: for an absolute path, one that leaves the folder, or no path at all.
    """
    folder = Path(folder)
    if not relative.strip() or "\0" in relative or len(relative) > 1000:
        raise InputError(f"{key}: {relative[:60]!r} is not a path")
    if Path(relative).is_absolute() or PureWindowsPath(relative).anchor:
        raise InputError(f"{key}: {relative!r} must be relative to {folder}")
    path = folder / relative
    try:
        is_inside = path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError) as error:
        raise InputError(f"{key}: {relative!r} cannot be followed ({error})") from error
    if not is_inside:
        raise InputError(f"{key}: {relative!r} leads out of {folder}; move the file into it")
    for _ in _plain_files(path, folder, "move what it leads to into the folder"):
        pass
    return path


def _plain_files(place: Path, bound: Path, remedy: str) -> Iterator[Path]:
    """The files at and below `place`, which is followed through its links; links are left out.

    Raises:
        InputError: naming a link that leads out of `bound`, or nowhere but to itself.
    """
    home, seen, waiting = bound.resolve(), set[Path](), [place]
    while waiting:
        path = waiting.pop()
        try:
            real = path.resolve()
        except (OSError, RuntimeError) as error:
            raise InputError(f"{path}: cannot be followed ({error})") from error
        if not real.is_relative_to(home):
            raise InputError(f"{path}: a link that leads out of {bound}; {remedy}")
        if real in seen:
            continue
        seen.add(real)
        for entry in _entries(path):
            if entry.is_symlink() or entry.is_dir(follow_symlinks=False):
                waiting.append(Path(entry.path))
            else:
                yield Path(entry.path)


def _entries(folder: Path) -> list[os.DirEntry[str]]:
    """What is in a folder; nothing where it is none, or where whoever opens it will be told."""
    try:
        with os.scandir(folder) as found:
            return list(found)
    except OSError:
        return []
