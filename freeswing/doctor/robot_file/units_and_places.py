"""The robot file: units and places that cannot be meant."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from freeswing.cdpr.robot import LARGEST_FRAME_M, Robot
from freeswing.doctor.finding import Finding

# A platform of 30 mm would read 30 m; none that hangs on cables is larger than 20 m.
LARGEST_PLATFORM_M = 20.0
# The smallest groove, 1 mm, would read 1 m; drums of cranes reach half a metre in radius.
LARGEST_PULLEY_M = 0.5
# At sea level 9.780 at the equator to 9.832 at the poles (WGS 84), 0.003 less a kilometre up; wider
# by what people round off: 9.7 and 9.9 are slips, 9.8 and 9.81 are not.
LEAST_GRAVITY_M_S2 = 9.70
MOST_GRAVITY_M_S2 = 9.90
# Two holes nearer than a millimetre are one hole, or a line that was copied.
SAME_POINT_M = 1e-3


def robot_findings(robot: Robot) -> Iterator[Finding]:
    """Millimetres given as metres, mirrored gravity, attachments that coincide."""
    sizes = (
        ("entry_m", np.abs(robot.entries_m).max(), LARGEST_FRAME_M),
        ("attachment_m", np.abs(robot.attachments_m).max(), LARGEST_PLATFORM_M),
        ("pulley_radius_m", robot.radii_m.max(), LARGEST_PULLEY_M),
    )
    for key, largest, limit in sizes:
        if largest > limit:
            text = f"{key} reaches {largest:g} m, more than {limit:g} m"
            yield Finding("error", "robot", text, "all lengths are in metres")
    gravity = float(np.linalg.norm(robot.gravity_m_s2))
    low, high = LEAST_GRAVITY_M_S2, MOST_GRAVITY_M_S2
    if not low <= gravity <= high:
        text = f"gravity is {gravity:.4g} m/s², on Earth {low} to {high}"
        yield Finding("warning", "robot", text, "check gravity_m_s2")
    yield from _above(robot)
    yield from _together(robot)
    if robot.platform.com_m is None or robot.platform.specific_inertia_m2 is None:
        yield Finding("note", "robot", "no nominal inertia", "CAD values help the first guess")


def _above(robot: Robot) -> Iterator[Finding]:
    """Suspended platforms hang below their pulleys; upside-down gravity is a usual sign error."""
    down = robot.gravity_m_s2 / np.linalg.norm(robot.gravity_m_s2)
    depth = robot.attachments_m @ down
    if robot.platform.com_m is not None and float(robot.platform.com_m @ down) < depth.min() - 1e-9:
        text = "the centre of mass lies above every cable attachment at zero angles"
        yield Finding("warning", "robot", text, "check com_m and the sign of gravity_m_s2")


def _together(robot: Robot) -> Iterator[Finding]:
    names = [cable.name for cable in robot.cables]
    for points, what in ((robot.attachments_m, "attachment_m"), (robot.entries_m, "entry_m")):
        gaps = np.linalg.norm(points[:, None] - points[None], axis=2)
        for i, k in np.argwhere(np.triu(gaps < SAME_POINT_M, 1)):
            text = f"cables {names[i]} and {names[k]} have the same {what}"
            yield Finding("note", "robot", text, "check for a copied line if that is not meant")
