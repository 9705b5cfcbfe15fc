"""The paper's 4-cable robot with its nominal values and 12 kg, and swings made once."""

from __future__ import annotations

from functools import cache

import numpy as np

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import Cable, Platform, Robot
from freeswing.excite.random_swings import random_swing
from freeswing.excite.swing import Bench, Swing

X, Y, Z = np.eye(3)


def bologna_4() -> Robot:
    """Table 1 and eq. (43) of Ida, Briot, Carricato 2022; the mass is not printed."""
    entries = [
        [0.219, -1.316, 0.527],
        [2.295, -1.158, 0.521],
        [2.153, 0.973, 0.560],
        [0.0532, 0.796, 0.532],
    ]
    attachments = [
        [-0.144, -0.219, 0.264],
        [0.115, -0.233, 0.270],
        [0.142, 0.220, 0.266],
        [-0.120, 0.236, 0.266],
    ]
    axes = [(Y, -Z, -X), (-X, -Z, -Y), (-Y, -Z, X), (X, -Z, Y)]
    cables = [
        Cable(str(k + 1), np.array(entries[k]), 0.025, np.array(attachments[k]), *axes[k])
        for k in range(4)
    ]
    inertia = np.array([0.051, 0.069, 0.037, 0.0, 0.0, 0.0])
    return Robot(
        "bologna-4",
        tuple(cables),
        free_coordinates=("x", "y"),
        platform=Platform(12.0, np.array([0.0, 0.0, 0.19]), inertia),
    )


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
