"""From which numbers on a camera was moved, late or slow to read: both sides of each limit."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.vision.rig.correct_rig import is_real
from freeswing.vision.rig.rig_effects import LEAST_CLOCK_S, LEAST_LINE_S, was_moved


@pytest.mark.parametrize(("miss_px", "moved"), [(0.39, False), (0.41, True)])
def test_base_tags_that_lie_off(miss_px, moved) -> None:
    assert was_moved(np.array([0.01, miss_px, miss_px, miss_px, 50.0])) == moved


@pytest.mark.parametrize(
    ("value", "deviation", "least", "real"),
    [
        (-4.9e-5, 1e-6, LEAST_CLOCK_S, False),
        (-5.1e-5, 1e-6, LEAST_CLOCK_S, True),
        (2.9e-7, 1e-9, LEAST_LINE_S, False),
        (3.1e-7, 1e-9, LEAST_LINE_S, True),
        (5.9e-3, 1e-3, LEAST_CLOCK_S, False),
        (6.1e-3, 1e-3, LEAST_CLOCK_S, True),
    ],
)
def test_what_is_surely_not_zero(value, deviation, least, real) -> None:
    assert is_real(np.array([value]), np.array([deviation]), least).tolist() == [real]
