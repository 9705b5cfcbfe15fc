"""Design a vision controller for a driven robot: H-infinity, and others beside it."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from freeswing.commands.arguments import add_results, add_robot, finite
from freeswing.console import Console

if TYPE_CHECKING:
    from freeswing.cdpr.driven.model import DrivenModel
    from freeswing.results.control import ControllerResult
    from freeswing.servo.design.controller import Controller
    from freeswing.servo.design.drawn_robots import Cloud
    from freeswing.servo.design.offer import Order

METHODS = ("hinf", "hinf-fastest", "lqg", "pid", "joint-pid", "mpc", "all")


def add_arguments(parser: ArgumentParser) -> None:
    """Robot, weights, method, where, how large."""
    add_robot(parser, " of a driven robot")
    parser.add_argument(
        "--weights", metavar="FILE", help="weights.toml; without it the paper's, as corrected"
    )
    parser.add_argument(
        "--method",
        choices=METHODS,
        default="hinf",
        help="default hinf: the weights as they are; hinf-fastest: their rates by the rule of "
        "the others (docs/servo.md)",
    )
    parser.add_argument(
        "--encoders",
        action="store_true",
        help="for a loop that carries each pose on to now by the encoders: not late, only noisy",
    )
    parser.add_argument(
        "--at",
        type=finite,
        nargs=6,
        default=(0.0,) * 6,
        metavar=("X", "Y", "Z", "R", "P", "YAW"),
        help="pose to design about, m and rad (the centre)",
    )
    parser.add_argument(
        "--order", type=int, metavar="N", help="reduce the H-infinity controller to N states"
    )
    parser.add_argument(
        "--robustness",
        action="store_true",
        help="also the margins over the workspace and over 200 draws of the robot's numbers",
    )
    parser.add_argument(
        "--identified",
        metavar="FILE",
        help="drive.json: with --robustness draw from its covariance (the paper's deviations)",
    )
    add_results(parser, "ROBOT's folder/results")


def run(options: Namespace, console: Console) -> None:
    """Design, examine, write controller.json and what goes with it."""
    from freeswing.cdpr.files.documents import DataError, InputError, write_json
    from freeswing.cdpr.system.confine import results_folder
    from freeswing.results.control import Controllers
    from freeswing.servo.design.family import METHODS as FAMILY
    from freeswing.servo.design.hinf import AssumptionError
    from freeswing.servo.design.offer import Order, offer
    from freeswing.servo.driven_file import read_driven
    from freeswing.servo.files.weights_file import USUAL, Goals, read_weights

    path, model = read_driven(options.robot)
    goals = Goals(USUAL, None) if options.weights is None else read_weights(options.weights)
    if options.order is not None and options.order < 1:
        raise InputError(f"--order {options.order}: at least 1 state")
    if options.identified is not None and not options.robustness:
        raise InputError("--identified: says nothing without --robustness")
    cloud = _cloud(model, options.identified) if options.robustness else None
    folder = results_folder(path.parent, options.results)
    wanted = FAMILY if options.method == "all" else (options.method,)
    order = Order(goals, tuple(options.at), options.order, by_encoders=options.encoders)
    rows, first = {}, None
    for k, method in enumerate(wanted):
        console.progress("design", k / len(wanted))
        try:
            found = offer(model, method, order)
        except AssumptionError as error:
            raise InputError(f"{options.weights or path}: {error}") from error
        except ValueError as error:
            raise DataError(f"{path}: {method}: {error}") from error
        first = first or found
        rows[method] = _write(folder, found, method == wanted[0]).row()
        _say(console, found, order)
    result = folder / "controller.json"
    if options.method == "all":
        write_json(folder / "controllers.json", Controllers(controllers=rows).to_json())
    if first is not None:
        _figures(folder, model, order, first)
        if cloud is not None:
            _robustness(console, model, first, order, cloud, folder)
    console.say(str(result))
    console.show_file(result)


def _write(folder: Path, found: Controller, is_first: bool) -> ControllerResult:
    from freeswing.cdpr.files.documents import replace_file, write_json
    from freeswing.results.control import ControllerResult
    from freeswing.servo.files.controller_file import c_header, mat_bytes, npz_bytes, to_document

    name = "controller" if is_first else f"controller-{found.method}"
    document = ControllerResult.from_json(to_document(found))
    write_json(folder / f"{name}.json", document.to_json())
    replace_file(folder / f"{name}.npz", npz_bytes(found))
    replace_file(folder / f"{name}.mat", mat_bytes(found))
    replace_file(folder / f"{name}.h", c_header(found).encode())
    return document


def _cloud(model: DrivenModel, identified: str | None) -> Cloud:
    from freeswing.results.driven.estimates import read_identified
    from freeswing.servo.design.drawn_robots import by_identified, by_table_1

    if identified is None:
        return by_table_1(model)
    return by_identified(read_identified(identified, model), f"the covariance of {identified}")


def _say(console: Console, found: Controller, order: Order) -> None:
    loop, late = found.undelayed, found.delayed
    if "gamma" in found.facts:
        console.say(
            f"{found.method}: gamma {found.facts['gamma']:.4f} at best, "
            f"{found.facts['gamma_backed_off']:.4f} asked for, {found.facts['norm']:.4f} reached; "
            f"order {found.sampled.order}"
        )
        if "share" in found.facts:
            console.say(f"the rates of its weights times {found.weights_faster:.3g}")
    else:
        speeds = ", ".join(f"{value:.2f}" for value in found.facts.values())
        console.say(f"{found.method}: speeds {speeds} rad/s; order {found.sampled.order}")
    console.say(
        f"bandwidth {loop.position.bandwidth_rad_s:.2f} rad/s (position), "
        f"{loop.orientation.bandwidth_rad_s:.2f} rad/s (orientation); modulus margins "
        f"{loop.position.modulus_margin:.3f}, {loop.orientation.modulus_margin:.3f}; at rest "
        f"{100 * loop.position.static_error:.3g}, {100 * loop.orientation.static_error:.3g} % left"
    )
    known = "designed in"
    if found.carried:
        known = "poses carried on by the encoders"
    elif order.goals.camera is None and found.method.startswith("hinf"):
        known = "not in the design"
    console.say(
        f"delay margin {1e3 * loop.delay_margin_s:.1f} ms; at {1e3 * found.delay_s:.1f} ms "
        f"({known}) margins {late.position.modulus_margin:.3f}, "
        f"{late.orientation.modulus_margin:.3f}"
    )
    for warning in found.warnings:
        console.complain(f"warning: {found.method}: {warning}")


def _robustness(
    console: Console,
    model: DrivenModel,
    found: Controller,
    order: Order,
    cloud: Cloud,
    folder: Path,
) -> None:
    from freeswing.cdpr.files.documents import write_json
    from freeswing.results.control import Robustness
    from freeswing.servo.design.robustness import survey_document

    survey = survey_document(model, found, order, cloud, console.progress)
    document = Robustness.from_json(survey)
    write_json(folder / "robustness.json", document.to_json())
    for line in document.sentences:
        console.say(line)


def _figures(folder: Path, model: DrivenModel, order: Order, found: Controller) -> None:
    """Figs. 12 and 13 of the first controller."""
    from freeswing.cdpr.files.documents import replace_file
    from freeswing.report.servo_figures import controller_gains, templates

    goals = order.goals.weights.faster(found.weights_faster)
    for name, svg in (
        ("controller-gains.svg", controller_gains(found)),
        ("controller-templates.svg", templates(found, order.plant(model), goals)),
    ):
        replace_file(folder / name, svg.encode())
