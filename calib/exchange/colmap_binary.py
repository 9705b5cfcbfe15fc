"""COLMAP's binary models, rigs included, by COLMAP itself.

pycolmap reads and writes them; our own reader and writer are those of the text model. It works in
a process of its own: on damaged files COLMAP may end the process or not come back, measured on 23
files with a few bytes changed.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from freeswing.calib.camera.camera import Camera
from freeswing.calib.exchange import colmap
from freeswing.cdpr.files.documents import InputError, replace_file

# COLMAP reads some ten thousand images a second; a model of a rig has a dozen.
_LONGEST_S = 40.0
# An image point takes 24 bytes, in text 40: what grows more is made up from a damaged count.
_GROWTH, _HEADER_BYTES = 16, 2**20
_GUARD = """
import sys
if sys.platform == "linux":
    import ctypes
    ctypes.CDLL(None).prctl(1, 9)  # PR_SET_PDEATHSIG: it ends with the process that started it
if sys.platform != "win32":
    import resource
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[4]),) * 2)
"""
_CONVERT = """
import pycolmap
model = pycolmap.Reconstruction()
if sys.argv[3] == "text":
    model.read_binary(sys.argv[1])
    model.write_text(sys.argv[2])
else:
    model.read_text(sys.argv[1])
    model.write_binary(sys.argv[2])
"""


def read(path: Path, tell: Callable[[str], None]) -> tuple[Camera, ...]:
    """One camera an image, as from a text model; images of a rig have the rig's poses.

    Raises:
        InputError: when COLMAP cannot read it.
    """
    folder = path if path.is_dir() else path.parent
    with tempfile.TemporaryDirectory() as text:
        _converted(folder, Path(text), "text")
        return colmap.read_text_model(Path(text), folder, tell)


def write(path: Path, cameras: Sequence[Camera]) -> None:
    """A binary model in which each camera is one image `<camera>.png`."""
    with tempfile.TemporaryDirectory() as text, tempfile.TemporaryDirectory() as binary:
        colmap.write(Path(text), cameras)
        _converted(Path(text), Path(binary), "binary")
        for file in sorted(Path(binary).iterdir()):
            replace_file(path / file.name, file.read_bytes())


def _converted(source: Path, target: Path, kind: str) -> None:
    size = sum(file.stat().st_size for file in source.iterdir() if file.is_file())
    most = str(_GROWTH * size + _HEADER_BYTES)
    words = [
        sys.executable,
        "-c",
        _GUARD + _CONVERT,
        str(source.resolve()),
        str(target),
        kind,
        most,
    ]
    try:
        done = subprocess.run(words, capture_output=True, timeout=_LONGEST_S, check=False)
    except subprocess.TimeoutExpired as error:
        raise InputError(f"{source}: COLMAP did not come to an end with it: damaged?") from error
    if done.returncode != 0:
        lines = done.stderr.decode(errors="replace").strip().splitlines()
        why = next((line for line in lines if "Check failed" in line or "Error" in line), "")
        raise InputError(f"{source}: COLMAP cannot read its binary model: {why[:200] or 'damaged'}")
