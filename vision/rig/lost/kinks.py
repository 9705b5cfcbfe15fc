"""Steps at which the platform was knocked, let go or held: its motion goes on from where it was.

Frames that are lost move the platform by what they would have shown, so that what came before and
what comes after do not meet. After a knock or a release they do, and only their speeds differ.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.vision.rig.lost.usual_stretches import FITS, Stretches

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

MEETS = 4.0
"""Mean square of what is between both, in what is expected: six normal numbers exceed it once in
two thousand times; of 230 knocks and releases at 20 Hz 1.4 at most, at 60 Hz 4.0, and half of the
places where five frames were lost leave 70 and more."""
_SEEN = 8
"""Frames to each side from which the motion is continued; fewer where a film begins or ends."""
_LEAST_SEEN = 4
_LONGEST = 3
"""Steps that a knock takes: farther than so many no motion is continued to within its noise."""
_TRIED = 10
"""Times in a step at which it may have happened."""


def is_kink(stretches: Stretches, steps: list[int]) -> bool:
    """Whether the motion before some neighbouring steps, or one beside them, meets that after."""
    count = len(stretches.numbers)
    reach = range(max(steps[0] - 1, 0), min(steps[-1] + 2, count - 1))
    for first, last in [(i, j) for i in reach for j in reach if 0 <= j - i < _LONGEST]:
        before = np.arange(max(first - _SEEN + 1, 0), first + 1)
        after = np.arange(last + 1, min(last + 1 + _SEEN, count))
        apart = _apart(stretches, before, after)
        fits = [stretches.unlikeliness(rows, stretches.pattern(rows)) for rows in (before, after)]
        if apart is not None and all(one is not None and one[1] <= FITS for one in fits):
            between, spread = apart
            if np.min(np.mean(between**2, axis=1) / spread) < MEETS:
                return True
    return False


def kink_unlikeliness(stretches: Stretches, frames: Ints) -> float:
    """Minus twice the log likelihood of frames with a kink at the step where it is likeliest.

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 3.4: odds of models.
    """
    least = np.inf
    for split in range(_LEAST_SEEN, len(frames) - _LEAST_SEEN + 1):
        before, after = frames[:split], frames[split:]
        told = [stretches.unlikeliness(rows, stretches.pattern(rows)) for rows in (before, after)]
        apart = _apart(stretches, before, after)
        if apart is not None and told[0] is not None and told[1] is not None:
            between, spread = apart
            # a unit combination of all frames is the means' difference over this root
            unit = 1.0 / len(before) + 1.0 / len(after)
            link = np.sum(between**2, axis=1) / spread + between.shape[1] * np.log(spread / unit)
            least = min(least, told[0][0] + told[1][0] + float(link.min()))
    return least


def _apart(stretches: Stretches, before: Ints, after: Ints) -> tuple[Array, Array] | None:
    """By how much two pieces of a motion miss each other at times between them, and variances.

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, eq. 2.96: conditional Gaussians.
    """
    numbers, values = stretches.numbers, stretches.values
    steps = int(numbers[after[0]] - numbers[before[-1]])
    if steps > _LONGEST or min(len(before), len(after)) < _LEAST_SEEN:
        return None
    nodes = np.arange(-1, steps + 2)
    ends = []
    for rows, ahead in ((before, np.arange(1, steps + 2)), (after, np.arange(-1, steps))):
        own = numbers[rows] - numbers[before[-1]]
        times = np.union1d(own, ahead)
        usual = stretches.usual(times - times[0])
        if usual is None or not np.isin(nodes, times).all():
            return None
        samples, covariance = usual.ahead(np.searchsorted(times, own), values[rows])
        both = np.searchsorted(times, nodes)
        ends.append((samples[both], covariance[np.ix_(both, both)]))
    at = np.linspace(0.0, steps, _TRIED * steps + 1)
    weights = np.linalg.solve(np.vander(nodes.astype(float)).T, np.vander(at, len(nodes)).T).T
    spread = np.einsum("an,nm,am->a", weights, ends[0][1] + ends[1][1], weights)
    return weights @ (ends[0][0] - ends[1][0]), spread
