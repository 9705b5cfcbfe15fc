"""Whether the board moves on smoothly through a frame, or a cut or a new pose lies there."""

from __future__ import annotations

import numpy as np

from freeswing.calib.camera.lens_models import Array

LEAST_FLOW = 4  # corners: a median of fewer follows one that is misread
# Of the way in two frames: hands turn a board about within ten frames, cuts jump.
_LARGEST_BEND = 0.35


def smoothness(pixels: Array, stamps_s: Array, numbers: np.ndarray) -> tuple[np.ndarray, Array]:
    """How the board moves through each frame.

    It moves on smoothly where the bend of its way over three frames is small beside the step, or
    beside the recording's usual step: where it turns round it hardly moves, and yet is not cut.

    Args:
        pixels: of the board's corners, NaN where unseen, (n, n_corners, 2).
        stamps_s: of the frames, (n,).
        numbers: of the frames, (n,).

    Returns:
        1 where the frame and its two neighbours show one smooth motion, -1 where they do not (a
        cut, a new pose), 0 where too little is seen to tell, (n,); and the image speed of the
        board in px/s where the motion is smooth, else 0, (n,).

    Source:
        Abramowitz, Stegun 1964, Handbook of Mathematical Functions, sec. 25.3: central
        differences.
    """
    smooth, speed = np.zeros(len(numbers), dtype=int), np.zeros(len(numbers))
    if len(numbers) < 3:
        return smooth, speed
    ahead, behind = pixels[2:] - pixels[1:-1], pixels[1:-1] - pixels[:-2]
    known = np.isfinite(ahead + behind)[..., 0]
    span = stamps_s[2:] - stamps_s[:-2]
    told = (numbers[2:] - numbers[:-2] == 2) & (known.sum(axis=1) >= LEAST_FLOW) & (span > 0.0)
    bend, step = np.full(len(told), np.nan), np.full(len(told), np.nan)
    for row in np.flatnonzero(told):
        both = known[row]
        bend[row] = np.median(np.linalg.norm((ahead - behind)[row, both], axis=-1))
        step[row] = np.median(np.linalg.norm((ahead + behind)[row, both], axis=-1))
    usual = float(np.median(step[told])) if told.any() else 0.0
    goes_on = told & (bend < _LARGEST_BEND * np.maximum(step, usual) + 1.0)
    smooth[1:-1] = goes_on.astype(int) - (told & ~goes_on)
    speed[1:-1][goes_on] = (step / span)[goes_on]
    return smooth, speed
