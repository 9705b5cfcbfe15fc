"""Simulate a free swing, or the motion of a driven robot, with any effects, into a file."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from freeswing.commands.arguments import add_effects, add_robot, not_negative, positive, whole
from freeswing.commands.robot.simulate_drive import add_drive_arguments, run_drive
from freeswing.console import Console

if TYPE_CHECKING:
    from numpy.random import Generator

    from freeswing.cdpr.measured.trajectory import Trajectory
    from freeswing.cdpr.robot import Robot


def add_arguments(parser: ArgumentParser) -> None:
    """Robot, lengths, release, effects, sampling."""
    add_robot(parser, " with nominal inertia")
    parser.add_argument("result", metavar="TO", help="trajectory to write, .csv or .tum")
    parser.add_argument(
        "--lengths-m", type=_numbers, metavar="L1,L2,..", help="cable lengths of a free swing"
    )
    numbers = "value of an effect's parameter, such as rate_1_s=0.05"
    add_effects(parser, "NAME", "an effect; may be repeated", numbers)
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
    motion = _motion(options, generator)
    std = np.repeat([options.noise_m, options.noise_rad], 3)
    noise = generator.normal(0.0, 1.0, motion.values.shape) * std
    writers[result.suffix.lower()](result, replace(motion, values=motion.values + noise))
    console.say(str(result))
    console.say_json({"format": "freeswing-simulation/1", "result": str(result)})


def _motion(options: Namespace, generator: Generator) -> Trajectory:
    from freeswing.cdpr.files.documents import InputError
    from freeswing.cdpr.files.robot_file import read_robot
    from freeswing.cdpr.simulation.by_lengths import swing

    robot = read_robot(options.robot)
    if robot.inertia is None:
        raise InputError(f"{options.robot}: [platform] needs com_m and specific_inertia_m2")
    lengths = options.lengths_m
    if len(lengths) != robot.n_cables:
        raise InputError(f"--lengths-m: {len(lengths)} lengths, {robot.n_cables} cables")
    if not 0.0 < options.amplitude_m <= 0.5 * min(lengths):
        raise InputError(f"--amplitude-m must lie in (0, {0.5 * min(lengths):g}], half a cable")
    return swing(
        robot,
        lengths,
        amplitude_m=options.amplitude_m,
        duration_s=options.duration_s,
        rate_hz=options.rate_hz,
        effects=_effects(robot, options),
        seed=generator,
    )


def _effects(robot: Robot, options: Namespace) -> dict[str, dict[str, float]]:
    """The effects that flags name, each with those of the settings that are its own."""
    from freeswing.cdpr.effects import catalogue
    from freeswing.cdpr.files.documents import InputError

    known = catalogue()
    for name in options.effect:
        if name not in known:
            raise InputError(f"--effect {name}: not one of {', '.join(sorted(known))}")
    own = {name: [one.name for one in known[name].parameters(robot)] for name in options.effect}
    names = [name for some in own.values() for name in some]
    for name, _ in options.set:
        if name not in names:
            if not names:
                raise InputError(f"--set {name}: a number of which effect? Name it by --effect")
            raise InputError(f"--set {name}: not one of {', '.join(names)}")
    return {
        effect: {name: value for name, value in options.set if name in some}
        for effect, some in own.items()
    }


def _numbers(text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise ArgumentTypeError(f"{text!r} is not a list of numbers, such as 1.3,1.4") from None
