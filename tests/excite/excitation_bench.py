"""The paper's 4-cable robot with its nominal values and 12 kg, and swings made once."""

from __future__ import annotations

from functools import cache

import numpy as np

from freeswing.cdpr.model.equations import build_model
from freeswing.excite.random_swings import random_swing
from freeswing.excite.swing import Bench, Swing
from tests.paper_robots import bologna_4


@cache
def paper_bench() -> Bench:
    """20 to 200 N, 0.1 m, 100 samples over 10 s."""
    robot = bologna_4()
    return Bench(build_model(robot), robot.inertia, 12.0, ("x", "y"))


@cache
def swings(count: int, seed: int = 0) -> tuple[Swing, ...]:
    """Random swings within the limits."""
    rng = np.random.default_rng(seed)
    return tuple(random_swing(paper_bench(), rng) for _ in range(count))
