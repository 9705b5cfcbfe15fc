"""The linear model of a driven robot about a pose: matrices, modes, singular values."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from freeswing.commands.arguments import add_results, add_robot, finite
from freeswing.console import Console

if TYPE_CHECKING:
    from numpy import ndarray

    from freeswing.cdpr.driven.model import DrivenModel

RATES = (0.1, 1000.0)  # rad/s, as Fig. 8 of the paper spans its resonances
N_RATES = 400


def add_arguments(parser: ArgumentParser) -> None:
    """The robot and the pose."""
    add_robot(parser, " with [drive]")
    parser.add_argument(
        "--at",
        type=finite,
        nargs=6,
        default=(0.0,) * 6,
        metavar=("X", "Y", "Z", "ROLL", "PITCH", "YAW"),
        help="pose in m and rad, R = Rz(yaw) Ry(pitch) Rx(roll); default the origin",
    )
    parser.add_argument(
        "--currents-a",
        type=finite,
        nargs="+",
        metavar="I",
        help="instead of --at: where it rests under these currents, one a motor",
    )
    add_results(parser, "ROBOT's folder/results")


def run(options: Namespace, console: Console) -> None:
    """Linearise, write matrices and picture, say the modes."""
    import numpy as np

    from freeswing.cdpr.driven.linear import linear_model, modes
    from freeswing.cdpr.driven.model import build_driven
    from freeswing.cdpr.files.documents import InputError, replace_file, write_json
    from freeswing.cdpr.files.robot_file import read_robot
    from freeswing.cdpr.system.confine import results_folder
    from freeswing.printing.curves import log_log_svg
    from freeswing.results.control import linear_document, linear_panels

    path = options.robot
    robot = read_robot(path)
    if robot.drive is None:
        raise InputError(f"{path}: has no [drive]: only a driven robot has this linear model")
    model = build_driven(robot)
    at = np.array(options.at) if options.currents_a is None else _rest(model, options.currents_a)
    low, high = robot.entries_m.min(axis=0), robot.entries_m.max(axis=0)
    if ((at[:3] <= low) | (at[:3] >= high)).any() or np.abs(at[3:]).max() > np.pi:
        raise InputError(
            f"--at {' '.join(f'{v:g}' for v in at)}: outside the robot's frame, "
            f"{low.round(3).tolist()} to {high.round(3).tolist()} m (angles within +-pi rad)"
        )
    linear = linear_model(model, at)
    found, rates = modes(linear), np.geomspace(*RATES, N_RATES)
    folder = results_folder(path.parent, options.results)
    response = linear.response(rates)
    held = _holding(model, at, console)
    document = linear_document(robot.name, linear, found, rates, response, held)
    write_json(folder / "linear.json", document.to_json())
    replace_file(folder / "linear.svg", log_log_svg(linear_panels(rates, response)))
    console.say(f"  at {' '.join(f'{v:.4f}' for v in at)} (m, rad)")
    for mode in found:
        swings = f"damping {mode.damping:.3f}" if mode.damping < 1.0 else "does not swing"
        console.say(f"  {mode.rate_rad_s:7.3f} rad/s  {swings}  {mode.words}")
    if any(mode.damping < 0.0 for mode in found):
        console.complain(
            "a mode grows: a wrench held in base axes does not hold the platform at this pose; "
            "the controller must"
        )
    console.say(str(folder / "linear.svg"))
    console.say(str(folder / "linear.json"))
    console.show_file(folder / "linear.json")


def _rest(model: DrivenModel, currents: list[float]) -> ndarray:
    """The pose at rest under held currents, [x y z roll pitch yaw]."""
    import numpy as np

    from freeswing.cdpr.driven.statics import static_pose
    from freeswing.cdpr.files.documents import DataError, InputError
    from freeswing.servo.robot_now import pose6

    given, limits = np.array(currents), model.drive.current_limits_A
    if len(given) != model.n_cables:
        raise InputError(f"--currents-a: {len(given)} numbers for {model.n_cables} motors")
    outside = (given < limits[:, 0]) | (given > limits[:, 1])
    if outside.any():
        k = int(np.argmax(outside))
        raise InputError(
            f"--currents-a: {given[k]:g} A in motor {model.robot.cables[k].name}, limits "
            f"{limits[k, 0]:g} to {limits[k, 1]:g} A"
        )
    try:
        return pose6(static_pose(model, given).pose)
    except ValueError as error:
        raise DataError(f"{model.robot.name}: {error}") from error


def _holding(model: DrivenModel, at: ndarray, console: Console) -> ndarray | None:
    """Currents that hold the pose, those nearest to the middle of the limits; None: none do."""
    from freeswing.cdpr.driven.statics import holding_currents
    from freeswing.servo.robot_now import pose7

    try:
        found = holding_currents(model, pose7(at))
    except ValueError as error:
        console.complain(f"no currents hold this pose: {error}")
        return None
    console.say(f"  held by {' '.join(f'{value:.3f}' for value in found)} A")
    return found
