"""How far a platform on two wires leans at rest, and what a spirit level says of it.

Two wires let a platform roll until all that hangs on them lies under the line of their lower ends.
Where no run measures the roll, a level on the platform does.
"""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.robot import Array, Robot


def lean(total: Array, robot: Robot) -> tuple[float, Array]:
    """Roll at rest about the line of the wires' lower ends, rad, and its slope by moments, (10,).

    Args:
        total: moments about P of all that hangs there, (10,).
        robot: of two wires.

    Source:
        Featherstone 2008, Rigid Body Dynamics Algorithms, sec. 2.13: the common centre of mass,
        which hangs under its support.
    """
    ends = robot.attachments_m
    down = robot.gravity_m_s2 / np.linalg.norm(robot.gravity_m_s2)
    across = np.cross(down, ends[1] - ends[0])
    across = across / np.linalg.norm(across)
    centre = total[1:4] / total[0]
    off = centre - ends.mean(axis=0)
    aside, below = float(off @ across), float(off @ down)
    by_centre = (below * across - aside * down) / (aside**2 + below**2)
    slope = np.zeros(10)
    slope[0] = -float(by_centre @ centre) / total[0]
    slope[1:4] = by_centre / total[0]
    return float(np.arctan2(aside, below)), slope
