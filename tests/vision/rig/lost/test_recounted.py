"""Where lost frames are not looked for, it is said of cameras whose stamps may hide some."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.vision.rig.lost.recounted import not_looked_for

EVEN = np.arange(60) / 30.0
UNEVEN = EVEN + np.random.default_rng(1).uniform(-0.01, 0.01, 60)


def view(name: str, stamps_s: np.ndarray) -> Any:
    return SimpleNamespace(camera=SimpleNamespace(name=name), stamps_s=stamps_s)


@pytest.mark.parametrize(
    ("stamps_s", "said"),
    [
        (EVEN, True),
        (np.where(np.arange(60) == 7, np.nan, EVEN), True),
        (np.repeat(EVEN, 2), True),
        (np.sort(UNEVEN), False),
        (EVEN[:20], False),
    ],
)
def test_even_stamps_may_hide_lost_frames(stamps_s: np.ndarray, said: bool) -> None:
    told = not_looked_for([view("left", stamps_s), view("phone", np.sort(UNEVEN))], "without tags")
    assert [one.startswith("left: stamps are even") for one in told] == [True] * said, told


def test_a_camera_is_named_once() -> None:
    (told,) = not_looked_for([view("left", EVEN), view("left", EVEN)], "by one camera from above")
    assert told.startswith("left: stamps")
    assert "not looked for by one camera from above" in told
