"""The section [mocap] of session.toml: how the frame of the recordings lies in the base frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import InputError, Reader
from freeswing.cdpr.measured.recording_to_base_frame import UP_TURNS, frame_from_points
from freeswing.cdpr.rotation import transform

Array = NDArray[np.float64]


def read_mocap_frame(reader: Reader | None) -> Array | None:
    """T_base_recorded (4, 4), None without the section; what is wrong goes to the reader."""
    if reader is None:
        return None
    up = reader.optional_string("up", choices=tuple(UP_TURNS))
    points = reader.children("reference", required=False)
    pairs = [(p.vector("recorded_m", 3), p.vector("base_m", 3)) for p in points]
    for point in points:
        point.finish()
    reader.finish()
    if (up is None) == (not pairs):
        reader.add("up, reference", "give one of them: the axis that points up, or three points")
        return None
    if up is not None:
        return transform(UP_TURNS[up], np.zeros(3)) if up in UP_TURNS else None
    recorded, base = (np.array(side) for side in zip(*pairs, strict=True))
    if not (np.isfinite(recorded).all() and np.isfinite(base).all()):
        return None
    try:
        return frame_from_points(recorded, base)
    except InputError as failure:
        reader.add("reference", str(failure))
        return None
