"""The acquisition procedure of section 4 on a simulated robot, with what real machines add.

The winches hold tensions; transmission friction and repeatability spoil them, so that the platform
settles elsewhere than computed; pulleys stick a little behind their cables, encoders count in steps
and winches tell lengths with an error; what else touches the platform (hoses, stiff cables, air)
pushes it a little from its equilibrium.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import DataError, write_json
from freeswing.cdpr.files.robot_file import read_robot, write_robot
from freeswing.cdpr.robot import Robot
from freeswing.homing.guess_from_tensions import (
    TensionEnergy,
    acquisition_tensions,
    free_indices,
    stable_starts,
)
from freeswing.homing.homing_files import Homing, ReadingNoise, Readings, write_homing
from freeswing.homing.rest_readings import RestModel

Array = NDArray[np.float64]

# Of the weight: what a cable that has gone slack still pulls by its own; at rest it never pushes.
_SLACK_PULL = 0.02


@dataclass(frozen=True, slots=True)
class AcquisitionErrors:
    """What separates a real acquisition from the computed one.

    Attributes:
        friction: share of the tension lost in the transmission, against the cable's motion.
        repeatability_N: standard deviation of a held tension.
        swivel_stick_rad: how far a pulley stays behind its cable, against its motion.
        encoder_bits: of the swivel encoders; 0 for an exact angle.
        length_std_m: standard deviation of a length told by a winch.
        tension_std_N: standard deviation of a tension reading.
        statics: standard deviation of what pushes the platform from its equilibrium, over its
            weight: a share of it along a free x y z, metres about a free phi theta chi.
    """

    friction: float = 0.05
    repeatability_N: float = 0.5
    swivel_stick_rad: float = 0.0
    encoder_bits: int = 16
    length_std_m: float = 5e-4
    tension_std_N: float = 1.0
    statics: float = 1e-4

    @property
    def sigma_std_rad(self) -> float:
        """Standard deviation of a swivel reading: counting steps and sticking."""
        step = 2 * np.pi / 2**self.encoder_bits if self.encoder_bits else 0.0
        return float(np.sqrt(step**2 / 12 + self.swivel_stick_rad**2))


PERFECT = AcquisitionErrors(0.0, 0.0, 0.0, 0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Acquisition:
    """A simulated acquisition and the truth behind it.

    Attributes:
        readings: what the encoders told.
        poses: where the platform was, (N, 6).
        sigma_rad: true swivel angles, (N, n).
        length_m: true cable lengths, (N, n).
        set_points_N: tensions asked for, (N, n).
        tensions_N: tensions there were, (N, n).
    """

    readings: Readings
    poses: Array
    sigma_rad: Array
    length_m: Array
    set_points_N: Array
    tensions_N: Array


def default_tensions(robot: Robot) -> tuple[Array, Array]:
    """Start and largest tensions: equal, one and a half weights in all, and twice that, (n,) each.

    Raises:
        DataError: when the mass is unknown.

    Source:
        Ida, Merlet, Carricato 2019, sec. 4: start and largest tensions of the procedure.
    """
    mass, n = robot.platform.mass_kg, robot.n_cables
    if mass is None:
        raise DataError("platform.mass_kg is missing in the robot file: tensions need it; give it")
    start = np.full(n, 1.5 * mass * float(np.linalg.norm(robot.gravity_m_s2)) / n)
    return start, 2 * start


def simulate_acquisition(
    robot: Robot,
    start_N: Array,
    largest_N: Array,
    n_poses: int,
    errors: AcquisitionErrors,
    rng: np.random.Generator,
) -> Acquisition:
    """Go through the set-points of section 4 and read the encoders at each rest.

    Args:
        robot: with its mass and centre of mass.
        start_N: tensions at the start, (n,).
        largest_N: largest tensions, (n,).
        n_poses: static poses, the start included.
        errors: what the machine adds.
        rng: source of all chance.

    Raises:
        DataError: when a set-point holds the platform at no stable pose.
    """
    if robot.platform.mass_kg is None:
        raise DataError("platform.mass_kg is missing in the robot file: tensions need it; give it")
    weight = robot.platform.mass_kg * float(np.linalg.norm(robot.gravity_m_s2))
    energy = TensionEnergy(robot)
    asked = acquisition_tensions(start_N, largest_N, n_poses)
    poses = _settle(energy, asked / weight)
    model = RestModel(robot, free_indices(robot, poses[0]))
    lengths = model.evaluate(poses).values[:, model.columns("length")]
    motion = np.sign(np.diff(lengths, axis=0, prepend=lengths[:1]))
    tensions = asked * (1 + errors.friction * motion)
    tensions = tensions + errors.repeatability_N * rng.standard_normal(asked.shape)
    tensions = np.maximum(tensions, _SLACK_PULL * weight)
    pushes = np.zeros((n_poses, 6))
    pushes[:, model.free] = errors.statics * rng.standard_normal((n_poses, len(model.free)))
    poses = _settle(energy, tensions / weight, pushes)
    values = model.evaluate(poses).values
    sigma, length = values[:, model.columns("sigma")], values[:, model.columns("length")]
    readings = Readings(
        sigma_rad=_relative(_encoder(sigma, errors, rng)),
        length_m=_relative(length + errors.length_std_m * rng.standard_normal(length.shape)),
        tension_N=asked + errors.tension_std_N * rng.standard_normal(asked.shape),
    )
    return Acquisition(readings, poses, sigma, length, asked, tensions)


def simulate_homing(
    robot_path: Path | str,
    folder: Path | str,
    *,
    n_poses: int = 61,
    start_tensions_N: Array | None = None,
    max_tensions_N: Array | None = None,
    errors: AcquisitionErrors | None = None,
    seed: int = 0,
) -> Path:
    """Write a simulated homing session: robot.toml, homing.toml, readings.csv and truth.json.

    Returns:
        The path of homing.toml, ready for `home`.

    Raises:
        InputError: a file is wrong or cannot be written.
        DataError: the robot has no stable rest at these tensions.
    """
    robot, folder = read_robot(robot_path), Path(folder)
    errors = errors or AcquisitionErrors()
    start, largest = start_tensions_N, max_tensions_N
    if start is None or largest is None:
        usual = default_tensions(robot)
        start = usual[0] if start is None else start
        largest = 2 * start if largest is None else largest
    made = simulate_acquisition(robot, start, largest, n_poses, errors, np.random.default_rng(seed))
    noise = ReadingNoise(
        sigma_rad=max(errors.sigma_std_rad, 1e-7),
        length_m=max(errors.length_std_m, 1e-7),
        statics=max(errors.statics, 1e-6),
        stated=True,
    )
    readings = Readings(made.readings.sigma_rad, made.readings.length_m)
    path = write_homing(folder, Homing(robot, readings, start, largest, noise))
    write_robot(folder / "robot.toml", robot)
    write_json(
        folder / "truth.json",
        {
            "format": "freeswing-homing-truth/1",
            "start_pose": {"position_m": made.poses[0, :3], "angles_rad": made.poses[0, 3:]},
            "cable_lengths_m": made.length_m[0],
            "swivel_angles_rad": made.sigma_rad[0],
        },
    )
    return path


def _settle(energy: TensionEnergy, pulls: Array, pushes: Array | None = None) -> Array:
    """Stable poses downhill of the first set-point's rest."""
    starts = stable_starts(energy, pulls[0])
    if not len(starts):
        raise DataError("the start tensions hold the platform at no stable pose; change them")
    rest = energy.settle(np.tile(starts[0], (len(pulls), 1)), pulls, pushes)
    if not rest.settled.all():
        row = int(np.flatnonzero(~rest.settled)[0])
        raise DataError(f"set-point {row} holds the platform at no stable pose; ask for less")
    return rest.poses


def _encoder(sigma: Array, errors: AcquisitionErrors, rng: np.random.Generator) -> Array:
    motion = np.sign(np.diff(sigma, axis=0, prepend=sigma[:1]))
    held = sigma - errors.swivel_stick_rad * motion
    if not errors.encoder_bits:
        return held
    step = 2 * np.pi / 2**errors.encoder_bits
    zero = rng.uniform(0, step, sigma.shape[1])
    return np.round((held + zero) / step) * step


def _relative(values: Array) -> Array:
    return values - values[0]
