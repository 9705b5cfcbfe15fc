"""Time stamps of a recording's frames, with dropped, repeated and late ones told apart."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from freeswing.calib.board.recordings import Recording, stamp_file, stamp_rows
from freeswing.cdpr.files.documents import InputError


def run_stamps(
    recording: Recording, frame_rate_hz: float | None
) -> tuple[dict[int, float] | None, float | None]:
    """Stamps by frame number from `<camera>.csv` beside the recording, or the rate that serves.

    A stamp that does not come after the one before is left out: the frame is a repeated one.

    Raises:
        InputError: when the file is not `frame,t_s`, or there is neither file nor rate.
    """
    path = stamp_file(recording)
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
    stamps: dict[int, float] = {}
    last = -np.inf
    for _, number, time in stamp_rows(path):
        if time > last and number not in stamps:
            stamps[number] = last = time
    return stamps
