"""A look at a recording's first frames: copies, and frames torn by interlacing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.calib.board.recordings import Recording, read_frames
from freeswing.calib.footage.copied_frames import with_copies
from freeswing.calib.footage.interlacing import comb_ratio, is_torn

_ENOUGH_MOVING = 12  # pairs of frames with motion, of which the median is taken
_MOST_FRAMES = 150


@dataclass(frozen=True, slots=True)
class Condition:
    """What a look at a recording's first frames tells.

    Attributes:
        frames: looked at.
        copies: of these, how many only repeat the frame before.
        is_torn: whether what moves is torn into combs: two moments in one frame.
    """

    frames: int
    copies: int
    is_torn: bool


def condition_of(recording: Recording, least: int = 0) -> Condition:
    """Looks until enough frames with motion are seen, and at `least` frames where there are."""
    ratios: list[float] = []
    frames = copies = 0
    before = None
    for (_, _, image), is_copy in with_copies(read_frames(recording)):
        frames += 1
        copies += is_copy
        if before is not None and not is_copy and before.shape == image.shape:
            ratios.append(comb_ratio(before, image))
        before = image
        moving = int(np.isfinite(ratios).sum())
        if frames >= max(_MOST_FRAMES, least) or (moving >= _ENOUGH_MOVING and frames >= least):
            break
    return Condition(frames, copies, is_torn(ratios))
