"""What `excite` does for two or three parallel wires: one table by the error budget of Izz."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from dataclasses import replace
from typing import TYPE_CHECKING

from freeswing.commands.arguments import positive
from freeswing.console import Console

if TYPE_CHECKING:
    from freeswing.cdpr.robot import Robot


OF_BENCHES = ("load_kg", "load_izz_kg_m2", "known_kg", "gain_std", "keep")


def add_bench_arguments(parser: ArgumentParser) -> None:
    """What only a bench has."""
    bench = parser.add_argument_group("benches: two or three parallel wires")
    bench.add_argument("--load-kg", type=positive, help="the object (as heavy as the platform)")
    bench.add_argument("--load-izz-kg-m2", type=positive, help="a guess of its inertia")
    bench.add_argument("--known-kg", type=positive, help="the known mass (half the object's)")
    bench.add_argument(
        "--gain-std",
        type=positive,
        help="relative error of the amplitude, of an uncalibrated signal (0: yaw is measured)",
    )
    bench.add_argument(
        "--keep",
        nargs="*",
        default=(),
        choices=("twist_deg", "duration_s", "known_at", "length_m", "radius"),
        metavar="WHAT",
        help="what stays as it is: twist_deg duration_s known_at length_m radius",
    )


def run_bench(robot: Robot, options: Namespace, console: Console) -> None:
    """The bench's one table."""
    from freeswing.cdpr.system.confine import results_folder
    from freeswing.doctor.bench_units import refuse_wrong_plan
    from freeswing.excite.bench_plan import bench_case, planned
    from freeswing.excite.bench_table import bench_document, bench_words
    from freeswing.results.planning import BenchPlan
    from freeswing.session.made import Made, write_made

    case = bench_case(robot, options.load_kg, options.load_izz_kg_m2, options.mass_kg)
    asked = {name: getattr(options, name) for name in ("known_kg", "gain_std", "duration_s")}
    case = replace(case, **{name: value for name, value in asked.items() if value is not None})
    refuse_wrong_plan(case)
    kept = (*options.keep, *(() if options.duration_s is None else ("duration_s",)))
    told = bench_document(*planned(case, kept))
    for line in bench_words(told):
        console.say(line)
    folder = results_folder(options.robot.parent, options.results)
    result = write_made(folder, Made((("bench-plan.json", BenchPlan.from_json(told)),)))
    console.say(str(result))
    console.show_file(result)
