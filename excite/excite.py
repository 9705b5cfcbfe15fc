"""The best swings to record: lengths and releases of n_e equilibria that minimise C (eqs. 40-42).

Random swings as large as the limits let them be make a library; many starts choose plans out of
it by exchange, each in hundredths of a second; the best plan is then moved downhill by exact
gradients, and its cost computed once more from the motions themselves.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.free_motion import choose_free_coordinates
from freeswing.cdpr.model.statics import random_poses
from freeswing.cdpr.robot import Array, Robot
from freeswing.cdpr.system.progress import Progress
from freeswing.excite.choose_swings import (
    Choice,
    choose,
    determinant_cost,
    excitation_cost,
    excited_directions,
    random_costs,
    reduced,
    stacked_cost,
)
from freeswing.excite.information import predicted_std, swing_information
from freeswing.excite.plan import ExcitationOptions, Plan, check_options
from freeswing.excite.plan_picture import swings_svg
from freeswing.excite.plan_tables import plan_document, plan_table, release_table
from freeswing.excite.random_swings import random_swing
from freeswing.excite.refine_plan import refine
from freeswing.excite.swing import Bench, Swing, SwingLimits
from freeswing.excite.winch_release import WinchRelease, winch_release

__all__ = ["ExcitationOptions", "Plan", "SwingLimits", "excite", "make_bench", "plan_swings"]


def excite(
    path: Path | str,
    options: ExcitationOptions | None = None,
    progress: Progress | None = None,
) -> tuple[dict, dict[str, str]]:
    """Plan the swings of a robot.

    Args:
        path: robot.toml.
        options: what is asked.
        progress: told a label and a fraction from 0 to 1.

    Returns:
        The content of excitation.json (FORMATS, "Start pose and excitation"), and further files
        by their names in the same folder: excitation.csv and .svg, and with `options.winch`
        excitation-release/<swing>.csv, what each winch is to do.

    Raises:
        InputError: the robot file is wrong.
        DataError: the robot's values do not suffice, or it has no swing within the limits.
    """
    options = options or ExcitationOptions()
    say = progress or (lambda _label, _fraction: None)
    bench = make_bench(read_robot(path), options)
    plan = plan_swings(bench, options, say)
    document = plan_document(bench, options, plan)
    files = {
        "excitation.csv": plan_table(bench, plan),
        "excitation.svg": swings_svg(bench, plan.swings),
    }
    for k, release in enumerate(plan.releases):
        if release is not None:
            files[f"excitation-release/{k + 1:02d}.csv"] = release_table(bench, release)
    say("plan", 1.0)
    return document, files


def make_bench(robot: Robot, options: ExcitationOptions) -> Bench:
    """The robot ready for planning.

    Raises:
        DataError: when its inertia or mass is unknown, or it has no free motion.
        ValueError: for options that make no sense.
    """
    check_options(options)
    mass = options.mass_kg or robot.platform.mass_kg
    if robot.inertia is None:
        raise DataError(
            "platform.com_m or platform.specific_inertia_m2 is missing in the robot file: swings "
            "are planned for nominal values; give them, or a mesh"
        )
    if mass is None:
        raise DataError("platform.mass_kg is missing: tension limits need it; give it or --mass")
    if not 1 <= robot.n_cables <= 5:
        raise DataError(f"{robot.n_cables} cables leave no free motion to record")
    model, free = build_model(robot), robot.free_coordinates
    if not free:
        poses = random_poses(model, np.random.default_rng(options.seed), 40)
        free = choose_free_coordinates(model, poses)[0]
    return Bench(
        model, robot.inertia, mass, free, options.limits, options.n_samples, options.duration_s
    )


def plan_swings(bench: Bench, options: ExcitationOptions, progress: Progress) -> Plan:
    """Library, starts, refinement and check.

    Raises:
        DataError: when the robot has no swing within the limits.
    """
    rng, begun = np.random.default_rng(options.seed), time.perf_counter()
    library = make_library(bench, options.n_library, rng, progress)
    basis = excited_directions(bench.inertia)
    grams = reduced(np.array([swing.gram for swing in library]), basis)
    made = time.perf_counter()
    starts = _starts(bench, options, library, grams, rng, progress)
    started = time.perf_counter()
    swings = tuple(library[k] for k in starts[0].indices)
    history: tuple[float, ...] = ()
    if options.criterion == "cost" and options.rounds > 0:
        found = refine(bench, swings, options.rounds, progress)
        swings, history = found.swings, found.history
    refined = time.perf_counter()
    swings = _in_short_order(swings)
    information = np.sum([swing_information(bench, s, options.noise) for s in swings], axis=0)
    return Plan(
        swings=swings,
        cost=checked_cost(bench, swings),
        start_costs=tuple(start.cost for start in starts),
        history=history,
        random=random_costs(grams, options.n_swings, options.n_random, rng),
        std=predicted_std(information),
        releases=_releases(bench, swings, progress) if options.winch else (),
        seconds=(made - begun, started - made, refined - started),
    )


def make_library(
    bench: Bench, n_swings: int, rng: np.random.Generator, progress: Progress
) -> list[Swing]:
    """Random swings within the limits.

    Raises:
        DataError: when there are none.
    """
    library = []
    for k in range(n_swings):
        progress("random swings", k / n_swings)
        try:
            library.append(random_swing(bench, rng))
        except ValueError as error:
            raise DataError(str(error)) from error
    return library


def checked_cost(bench: Bench, swings: tuple[Swing, ...]) -> float:
    """C as the paper stacks W, from motions simulated afresh to 1e-10 m."""
    stacked = [
        bench.regressor(bench.course(s.release, bench.duration_s, 1e-10).motion) for s in swings
    ]
    return stacked_cost(np.concatenate(stacked).reshape(-1, 10))


def _starts(
    bench: Bench,
    options: ExcitationOptions,
    library: list[Swing],
    grams: Array,
    rng: np.random.Generator,
    progress: Progress,
) -> list[Choice]:
    """What every start reached, the best first."""
    matrices, cost = grams, excitation_cost
    if options.criterion == "information":
        told = []
        for k, swing in enumerate(library):
            progress("information", k / len(library))
            told.append(swing_information(bench, swing, options.noise))
        scale = np.sqrt(np.mean([np.diag(one) for one in told], axis=0))
        matrices, cost = np.array(told) / np.outer(scale, scale), determinant_cost
    found = []
    for k in range(options.n_starts):
        progress("starts", k / options.n_starts)
        found.append(choose(matrices, options.n_swings, rng, cost))
    return sorted(found, key=lambda choice: choice.cost)


def _releases(
    bench: Bench, swings: tuple[Swing, ...], progress: Progress
) -> tuple[WinchRelease | None, ...]:
    """The winches' motion of each swing; None where the limits leave none."""
    found: list[WinchRelease | None] = []
    for k, swing in enumerate(swings):
        progress("releases", k / len(swings))
        try:
            found.append(winch_release(bench, swing))
        except ValueError:
            found.append(None)
    return tuple(found)


def _in_short_order(swings: tuple[Swing, ...]) -> tuple[Swing, ...]:
    """Each next swing is the nearest by its lengths, from the shortest on."""
    left = sorted(swings, key=lambda s: float(s.equilibrium.lengths_m.sum()))
    ordered = [left.pop(0)]
    while left:
        here = ordered[-1].equilibrium.lengths_m
        gaps = [float(np.abs(s.equilibrium.lengths_m - here).max()) for s in left]
        ordered.append(left.pop(int(np.argmin(gaps))))
    return tuple(ordered)
