"""Find where the robot stands when it is switched on, from incremental readings."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from freeswing.commands.arguments import add_results, positive_whole, whole
from freeswing.console import Console


def add_arguments(parser: ArgumentParser) -> None:
    """homing.toml, or a robot file to advise on or to simulate."""
    parser.add_argument(
        "homing", metavar="HOMING", help="homing.toml or its folder; with the flags, robot.toml"
    )
    add_results(parser, "HOMING's folder/results")
    other = parser.add_mutually_exclusive_group()
    other.add_argument(
        "--advise",
        action="store_true",
        help="which pulley axes would home better: write results/homing-advice.json",
    )
    other.add_argument(
        "--simulate",
        metavar="DIR",
        help="write a simulated acquisition with its truth to DIR, ready for `home`",
    )
    parser.add_argument(
        "--poses",
        type=positive_whole,
        default=61,
        metavar="N",
        help="poses to simulate (61)",
    )
    parser.add_argument("--seed", type=whole, default=0, metavar="N", help="of the simulation (0)")


def run(options: Namespace, console: Console) -> None:
    """Solve the start pose, advise, or simulate."""
    path = Path(options.homing)
    if options.advise:
        _advise(path, options, console)
    elif options.simulate:
        _simulate(path, options, console)
    else:
        _home(path, options, console)


def _home(path: Path, options: Namespace, console: Console) -> None:
    from freeswing.cdpr.system.confine import results_folder
    from freeswing.homing.home import home
    from freeswing.results.planning import Homing
    from freeswing.session.made import Made, write_made

    beside = path if path.is_dir() else path.parent
    folder = results_folder(beside, options.results)
    document = Homing.from_json(home(path, console.progress))
    result = write_made(folder, Made((("homing.json", document),)))
    pose, std = document.start_pose, document.start_pose_std
    for key, unit, scale in (("position_m", "mm", 1e3), ("angles_rad", "mrad", 1e3)):
        values = ", ".join(f"{scale * value:.3f}" for value in getattr(pose, key))
        spread = ", ".join(f"{scale * value:.3f}" for value in getattr(std, key))
        console.say(f"{key.partition('_')[0]}: {values} {unit} (std {spread})")
    for reading in document.suspect_readings:
        console.say(f"suspect: row {reading.row}, {reading.column}")
    ratio = document.chi_square_over_degrees
    if document.noise.stated and ratio > 2:
        console.say(
            f"the readings differ {ratio:.1f} times more (in square) than their stated noise"
        )
    console.say(str(result))
    console.show_file(result)


def _advise(path: Path, options: Namespace, console: Console) -> None:
    from freeswing.cdpr.system.confine import results_folder
    from freeswing.homing.swivel_advice import advise
    from freeswing.results.planning import HomingAdvice
    from freeswing.session.made import Made, write_made

    folder = results_folder(path.parent, options.results)
    document = HomingAdvice.from_json(advise(path, console.progress))
    result = write_made(folder, Made((("homing-advice.json", document),)))
    for name, quality in (("declared", document.declared), ("advised", document.advised)):
        console.say(
            f"{name}: start position to {1e3 * quality.position_std_m:.2f} mm, "
            f"conditioning {quality.conditioning:.1f}"
        )
    for cable in document.cables:
        if cable.changed:
            axis = ", ".join(f"{value:.3f}" for value in cable.swivel_z)
            console.say(f"cable {cable.name}: swivel_z = [{axis}]")
    console.say(str(result))
    console.show_file(result)


def _simulate(path: Path, options: Namespace, console: Console) -> None:
    from freeswing.cdpr.files.documents import InputError
    from freeswing.homing.simulated_acquisition import simulate_homing

    if options.poses < 3:
        raise InputError(f"--poses {options.poses}: at least 3 static poses are needed")
    made = simulate_homing(path, options.simulate, n_poses=options.poses, seed=options.seed)
    console.say(str(made))
