"""From where on a controlled platform is not held, shakes, or is lost."""

from __future__ import annotations

import numpy as np

from freeswing.servo.synthesis.state_space import Array

# Ten times what friction leaves of the paper's own controller on a robot as it was identified: a
# platform this far off after its step is not being controlled.
HELD_M = 0.05
HELD_RAD = 0.35
# A platform this far from where it is asked to be is lost, not late.
LOST_M = 1.0


def is_held(left_m: float, left_rad: float) -> bool:
    """Whether so little is left of a step."""
    return not (left_m > HELD_M or left_rad > HELD_RAD)


def is_shaking(jitter_m: float) -> bool:
    """Whether the platform does not come to rest after a step."""
    return jitter_m > HELD_M


def is_lost(off_m: Array) -> bool:
    """Whether a place is so far from the asked one, axis by axis, (3,)."""
    return not np.abs(off_m).max() < LOST_M
