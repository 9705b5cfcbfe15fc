"""Where a result came from: what it was made of, so that it is made again only when that changed.

Nothing here depends on the clock: the same inputs give the same result file to the byte.
"""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Iterable, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from freeswing import __version__
from freeswing.results.files import read_provenance
from freeswing.session.session_file import Session

PACKAGES = ("numpy", "scipy", "casadi", "opencv-contrib-python-headless", "av", "ezc3d")
_CHUNK_BYTES = 2**20


def provenance(
    session: Session, inputs: Iterable[Path], settings: Mapping[str, Any]
) -> dict[str, Any]:
    """Versions, settings and the SHA-256 of every input, for a result's `provenance` key.

    Args:
        session: its inputs are named as its folder holds them, wherever that folder is.
        inputs: files and folders; a folder counts with all its files, what is absent is left out.
        settings: the flags that change the result.
    """
    return {
        "versions": {"freeswing": __version__, "python": platform.python_version(), **_versions()},
        "settings": dict(settings),
        "inputs": hashes(session, inputs),
    }


def is_current(
    result: Path,
    session: Session,
    inputs: Iterable[Path],
    settings: Mapping[str, Any],
    outputs: Iterable[Path] = (),
) -> bool:
    """Whether `result` was made by this version from these very inputs and settings.

    Args:
        result: the stage's main file.
        session: where inputs and outputs are named from.
        inputs: what it reads.
        settings: those that it would be made with now.
        outputs: the stage's other files; each has to be there as it was written.
    """
    made = read_provenance(result)
    if made.versions is None or made.versions.get("freeswing") != __version__:
        return False
    try:
        if made.settings != json.loads(json.dumps(dict(settings))):
            return False
        intact = dict(made.outputs or {}) == hashes(session, outputs)
        return intact and made.inputs == hashes(session, inputs)
    except (OSError, ValueError, TypeError):
        return False


def hashes(session: Session, inputs: Iterable[Path]) -> dict[str, str]:
    """SHA-256 of each input file that is there, by its name in the session."""
    files = {file for place in inputs for file in _files(place)}
    return {_name(file, session): _sha256(file) for file in sorted(files)}


def _files(place: Path) -> list[Path]:
    if place.is_dir():
        return [file for file in place.rglob("*") if file.is_file() and file.name[0] != "."]
    return [place] if place.is_file() else []


def _name(file: Path, session: Session) -> str:
    """Results have the same name wherever they are kept: the same inputs, the same file."""
    if file.is_relative_to(session.results):
        return f"results/{file.relative_to(session.results).as_posix()}"
    folder = session.folder
    return (file.relative_to(folder) if file.is_relative_to(folder) else file).as_posix()


def _sha256(file: Path) -> str:
    digest = hashlib.sha256()
    with file.open("rb") as stream:
        while chunk := stream.read(_CHUNK_BYTES):
            digest.update(chunk)
    return digest.hexdigest()


def _versions() -> dict[str, str]:
    found = {}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found
