"""Time stamps of a recording's frames, with dropped, repeated and late ones told apart."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from calib.recordings import Recording
from cdpr.documents import InputError, read_text

Array = NDArray[np.float64]

_MOST_BYTES = 1 << 28


def run_stamps(
    recording: Recording, frame_rate_hz: float | None
) -> tuple[dict[int, float] | None, float | None]:
    """Stamps by frame number from `<camera>.csv` beside the recording, or the rate that serves.

    A stamp that does not come after the one before is left out: the frame is a repeated one.

    Raises:
        InputError: when the file is not `frame,t_s`, or there is neither file nor rate.
    """
    path = recording.path.parent / f"{recording.name}.csv"
    if path.is_file():
        return _read(path), None
    if frame_rate_hz is None:
        raise InputError(
            f"{recording.path}: has no {path.name} with frame,t_s beside it, and the session "
            "states no frame_rate_hz: add one of them"
        )
    return None, frame_rate_hz


def stamp_of(number: int, stamps: dict[int, float] | None, rate_hz: float | None) -> float:
    """A frame's stamp in seconds, NaN when it has none."""
    if stamps is not None:
        return stamps.get(number, float("nan"))
    return number / rate_hz if rate_hz else float("nan")


def _read(path: Path) -> dict[int, float]:
    lines = read_text(path, _MOST_BYTES).splitlines()
    if not lines or [part.strip() for part in lines[0].split(",")][:2] != ["frame", "t_s"]:
        raise InputError(f"{path}: the first line must be frame,t_s")
    stamps: dict[int, float] = {}
    last = -np.inf
    for row, line in enumerate(lines[1:], start=2):
        if not line.strip():
            continue
        try:
            frame, stamp = line.split(",")[:2]
            number, time = int(frame), float(stamp)
        except ValueError as error:
            raise InputError(f"{path}: line {row}: {line[:60]!r} is not frame,t_s") from error
        if not np.isfinite(time):
            raise InputError(f"{path}: line {row}: the stamp {stamp!r} is not a number of seconds")
        if time > last and number not in stamps:
            stamps[number] = last = time
    return stamps
