"""Simulate a free swing, or the motion of a driven robot, with any effects, into a file."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from freeswing.commands.arguments import not_negative, positive, whole
from freeswing.commands.robot.simulate_drive import add_drive_arguments, run_drive
from freeswing.console import Console

if TYPE_CHECKING:
    from numpy import ndarray

    from freeswing.cdpr.model.equations import Model
    from freeswing.cdpr.robot import Robot


def add_arguments(parser: ArgumentParser) -> None:
    """Robot, lengths, release, effects, sampling."""
    parser.add_argument("robot", metavar="ROBOT", help="robot.toml with nominal inertia")
    parser.add_argument("result", metavar="TO", help="trajectory to write, .csv or .tum")
    parser.add_argument(
        "--lengths-m", type=_numbers, metavar="L1,L2,..", help="cable lengths of a free swing"
    )
    parser.add_argument(
        "--effect", action="append", default=[], metavar="NAME", help="an effect; may be repeated"
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        type=_setting,
        metavar="PARAMETER=VALUE",
        help="value of an effect's parameter, such as rate_1_s=0.05",
    )
    parser.add_argument("--amplitude-m", type=positive, default=0.03, help="release, default 0.03")
    parser.add_argument("--duration-s", type=positive, default=10.0, help="default 10")
    parser.add_argument("--rate-hz", type=positive, help="default 100; of a driven robot 1000")
    parser.add_argument("--noise-m", type=not_negative, default=0.0, help="std of each coordinate")
    parser.add_argument("--noise-rad", type=not_negative, default=0.0, help="std of each angle")
    parser.add_argument("--seed", type=whole, default=0, help="decides the release and the noise")
    add_drive_arguments(parser)


def run(options: Namespace, console: Console) -> None:
    """Find the rest pose, let go beside it, integrate, sample, write."""
    import numpy as np

    from freeswing.cdpr.files.documents import InputError
    from freeswing.cdpr.files.trajectory_files import write_csv, write_tum
    from freeswing.cdpr.measured.trajectory import Trajectory

    if options.rate_hz is None:
        options.rate_hz = 1000.0 if options.drive else 100.0
    if options.drive:
        run_drive(options, console)
        return
    if options.lengths_m is None:
        raise InputError("give --lengths-m for a free swing, or --drive for a driven robot")
    result = Path(options.result)
    writers = {".csv": write_csv, ".tum": write_tum}
    if result.suffix.lower() not in writers:
        raise InputError(f"{result}: {result.suffix!r} is not one of {', '.join(writers)}")
    if not (0.0 < options.duration_s <= 3600.0 and 0.0 < options.rate_hz <= 1e5):
        raise InputError("--duration-s must lie in (0, 3600], --rate-hz in (0, 100000]")
    generator = np.random.default_rng(options.seed)
    times = np.arange(round(options.duration_s * options.rate_hz) + 1) / options.rate_hz
    poses = _poses(options, times, generator)
    std = np.repeat([options.noise_m, options.noise_rad], 3)
    poses = poses + generator.normal(0.0, 1.0, poses.shape) * std
    writers[result.suffix.lower()](
        result, Trajectory(times, ("x", "y", "z", "phi", "theta", "chi"), poses)
    )
    console.say(str(result))
    console.say_json({"format": "freeswing-simulation/1", "result": str(result)})


def _poses(options: Namespace, times: ndarray, generator) -> ndarray:
    import numpy as np

    from freeswing.cdpr.files.documents import InputError
    from freeswing.cdpr.files.robot_file import read_robot
    from freeswing.cdpr.model.equations import build_model
    from freeswing.cdpr.model.free_motion import admissible_rates
    from freeswing.cdpr.simulation.free_swing import simulate
    from freeswing.cdpr.simulation.release import release, rest_at_lengths

    robot = read_robot(options.robot)
    if robot.inertia is None:
        raise InputError(f"{options.robot}: [platform] needs com_m and specific_inertia_m2")
    lengths = np.array(options.lengths_m)
    if len(lengths) != robot.n_cables:
        raise InputError(f"--lengths-m: {len(lengths)} lengths, {robot.n_cables} cables")
    if not 0.0 < options.amplitude_m <= 0.5 * lengths.min():
        raise InputError(f"--amplitude-m must lie in (0, {0.5 * lengths.min():g}], half a cable")
    model = _model(robot, options, build_model)
    values = _values(model, options)
    rest = rest_at_lengths(model, lengths, robot.inertia, values, generator)
    zeta = release(model, rest, robot.inertia, values, options.amplitude_m, generator)
    span = (0.0, float(times[-1]))
    rates = admissible_rates(model, zeta, np.zeros(6), robot.inertia, values)
    motion = simulate(model, zeta, rates, span, robot.inertia, values)
    return motion.at(times)[0]


def _model(robot: Robot, options: Namespace, build_model) -> Model:
    from freeswing.cdpr.effects import catalogue
    from freeswing.cdpr.files.documents import InputError

    known = catalogue()
    for name in options.effect:
        if name not in known:
            raise InputError(f"--effect {name}: not one of {', '.join(sorted(known))}")
    return build_model(robot, tuple(options.effect))


def _values(model: Model, options: Namespace) -> ndarray:
    from freeswing.cdpr.files.documents import InputError

    values = model.start_values.copy()
    names = [parameter.name for parameter in model.parameters]
    for name, value in options.set:
        if name not in names:
            known = ", ".join(names) or "none without --effect"
            raise InputError(f"--set {name}: not one of {known}")
        values[names.index(name)] = value
    return values


def _numbers(text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise ArgumentTypeError(f"{text!r} is not a list of numbers, such as 1.3,1.4") from None


def _setting(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError:
        raise ArgumentTypeError(f"{text!r} is not PARAMETER=VALUE") from None
