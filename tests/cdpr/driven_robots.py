"""Driven robots for tests: the sample, and one with pulleys, an off-centre mass and odd motors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from freeswing.cdpr.driven.model import DrivenModel, build_driven
from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.robot import Cable, Platform, Robot
from freeswing.cdpr.rotation import quaternion_from_matrix
from tests.places import SAMPLES

INCA = SAMPLES / "inca-6d" / "robot.toml"


def inca(effects: tuple[str, ...] = ()) -> DrivenModel:
    """The sample's robot."""
    return build_driven(read_robot(INCA), effects)


def odd_robot(n_cables: int = 8) -> Robot:
    """Swivel pulleys, mass off the origin, a full tensor; declared points as in the sample."""
    robot = read_robot(INCA)
    drive = replace(
        robot.drive,
        entries=robot.drive.entries[:n_cables],
        attachments=robot.drive.attachments[:n_cables],
        motors=robot.drive.motors[:n_cables],
    )
    com = np.array([0.01, -0.02, 0.015])
    tensor = np.array([1.1e-3, 1.3e-3, 1.5e-3, 1e-4, -2e-4, 1.5e-4])
    cables = tuple(_over_pulley(cable) for cable in robot.cables[:n_cables])
    return replace(robot, cables=cables, platform=Platform(0.4, com, tensor / 0.4), drive=drive)


def _over_pulley(cable: Cable) -> Cable:
    """A pulley of 30 mm that swivels about the vertical, its groove facing the centre."""
    inward = -cable.entry_m * [1.0, 1.0, 0.0]
    x = inward / np.linalg.norm(inward)
    z = np.array([0.0, 0.0, np.sign(cable.entry_m[2])])
    return replace(cable, pulley_radius_m=0.03, swivel_x=x, swivel_y=np.cross(z, x), swivel_z=z)


def random_states(n: int, seed: int = 0) -> np.ndarray:
    """States near the centre, in motion, (n, 13)."""
    rng = np.random.default_rng(seed)
    turns = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
    turns *= np.linalg.det(turns)[:, None, None]
    small = np.array([np.eye(3)] * n) + 0.3 * (turns - np.eye(3))
    left, _, right = np.linalg.svd(small)
    quaternions = quaternion_from_matrix(left @ right)
    position, speed = rng.uniform(-0.3, 0.3, (n, 3)), rng.normal(size=(n, 6))
    return np.hstack([position, quaternions, speed])
