"""Which frames of a recording the board is looked for in: all, bursts, or the middle."""

from __future__ import annotations

import numpy as np

MOST_FRAMES = 600
BURST = 5  # frames: three tell a smooth motion, of these three middles are told


def in_bursts(count: int) -> set[int]:
    """Of so many frames all, or bursts of `BURST` spread evenly."""
    if count <= MOST_FRAMES:
        return set(range(count))
    starts = np.linspace(0, count - BURST, MOST_FRAMES // BURST).round().astype(int)
    return {int(start + k) for start in starts for k in range(BURST)}


def middle_frames(count: int) -> set[int]:
    """The middle ones, `MOST_FRAMES` at most."""
    first = max((count - MOST_FRAMES) // 2, 0)
    return set(range(first, min(first + MOST_FRAMES, count)))
