"""Recordings that came into a session's folder: seen, waited for, written into session.toml."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from pathlib import Path

from freeswing.cdpr.files.documents import replace_file
from freeswing.cdpr.files.toml_text import toml_string
from freeswing.session.session_file import ROLES, TRAJECTORY_SUFFIXES, Session, as_run_name

Mark = dict[str, tuple[int, int]]

VIDEO_SUFFIXES = (".mkv", ".mp4", ".mov", ".avi")
VALIDATE_EVERY = 3  # every third recording is kept apart: a check on two runs at six recordings


def mark(session: Session) -> Mark:
    """Size and time of every file of a session but its results: what changed shows here."""
    found: Mark = {}
    for file in session.folder.rglob("*"):
        if file.is_relative_to(session.results) or file.name.startswith("."):
            continue
        try:
            told = file.stat()
        except FileNotFoundError:  # gone since it was listed
            continue
        if file.is_file() and file != session.cameras:
            found[file.relative_to(session.folder).as_posix()] = (told.st_size, told.st_mtime_ns)
    return found


def recordings(session: Session) -> set[Path]:
    """Files, or folders of films, that stand where the session's runs do."""
    places = {one.parent for run in session.runs if (one := run.trajectory or run.video)}
    found: set[Path] = set()
    for place in places:
        for path in place.iterdir() if place.is_dir() else ():
            is_motion = path.suffix.lower() in TRAJECTORY_SUFFIXES
            if is_motion or (path.is_dir() and _films(path)):
                found.add(path)
    return found


def take_in(session: Session, new: Iterable[Path]) -> list[str]:
    """Append a run for each new recording to session.toml; gives their names.

    A folder of films is taken once it holds as many as the other runs'. What the file would not
    read with (runs in one line, a name that is taken) is left alone.
    """
    named = {run.trajectory or run.video for run in session.runs}
    taken = {run.name.casefold() for run in session.runs}
    films = max((len(_films(run.video)) for run in session.runs if run.video), default=0)
    roles = [run.role for run in session.runs]
    text, names = session.path.read_text(encoding="utf-8"), []
    for path in sorted(set(new) - named):
        if path.stem.casefold() in taken or not path.name.isprintable():
            continue
        if path.is_dir() and len(_films(path)) < films:
            continue
        name = as_run_name(path.stem, taken)
        longer = text.rstrip("\n") + "\n" + _table(session, path, name, next_role(roles))
        if not _reads(longer):
            continue
        text = longer
        roles.append(next_role(roles))
        names.append(name)
        taken.add(name.casefold())
    if names:
        replace_file(session.path, text.encode("utf-8"))
    return names


def next_role(roles: list[str]) -> str:
    """`validate` where fewer than a third of the runs would be, else `identify`."""
    identify, validate = ROLES
    return validate if VALIDATE_EVERY * (roles.count(validate) + 1) <= len(roles) + 1 else identify


def _table(session: Session, path: Path, name: str, role: str) -> str:
    key = "video" if path.is_dir() else "trajectory"
    place = path.relative_to(session.folder).as_posix()
    return (
        f'\n[[runs]]\nname = {toml_string(name)}\nrole = "{role}"\n{key} = {toml_string(place)}\n'
    )


def _reads(text: str) -> bool:
    try:
        tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return False
    return True


def _films(folder: Path | None) -> list[Path]:
    if folder is None or not folder.is_dir():
        return []
    return [one for one in folder.iterdir() if one.suffix.lower() in VIDEO_SUFFIXES]
