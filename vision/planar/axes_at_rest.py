"""A film from above shows the platform's axes at rest alone: the base frame's have to be these."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.robot import Robot

STRAIGHT_RAD = 0.05  # as well as one sets tags and wires square to each other


def check_hangs_straight(path: Path, robot: Robot) -> None:
    """One camera from above shows the platform's axes at rest: the base frame's have to be these.

    Args:
        path: of robot.toml, for the message.
        robot: two or three wires.

    Raises:
        InputError: where robot.toml has them turned against each other.
    """
    above = (robot.entries_m - robot.entries_m.mean(axis=0))[:, :2]
    below = (robot.attachments_m - robot.attachments_m.mean(axis=0))[:, :2]
    turn = np.arctan2(
        np.sum(below[:, 0] * above[:, 1] - below[:, 1] * above[:, 0]), np.sum(below * above)
    )
    if abs(turn) > STRAIGHT_RAD:
        raise InputError(
            f"{path}: the wires' upper ends are turned by {np.degrees(turn):.1f} degrees "
            "against the lower ones: a film from above shows the platform's axes alone, so that "
            "the base frame's have to be the platform's at rest; write entry_m in these"
        )
