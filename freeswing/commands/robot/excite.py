"""Plan the swings that tell most about a robot's inertia, before recording them."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from typing import Any

from freeswing.commands.arguments import (
    add_results,
    add_robot,
    finite,
    positive,
    positive_whole,
    refuse_given,
    whole,
)
from freeswing.commands.robot.excite_bench import OF_BENCHES, add_bench_arguments, run_bench
from freeswing.commands.robot.excite_drive import (
    RANDOM,
    SCORED,
    SECONDS,
    add_drive_arguments,
    run_drive,
)
from freeswing.console import Console

USUAL: Mapping[str, Any] = {
    "swings": 12,
    "samples": 100,
    "duration_s": 10.0,
    "tension_n": (20.0, 200.0),
    "reach_m": 0.1,
    "starts": 30,
    "seed": 0,
    "random": 0,
    "criterion": "cost",
}
OF_SWINGS = (
    "swings", "samples", "tension_n", "reach_m", "starts", "seed", "random", "winch", "criterion"
)  # fmt: skip
NO_SWINGS = (
    "two or three parallel wires are twisted by hand, and the plan of a bench is one table by its "
    "error budget: nothing is drawn or searched"
)


def add_arguments(parser: ArgumentParser) -> None:
    """The robot and the limits."""
    add_robot(parser, " with nominal inertia and mass")
    add_results(parser, "ROBOT's folder/results")
    parser.add_argument("--swings", type=positive_whole, metavar="N", help="default 12")
    parser.add_argument("--samples", type=positive_whole, metavar="N", help="a swing (100)")
    parser.add_argument(
        "--duration-s",
        type=positive,
        help="of a swing, default 10; of a driven record 5; of a bench's run: as the plan says",
    )
    parser.add_argument(
        "--tension-n",
        type=finite,
        nargs=2,
        metavar=("LOW", "HIGH"),
        help="cable tensions, default 20 200",
    )
    parser.add_argument("--reach-m", type=positive, help="displacement, default 0.1")
    parser.add_argument("--mass-kg", type=positive, help="instead of the robot file's")
    parser.add_argument(
        "--starts", type=positive_whole, metavar="N", help="default 30; with --drive 60 plans"
    )
    parser.add_argument("--seed", type=whole, help="default 0")
    parser.add_argument(
        "--random",
        type=whole,
        metavar="N",
        help="score N random plans beside the best (with --drive 5)",
    )
    parser.add_argument(
        "--winch",
        action="store_true",
        help="plan motions of the winches that let the swings go (excitation-release/*.csv)",
    )
    parser.add_argument(
        "--criterion",
        choices=("cost", "information"),
        help="conditioning of FIDIM (default), or information of the maximum-likelihood fit",
    )
    add_drive_arguments(parser)
    add_bench_arguments(parser)


def run(options: Namespace, console: Console) -> None:
    """Plan, and say what the plan is worth."""
    from freeswing.cdpr.files.robot_file import read_robot
    from freeswing.cdpr.simulation.parallel_wires import hangs_parallel

    if options.drive:
        _fill(options, {**USUAL, "duration_s": SECONDS, "starts": SCORED, "random": RANDOM})
        run_drive(options, console)
        return
    robot = read_robot(options.robot)
    if hangs_parallel(robot):
        refuse_given(options, OF_SWINGS, NO_SWINGS)
        run_bench(robot, options, console)
        return
    refuse_given(options, OF_BENCHES, "they plan a bench, and this robot's cables are not parallel")
    _fill(options, USUAL)
    _plan_swings(options, console)


def _fill(options: Namespace, usual: Mapping[str, Any]) -> None:
    """What no flag says, as it usually is."""
    for name, value in usual.items():
        if getattr(options, name) is None:
            setattr(options, name, value)


def _plan_swings(options: Namespace, console: Console) -> None:
    from freeswing.cdpr.system.confine import results_folder
    from freeswing.excite.excite import ExcitationOptions, SwingLimits, excite
    from freeswing.results.planning import Excitation
    from freeswing.session.made import Made, write_made

    path = options.robot
    limits = SwingLimits(tension_N=tuple(options.tension_n), reach_m=options.reach_m)
    asked = ExcitationOptions(
        n_swings=options.swings,
        n_library=max(96, 8 * options.swings),
        n_samples=options.samples,
        n_starts=options.starts,
        n_random=options.random,
        winch=options.winch,
        duration_s=options.duration_s,
        limits=limits,
        criterion=options.criterion,
        mass_kg=options.mass_kg,
        seed=options.seed,
    )
    folder = results_folder(path.parent, options.results)
    told, tables = excite(path, asked, console.progress)
    document = Excitation.from_json(told)
    files = tuple((folder / name, text.encode()) for name, text in tables.items())
    result = write_made(folder, Made((("excitation.json", document),), files))
    console.say(f"conditioning cost C {document.cost_C:.2f} (below 10 is good)")
    random = document.random_plans
    if random:
        console.say(
            f"{random.count} random plans: median {random.quantiles['50']:.2f}, best "
            f"{random.quantiles['0']:.2f}, {100 * random.share_below_10:.0f} % below 10"
        )
    for count, entry in enumerate(document.equilibria, start=1):
        lengths = ", ".join(f"{value:.3f}" for value in entry.cable_lengths_m)
        low, high = entry.tension_range_N
        by_hand = entry.winch_release is None
        told = "; by hand: no winch motion within the limits" if by_hand else ""
        console.say(f"  {count:2}: lengths {lengths} m, tensions {low:.0f} to {high:.0f} N{told}")
    console.say(str(result))
    console.show_file(result)
