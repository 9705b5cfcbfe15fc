"""Rows that were lost while the stamps were counted on: steps twice as long, in all coordinates.

Exports that number their rows, and stamps made from the number and a rate, hide what the capture
dropped. Whatever was swinging then goes on twice as far in one step, along the line that it moved
on, and a time base that is late ever after gives modes of other frequencies.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.measured.held_doubled_wild import NORMAL_BY_MAD
from freeswing.cdpr.measured.trajectory import Trajectory

Array = NDArray[np.float64]

# A step so many times as long as what steps usually differ from those around: then twice of it is
# no noise.
CLEAR_STEPS = 6.0
# Twice or three times the steps around, to so much of these, in size and to the side; these agree
# with each other to twice that.
TO_WITHIN = 0.25
# Of a step: one that took longer has its gap in the stamps.
EVEN = 0.3
LEAST_SAMPLES = 20


def lost_rows(trajectory: Trajectory) -> Array:
    """Times before which rows are missing without a gap in the stamps, (n,).

    Source:
        Rousseeuw, Croux 1993, Alternatives to the median absolute deviation, for the scale of what
        steps usually differ from those around.
    """
    times_s, values = trajectory.times_s, trajectory.values
    took_s = np.diff(times_s)
    if len(took_s) < LEAST_SAMPLES:
        return np.zeros(0)
    steps = np.diff(values, axis=0)
    around, apart = 0.5 * (steps[:-2] + steps[2:]), steps[2:] - steps[:-2]
    here = steps[1:-1]
    even = np.abs(took_s - np.median(took_s)) < EVEN * np.median(took_s)
    known = np.isfinite(around + here).all(axis=1) & even[:-2] & even[1:-1] & even[2:]
    if not known.any():
        return np.zeros(0)
    usual = NORMAL_BY_MAD * np.median(np.abs((here - around)[known]), axis=0)
    moving = usual > 0.0  # what stands still to the last digit tells nothing
    around, apart, here = (
        np.where(known[:, None], one, 0.0)[:, moving] / usual[moving]
        for one in (around, apart, here)
    )
    size = np.linalg.norm(around, axis=1)
    clear = size > CLEAR_STEPS
    square = np.where(clear, size, 1.0) ** 2
    times = np.sum(here * around, axis=1) / square
    aside = np.linalg.norm(here - times[:, None] * around, axis=1)
    whole = np.round(times)
    lost = (
        clear
        & (whole >= 2.0)
        & (np.abs(times - whole) < TO_WITHIN)
        & (aside < TO_WITHIN * size)
        & (np.linalg.norm(apart, axis=1) < 2.0 * TO_WITHIN * size)
    )
    return times_s[2:-1][lost]
