"""A robot at given cable lengths: where it hangs, how it swings there, a swing to look at."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from freeswing.cdpr.files.problems import InputError
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.model.free_motion import admissible_rates
from freeswing.cdpr.model.statics import Equilibrium, Modes, modes
from freeswing.cdpr.robot import POSE_COORDINATES, Array, Robot
from freeswing.cdpr.simulation.free_swing import simulate
from freeswing.cdpr.simulation.release import release, rest_at_lengths

Effects = Mapping[str, Mapping[str, float]]


def model_with(robot: Robot, effects: Effects | None = None) -> tuple[Model, Array]:
    """The equations with effects, and the effects' values, (k,).

    Args:
        robot: the robot.
        effects: by name, such as `{"translational_drag": {"rate_1_s": 0.05}}`; parameters that are
            not named keep the value that leaves the declared model as it is.

    Raises:
        InputError: an effect or a parameter that does not exist, with those that do.
    """
    from freeswing.cdpr.effects import catalogue

    effects = effects or {}
    for name in effects:
        if name not in catalogue():
            raise InputError(f"effect {name}: not one of {', '.join(sorted(catalogue()))}")
    model = build_model(robot, tuple(effects))
    values = model.start_values.copy()
    for effect, given in effects.items():
        place = model.place_of(effect)
        names = [parameter.name for parameter in model.parameters[place]]
        for name, value in given.items():
            if name not in names:
                raise InputError(f"{effect}: parameter {name}: not one of {', '.join(names)}")
            values[place.start + names.index(name)] = value
    return model, values


def hanging(
    robot: Robot, lengths_m: Sequence[float] | Array, effects: Effects | None = None, seed: int = 0
) -> tuple[Equilibrium, Modes]:
    """The lowest stable pose with all cables taut at given lengths, and the modes about it.

    Args:
        robot: with nominal inertia.
        lengths_m: of the cables, (n,).
        effects: see `model_with`.
        seed: decides where equilibria are looked for from.

    Raises:
        InputError: without nominal inertia, or with another number of lengths than cables.
        DataError: where no such pose is.
    """
    model, values = model_with(robot, effects)
    inertia, lengths = _checked(robot, lengths_m)
    generator = np.random.default_rng(seed)
    rest = rest_at_lengths(model, lengths, inertia, values, generator)
    return rest, modes(model, rest, inertia, values)


def swing(
    robot: Robot,
    lengths_m: Sequence[float] | Array,
    *,
    amplitude_m: float = 0.03,
    duration_s: float = 10.0,
    rate_hz: float = 100.0,
    effects: Effects | None = None,
    seed: int | np.random.Generator = 0,
) -> Trajectory:
    """A swing let go at rest beside the pose in which the robot hangs; exact, without noise.

    Args:
        robot: with nominal inertia.
        lengths_m: of the cables, (n,).
        amplitude_m: how far from the pose at rest it is let go, along its modes.
        duration_s: how long.
        rate_hz: samples a second.
        effects: see `model_with`.
        seed: decides which way it is let go; a generator is used from where it stands.

    Raises:
        InputError: see `hanging`.
        DataError: where it hangs nowhere, or cannot be let go so far away.
        ValueError: where the motion cannot be followed, with the time and why.
    """
    model, values = model_with(robot, effects)
    inertia, lengths = _checked(robot, lengths_m)
    generator = np.random.default_rng(seed)
    rest = rest_at_lengths(model, lengths, inertia, values, generator)
    zeta = release(model, rest, inertia, values, amplitude_m, generator)
    times = np.arange(round(duration_s * rate_hz) + 1) / rate_hz
    rates = admissible_rates(model, zeta, np.zeros(6), inertia, values)
    motion = simulate(model, zeta, rates, (0.0, float(times[-1])), inertia, values)
    return Trajectory(times, POSE_COORDINATES, motion.at(times)[0], None, f"{robot.name} simulated")


def _checked(robot: Robot, lengths_m: Sequence[float] | Array) -> tuple[Array, Array]:
    """Nominal inertia and lengths."""
    if robot.inertia is None:
        raise InputError(
            f"robot {robot.name}: [platform] needs com_m and specific_inertia_m2 to be simulated"
        )
    lengths = np.array(lengths_m, dtype=np.float64)
    if lengths.shape != (robot.n_cables,):
        raise InputError(f"{lengths.size} lengths, the robot has {robot.n_cables} cables")
    return robot.inertia, lengths
