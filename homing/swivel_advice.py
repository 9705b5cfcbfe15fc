"""Which way the pulleys should swivel so that homing is well conditioned.

The paper leaves this open: the orientation of the swivel axes "plays a crucial role for the
conditioning of problem (21)". Each axis is tried along the faces, edges and corners of a cube, one
pulley after another until nothing improves, and judged by the start pose's standard deviation at
the procedure's own set-points.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.robot import Cable, Robot
from freeswing.cdpr.system.progress import Progress
from freeswing.homing.arrow_least_squares import covariance
from freeswing.homing.fit_start_pose import StartProblem
from freeswing.homing.guess_from_tensions import (
    TensionEnergy,
    acquisition_tensions,
    free_indices,
    stable_starts,
)
from freeswing.homing.homing_files import Homing, ReadingNoise, Readings
from freeswing.homing.rest_readings import RestModel
from freeswing.homing.simulated_acquisition import default_tensions

Array = NDArray[np.float64]

_POSES = 25
_SMALLEST_ARM_RADII = 3.0  # a cable nearer to its swivel axis jumps round the pulley
_SMALLEST_ARM_SHARE = 0.15  # of its length: nearer, the swivel turns faster than it is read
_WORTHWHILE = 0.99  # an axis is turned for one per cent, not for rounding
_SWEEPS = 3


@dataclass(frozen=True, slots=True)
class HomingQuality:
    """How well a robot could be homed.

    Attributes:
        position_std_m: root of the summed variances of the start position.
        angle_std_rad: the same of the start angles.
        conditioning: largest over smallest singular value of the start angles' and lengths' part.
    """

    position_std_m: float
    angle_std_rad: float
    conditioning: float


def advise(robot_path: Path | str, progress: Progress | None = None) -> dict:
    """Advise on the swivel axes: the content of homing-advice.json.

    Args:
        robot_path: robot.toml with the platform's mass and centre of mass.
        progress: told a label and a fraction from 0 to 1.

    Raises:
        InputError: the robot file is wrong.
        DataError: the robot has no stable rest at the usual tensions.
    """
    say = progress or (lambda _label, _fraction: None)
    robot_path = Path(robot_path)
    robot = read_robot(robot_path)
    noise = ReadingNoise(sigma_rad=1e-4, stated=True)
    declared = homing_quality(robot, noise)
    if declared is None:
        raise DataError(f"{robot_path}: the pulleys as declared cannot be homed at all")
    better, quality = better_axes(robot, noise, say)
    return {
        "format": "freeswing-homing-advice/1",
        "assumed_std": {
            "sigma_rad": noise.sigma_rad,
            "length_m": noise.length_m,
            "statics": noise.statics,
        },
        "declared": _quality_entry(declared),
        "advised": _quality_entry(quality),
        "cables": [
            {
                "name": new.name,
                "changed": bool(np.abs(new.swivel_z - old.swivel_z).max() > 1e-9),
                "swivel_x": new.swivel_x,
                "swivel_y": new.swivel_y,
                "swivel_z": new.swivel_z,
            }
            for new, old in zip(better.cables, robot.cables, strict=True)
        ],
    }


def better_axes(
    robot: Robot, noise: ReadingNoise, progress: Progress
) -> tuple[Robot, HomingQuality]:
    """The robot with swivel axes that determine the start position best, and how well.

    Raises:
        DataError: when the robot cannot be homed as declared.
    """
    best = homing_quality(robot, noise)
    if best is None:
        raise DataError("the pulleys as declared cannot be homed; correct the robot file")
    steps = _SWEEPS * robot.n_cables
    for step in range(steps):
        progress("axes", step / steps)
        index = step % robot.n_cables
        before = best
        for axis in _directions():
            trial = _with_axis(robot, index, axis)
            quality = None if trial is None else homing_quality(trial, noise)
            if quality and trial and quality.position_std_m < _WORTHWHILE * best.position_std_m:
                robot, best = trial, quality
        if step >= robot.n_cables and best is before and index == robot.n_cables - 1:
            break
    return robot, best


def homing_quality(robot: Robot, noise: ReadingNoise) -> HomingQuality | None:
    """Covariance of the start pose at the procedure's set-points; None where it cannot work.

    A swivel axis cannot work where a cable comes near its line or has no stable rest.
    """
    poses = _procedure_poses(robot)
    if poses is None or not _is_clear(robot, poses):
        return None
    empty = np.zeros((_POSES, robot.n_cables))
    tensions = np.ones(robot.n_cables)
    homing = Homing(robot, Readings(empty, empty), tensions, tensions, noise)
    problem = StartProblem(homing, RestModel(robot, free_indices(robot, poses[0])), None)
    linear = problem.linearize(noise, poses, problem.start_border(poses[0]))
    spread = covariance(linear, np.ones_like(linear.residuals))
    if spread.rank < problem.n_border:
        return None
    variances = np.diag(spread.block(0))
    return HomingQuality(
        float(np.sqrt(variances[:3].sum())),
        float(np.sqrt(variances[3:].sum())),
        spread.conditioning,
    )


def _procedure_poses(robot: Robot) -> Array | None:
    start, largest = default_tensions(robot)
    mass = robot.platform.mass_kg or 1.0
    pulls = acquisition_tensions(start, largest, _POSES)
    pulls = pulls / (mass * np.linalg.norm(robot.gravity_m_s2))
    energy = TensionEnergy(robot)
    starts = stable_starts(energy, pulls[0])
    if not len(starts):
        return None
    rest = energy.settle(np.tile(starts[0], (_POSES, 1)), pulls)
    return rest.poses if rest.settled.all() else None


def _is_clear(robot: Robot, poses: Array) -> bool:
    """Whether every cable keeps away from the line of its swivel axis."""
    from freeswing.cdpr.rotation import matrix_from_angles

    turned = np.einsum("tij,nj->tni", matrix_from_angles(poses[:, 3:]), robot.attachments_m)
    spans = poses[:, None, :3] + turned - robot.entries_m
    local = np.einsum("nij,tnj->tni", robot.swivel_axes, spans)
    arms = np.linalg.norm(local[..., :2], axis=-1)
    smallest = _SMALLEST_ARM_RADII * robot.radii_m
    far = np.linalg.norm(local, axis=-1) * _SMALLEST_ARM_SHARE
    return bool((arms > np.maximum(smallest, far)).all())


def _directions() -> list[Array]:
    cells = [
        np.array(cell, dtype=np.float64) for cell in product((-1, 0, 1), repeat=3) if any(cell)
    ]
    return [cell / np.linalg.norm(cell) for cell in sorted(cells, key=np.linalg.norm)]


def _with_axis(robot: Robot, index: int, axis: Array) -> Robot | None:
    """The robot with one swivel axis turned; x faces the middle of the pulleys."""
    cable = robot.cables[index]
    inward = robot.entries_m.mean(axis=0) - cable.entry_m
    inward = inward + 0.5 * np.linalg.norm(inward) * robot.gravity_m_s2 / np.linalg.norm(
        robot.gravity_m_s2
    )
    across = inward - (inward @ axis) * axis
    if np.linalg.norm(across) < 1e-6 * np.linalg.norm(inward):
        return None
    x = across / np.linalg.norm(across)
    turned: Cable = replace(cable, swivel_x=x, swivel_y=np.cross(axis, x), swivel_z=axis)
    cables = [turned if k == index else other for k, other in enumerate(robot.cables)]
    return replace(robot, cables=tuple(cables))


def _quality_entry(quality: HomingQuality) -> dict:
    return {
        "position_std_m": quality.position_std_m,
        "angle_std_rad": quality.angle_std_rad,
        "conditioning": quality.conditioning,
    }
