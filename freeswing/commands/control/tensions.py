"""Distribute wrenches over the cables of a driven robot as tensions and currents."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from freeswing.commands.arguments import add_results, add_robot, finite
from freeswing.console import Console

if TYPE_CHECKING:
    from freeswing.cdpr.driven.model import DrivenModel
    from freeswing.servo.tensions.methods import Shares

METHODS = ("nearest", "barycentre", "paper", "closed-form", "qp")


def add_arguments(parser: ArgumentParser) -> None:
    """Robot, wrenches, method."""
    add_robot(parser, " of a driven robot")
    parser.add_argument(
        "wrenches", metavar="WRENCHES", help="CSV, a pose and a wrench a row (docs/formats.md)"
    )
    parser.add_argument("--method", choices=METHODS, default="nearest", help="default nearest")
    parser.add_argument(
        "--objective-N",
        type=finite,
        default=10.0,
        dest="objective",
        metavar="T",
        help="tension that all cables should be near (10)",
    )
    parser.add_argument(
        "--of-motors",
        action="store_true",
        help="the wrenches are those of the motors alone, as a controller commands them; "
        "the balancing springs come on top",
    )
    add_results(parser, "ROBOT's folder/results")


def run(options: Namespace, console: Console) -> None:
    """Read, distribute, write."""
    import numpy as np

    from freeswing.cdpr.files.documents import InputError
    from freeswing.cdpr.system.confine import results_folder
    from freeswing.servo.driven_file import read_driven
    from freeswing.servo.files.wrench_file import read_wrenches, write_shares
    from freeswing.servo.tensions.methods import distribute_all
    from freeswing.servo.tensions.robot_wrenches import demands_at_rest

    path, model = read_driven(options.robot)
    if not np.isfinite(options.objective) or options.objective < 0.0:
        raise InputError(f"--objective-N {options.objective}: must be a tension >= 0")
    table = read_wrenches(options.wrenches, *_reach(model))
    demands, springs, per_A = demands_at_rest(
        model,
        table.poses,
        table.wrenches,
        objective_N=options.objective,
        of_motors=options.of_motors,
    )
    try:
        shares = distribute_all(demands, options.method)
    except ValueError as error:
        raise InputError(f"{path}: {error}") from error
    names = tuple(cable.name for cable in model.robot.cables)
    tensions = springs + per_A * shares.x
    columns: dict[str, list[object]] = {}
    for i, name in enumerate(names):
        columns[f"T{name}_N"] = [float(value) for value in tensions[:, i]]
        columns[f"I{name}_A"] = [float(value) for value in shares.x[:, i]]
    columns["status"], columns["scale"] = list(shares.status), [float(v) for v in shares.scale]
    columns["stopped_by"] = [
        "" if stop is None else f"{names[stop[0]]} {stop[1]}" for stop in shares.stops
    ]
    folder = results_folder(path.parent, options.results)
    result = folder / "tensions.csv"
    write_shares(result, names, columns)
    _say(console, shares, columns["stopped_by"])
    console.say(str(result))
    console.say_json({"rows": len(shares.status), "columns": columns})


def _reach(model: DrivenModel) -> tuple:
    """Half the frame, and the moment of all cables at their limits on the longest arm."""
    import numpy as np

    robot = model.robot
    arms = np.linalg.norm([cable.attachment_m for cable in robot.cables], axis=1)
    most = robot.drive.tension_limits_N[:, 1].sum() if robot.drive else np.inf
    return np.abs(robot.entries_m).max(axis=0), float(arms.max() * most)


def _say(console: Console, shares: Shares, stopped: list[object]) -> None:
    count = len(shares.status)
    good = shares.status.count("feasible")
    console.say(f"{good} of {count} wrenches are feasible")
    words = {
        "scaled": "can be made in part: the largest share is in `scale`",
        "impossible": "cannot be made at any scale: no tensions between the limits hold the pose",
        "singular": "stand where the cables lose a direction",
        "not-found": "are feasible but not found by this method: take nearest",
    }
    for status, text in words.items():
        rows = [i for i, word in enumerate(shares.status) if word == status]
        if rows:
            by = f", stopped by cable {stopped[rows[0]]}" if stopped[rows[0]] else ""
            console.say(f"{len(rows)} {text} (row {rows[0] + 1}{by})")
