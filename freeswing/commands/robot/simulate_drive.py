"""What `simulate --drive` does: currents in, a recording of a driven robot out."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from freeswing.commands.arguments import add_instruments, finite, instruments_of, positive
from freeswing.console import Console

if TYPE_CHECKING:
    from numpy import ndarray

    from freeswing.cdpr.driven.model import DrivenModel
    from freeswing.cdpr.driven.motion import DrivenMotion


def add_drive_arguments(parser: ArgumentParser) -> None:
    """What only a driven robot has."""
    group = parser.add_argument_group("driven robots")
    group.add_argument(
        "--drive",
        metavar="prbs|steps|ramp|CSV",
        help="current references, or a recording (.csv) whose Iref columns are taken",
    )
    group.add_argument(
        "--levels-a", type=finite, nargs=2, default=(0.0, 1.0), metavar=("LOW", "HIGH")
    )
    group.add_argument("--band-hz", type=positive, default=1.0, help="of the PRBS, default 1")
    group.add_argument("--motor", help="the cable whose motor the ramp drives")
    group.add_argument("--slope-a-s", type=finite, default=1.0, help="of the ramp, default 1")
    add_instruments(group)
    group.add_argument(
        "--elastic-n",
        type=finite,
        metavar="EA",
        help="elastic cables of EA N: slack is exact",
    )


def run_drive(options: Namespace, console: Console) -> None:
    """Start from rest without current, integrate, measure, write."""
    import numpy as np

    from freeswing.cdpr.driven.record import observed
    from freeswing.cdpr.driven.statics import CENTRE
    from freeswing.cdpr.files.documents import InputError
    from freeswing.cdpr.files.drive_csv import write_drive_run

    result = Path(options.result)
    if result.suffix.lower() != ".csv":
        raise InputError(f"{result}: recordings of driven robots are .csv files")
    generator = np.random.default_rng(options.seed)
    model, theta = driven_model(options)
    asked, rate_hz = _references(model, options, generator)
    limits = model.drive.current_limits_A
    references = np.clip(asked, limits[:, 0], limits[:, 1])
    motion = _motion(model, theta, references, rate_hz, options.elastic_n)
    record = observed(motion, CENTRE, instruments_of(options), generator)
    write_drive_run(result, record, motion.tensions_N)
    slack = [*_said_of_limits(model, asked, references), *_said_of_slack(model, motion)]
    for line in slack:
        console.complain(line)
    console.say(str(result))
    console.say_json({"format": "freeswing-simulation/1", "result": str(result), "warnings": slack})


def _motion(
    model: DrivenModel, theta: ndarray, references: ndarray, rate_hz: float, elastic_n: float | None
) -> DrivenMotion:
    """From rest without current."""
    import numpy as np

    from freeswing.cdpr.driven.behaviour import rest_pose, simulate
    from freeswing.cdpr.driven.elastic import Stretch, elastic_rest, simulate_elastic
    from freeswing.cdpr.files.documents import DataError, InputError

    still = np.zeros(model.n_cables)
    if elastic_n is not None and not elastic_n > 0.0:
        raise InputError(f"--elastic-n {elastic_n:g}: a stiffness must be > 0")
    try:
        if elastic_n is None:
            state = np.concatenate([rest_pose(model, still, theta), np.zeros(6)])
            return simulate(model, state, references, rate_hz, theta, currents_A=still)
        stretch = Stretch(elastic_n)
        state = np.concatenate([elastic_rest(model, still, stretch, theta), np.zeros(6)])
        return simulate_elastic(model, state, references, rate_hz, stretch, theta, currents_A=still)
    except ValueError as error:
        raise DataError(f"{model.robot.name}: {error}") from error


def _said_of_limits(model: DrivenModel, asked: ndarray, given: ndarray) -> list[str]:
    """Which motors cannot give what was asked."""
    return [
        f"motor {cable.name} is saturated at {count} samples: the drive gives no more than "
        f"current_limits_A"
        for cable, count in zip(model.robot.cables, (asked != given).sum(axis=0), strict=True)
        if count
    ]


def _said_of_slack(model: DrivenModel, motion: DrivenMotion) -> list[str]:
    """Which cables are slack, or would be: the rigid model pulls with a negative tension."""
    import numpy as np

    lines = []
    for index in np.flatnonzero(motion.slack.any(axis=0)):
        rows = np.flatnonzero(motion.slack[:, index])
        if motion.lengths_out_m is not None:  # elastic cables: slack is in the motion
            lines.append(
                f"cable {model.robot.cables[index].name} is slack at {len(rows)} samples, first at "
                f"{motion.times_s[rows[0]]:.3f} s"
            )
            continue
        lines.append(
            f"cable {model.robot.cables[index].name} would have to push at {len(rows)} samples, "
            f"first at {motion.times_s[rows[0]]:.3f} s, down to "
            f"{motion.tensions_N[:, index].min():.2f} N: a real one is slack there, and what "
            "follows is the rigid model's alone"
        )
    return lines


def driven_model(options: Namespace) -> tuple[DrivenModel, ndarray]:
    """The model with the effects of --effect, and its numbers with --set.

    Raises:
        InputError: for an effect or a parameter that there is not.
    """
    from freeswing.cdpr.driven.model import build_driven
    from freeswing.cdpr.effects import driven_catalogue
    from freeswing.cdpr.files.documents import InputError
    from freeswing.cdpr.files.robot_file import read_robot

    robot = read_robot(options.robot)
    if robot.drive is None:
        raise InputError(f"{options.robot}: has no [drive]: --drive is for driven robots")
    known = driven_catalogue()
    for name in options.effect:
        if name not in known:
            raise InputError(f"--effect {name}: not one of {', '.join(sorted(known))}")
    model = build_driven(robot, tuple(options.effect))
    values = {}
    for name, value in options.set:
        full = [one for one in model.names if name in (one, one.partition(".")[2])]
        if len(full) > 1:
            raise InputError(f"--set {name}: is {' and '.join(full)}; write the effect's name too")
        if not full:
            raise InputError(f"--set {name}: not one of {', '.join(model.names)}")
        values[full[0]] = value
    return model, model.theta(values)


def _references(model: DrivenModel, options: Namespace, generator) -> tuple[ndarray, float]:
    from freeswing.cdpr.driven.excitation import prbs, ramp, steps
    from freeswing.cdpr.files.documents import InputError
    from freeswing.cdpr.files.drive_csv import read_drive_run

    if options.drive.endswith(".csv"):
        record = read_drive_run(options.drive, model.n_cables)
        return record.references_A, 1.0 / float(record.times_s[1] - record.times_s[0])
    n_samples, n = round(options.duration_s * options.rate_hz) + 1, model.n_cables
    levels = tuple(options.levels_a)
    if not levels[0] < levels[1]:
        raise InputError(f"--levels-a {levels[0]:g} {levels[1]:g}: the lower comes first")
    _check_limits(model, levels)
    if options.drive == "prbs":
        return prbs(n_samples, n, options.rate_hz, levels, options.band_hz, generator), (
            options.rate_hz
        )
    if options.drive == "steps":
        return steps(n_samples, n, levels), options.rate_hz
    if options.drive == "ramp":
        names = [cable.name for cable in model.robot.cables]
        if options.motor not in names:
            raise InputError(f"--motor {options.motor}: not one of {', '.join(names)}")
        motor = names.index(options.motor)
        return ramp(n_samples, n, options.rate_hz, levels, options.slope_a_s, motor), (
            options.rate_hz
        )
    raise InputError(f"--drive {options.drive}: not prbs, steps, ramp or a .csv file")


def _check_limits(model: DrivenModel, levels: tuple[float, ...]) -> None:
    """Currents beyond what the motors take would be cut off there."""
    from freeswing.cdpr.files.documents import InputError

    limits = model.drive.current_limits_A
    if levels[0] < limits[:, 0].max() or levels[1] > limits[:, 1].min():
        raise InputError(
            f"--levels-a {levels[0]:g} {levels[1]:g}: outside current_limits_A "
            f"[{limits[:, 0].max():g}, {limits[:, 1].min():g}]"
        )
