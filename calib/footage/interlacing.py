"""Frames torn by interlacing: two moments in one frame, in its even and in its odd rows."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from freeswing.calib.board.recordings import Recording
from freeswing.calib.footage.change_kernels import bends

Image = NDArray[np.uint8]

_MOVED_GREY = 24.0
"""A pixel that changes by more was passed by an edge."""
_LEAST_MOVED = 200  # pixels: one edge of 20 px that went by ten
COMB_RATIO = 1.1
"""Bend from row to row over bend from every second row to the next, where things move. Pictures of
one moment have 0.3 to 0.5 (1.0 would be pure noise), two moments in one frame 1.4 and more."""


def comb_ratio(before: Image, image: Image) -> float:
    """How torn the moving parts of a frame are, NaN where too little moves."""
    count, near, far = bends(before, image, int(_MOVED_GREY))
    return float(near / max(far, 1)) if count >= _LEAST_MOVED else float("nan")


def is_torn(ratios: ArrayLike) -> bool:
    """Whether frames with these ratios, NaN where too little moves, are torn."""
    told = np.asarray(ratios, dtype=float)
    told = told[np.isfinite(told)]
    return len(told) > 0 and float(np.median(told)) > COMB_RATIO


def torn_text(recording: Recording) -> str:
    """What to say of a recording whose frames are torn."""
    return (
        f"{recording.path}: interlaced: its even rows show another moment than its odd ones. Film "
        "progressive, or keep one field (ffmpeg -vf field), and calibrate at that size"
    )
