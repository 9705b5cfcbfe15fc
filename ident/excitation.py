"""The best swings to record: lengths and releases of n_e equilibria that minimise C (eqs. 40-42).

Random swings as large as the limits let them be make a library; many starts choose plans out of
it by exchange, each in hundredths of a second; the best plan is then moved downhill by exact
gradients, and its cost computed once more from the motions themselves.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cdpr.documents import DataError, replace_file, write_json
from cdpr.free_motion import choose_free_coordinates
from cdpr.model import build_model
from cdpr.robot import INERTIA_NAMES, Array, Robot
from cdpr.robot_file import read_robot
from cdpr.statics import random_poses
from ident.excitation_choice import (
    Choice,
    choose,
    determinant_cost,
    excitation_cost,
    excited_directions,
    random_costs,
    reduced,
    stacked_cost,
)
from ident.excitation_information import MeasurementNoise, predicted_std, swing_information
from ident.excitation_picture import swings_svg
from ident.excitation_refine import refine
from ident.excitation_swings import Bench, Swing, SwingLimits, random_swing

Progress = Callable[[str, float], None]

_GOOD_COST = 10.0
CRITERIA = ("cost", "information")


@dataclass(frozen=True, slots=True)
class ExcitationOptions:
    """What is asked of a plan.

    Attributes:
        n_swings: equilibria n_e.
        n_samples: samples a swing.
        duration_s: length of a swing.
        limits: what every swing keeps.
        criterion: "cost" for C of eq. (40), "information" for D-optimality of the
            maximum-likelihood estimate.
        n_library: random swings to choose from.
        n_starts: random plans that exchange starts from.
        rounds: rounds of refinement by gradients ("cost" alone).
        n_random: random plans to score beside the best one.
        noise: of the measurements, for the predicted standard deviations.
        mass_kg: overrules the robot file's.
        seed: of all chance.
    """

    n_swings: int = 12
    n_samples: int = 100
    duration_s: float = 10.0
    limits: SwingLimits = field(default_factory=SwingLimits)
    criterion: str = "cost"
    n_library: int = 96
    n_starts: int = 30
    rounds: int = 6
    n_random: int = 0
    noise: MeasurementNoise = field(default_factory=MeasurementNoise)
    mass_kg: float | None = None
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Plan:
    """Swings to record.

    Attributes:
        swings: in the order of a short way from one to the next.
        cost: C, from the motions simulated once more to 1e-10 m, W taken as a whole.
        start_costs: what each start reached by exchange, rising.
        history: C along the refinement.
        random: C of random plans, (n_random,).
        std: predicted standard deviations of the inertia values, (9,).
        seconds: making the library, all starts, and the refinement.
    """

    swings: tuple[Swing, ...]
    cost: float
    start_costs: tuple[float, ...]
    history: tuple[float, ...]
    random: Array
    std: Array
    seconds: tuple[float, float, float]


def excite(
    path: Path | str,
    options: ExcitationOptions | None = None,
    progress: Progress | None = None,
    results: Path | str | None = None,
) -> dict:
    """Plan the swings of a robot; write results/excitation.json, .csv and .svg beside its file.

    Args:
        path: robot.toml.
        options: what is asked.
        progress: told a label and a fraction from 0 to 1.
        results: the folder to write to instead.

    Returns:
        What was written: the document of FORMATS, "Start pose and excitation".

    Raises:
        InputError: the robot file is wrong or a result cannot be written.
        DataError: the robot's values do not suffice, or it has no swing within the limits.
    """
    path, options = Path(path), options or ExcitationOptions()
    say = progress or (lambda _label, _fraction: None)
    bench = make_bench(read_robot(path), options)
    plan = plan_swings(bench, options, say)
    document = plan_document(bench, options, plan)
    results = path.parent / "results" if results is None else Path(results)
    write_json(results / "excitation.json", document)
    replace_file(results / "excitation.csv", plan_table(bench, plan).encode())
    replace_file(results / "excitation.svg", swings_svg(bench, plan.swings).encode())
    say("plan", 1.0)
    return document


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


def check_options(options: ExcitationOptions) -> None:
    """Refuse options that make no sense.

    Raises:
        ValueError: naming the option, its value and its limit.
    """
    low, high = options.limits.tension_N
    if not 0 <= low < high:
        raise ValueError(f"tension limits {low:g} to {high:g} N: need 0 <= lowest < highest")
    for name in ("n_swings", "n_samples", "n_starts"):
        value, least = getattr(options, name), {"n_samples": 10}.get(name, 1)
        if value < least:
            raise ValueError(f"{name} is {value}, must be at least {least}")
    if options.n_library < options.n_swings:
        raise ValueError(
            f"n_library is {options.n_library}, must be at least n_swings = {options.n_swings}"
        )
    if options.criterion not in CRITERIA:
        raise ValueError(f"criterion {options.criterion!r} must be one of {', '.join(CRITERIA)}")


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


def plan_document(bench: Bench, options: ExcitationOptions, plan: Plan) -> dict:
    """results/excitation.json as a dictionary."""
    document = {
        "format": "freeswing-excitation/1",
        "cost_C": plan.cost,
        "equilibria": [_entry(bench, swing) for swing in plan.swings],
        "criterion": options.criterion,
        "free_coordinates": list(bench.free),
        "samples_per_swing": bench.n_samples,
        "duration_s": bench.duration_s,
        "limits": {
            "tension_N": list(options.limits.tension_N),
            "reach_m": options.limits.reach_m,
            "amplification": options.limits.amplification,
        },
        "mass_kg": bench.mass_kg,
        "predicted_std": dict(zip(INERTIA_NAMES, plan.std.tolist(), strict=True)),
        "starts": {"count": len(plan.start_costs), "costs": list(plan.start_costs)},
        "refinement": list(plan.history),
        "seconds": dict(zip(("library", "starts", "refinement"), plan.seconds, strict=True)),
        "random_plans": None,
    }
    if len(plan.random):
        quantiles = np.quantile(plan.random, [0.0, 0.1, 0.5, 0.9, 1.0]).tolist()
        document["random_plans"] = {
            "count": len(plan.random),
            "quantiles": dict(zip(("0", "10", "50", "90", "100"), quantiles, strict=True)),
            "share_below_10": float((plan.random < _GOOD_COST).mean()),
        }
    return document


def plan_table(bench: Bench, plan: Plan) -> str:
    """The table to take to the robot: one swing a row, as CSV."""
    names = [cable.name for cable in bench.model.robot.cables]
    free = bench.free_indices
    header = ["swing", *(f"l_{name}_m" for name in names)]
    header += [f"rest_{c}" for c in bench.free] + [f"displace_{c}" for c in bench.free]
    header += ["lowest_tension_N", "highest_tension_N"]
    header += [f"frequency_{k + 1}_hz" for k in range(len(free))]
    rows = [",".join(header)]
    for k, swing in enumerate(plan.swings):
        rest = swing.equilibrium
        away = (swing.release - rest.zeta)[free]
        numbers = [*rest.lengths_m, *rest.zeta[free], *away]
        tail = [*swing.tension_N, *swing.frequencies_hz]
        cells = [str(k + 1), *(f"{v:.4f}" for v in numbers), *(f"{v:.2f}" for v in tail)]
        rows.append(",".join(cells))
    return "\n".join([*rows, ""])


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


def _in_short_order(swings: tuple[Swing, ...]) -> tuple[Swing, ...]:
    """Each next swing is the nearest by its lengths, from the shortest on."""
    left = sorted(swings, key=lambda s: float(s.equilibrium.lengths_m.sum()))
    ordered = [left.pop(0)]
    while left:
        here = ordered[-1].equilibrium.lengths_m
        gaps = [float(np.abs(s.equilibrium.lengths_m - here).max()) for s in left]
        ordered.append(left.pop(int(np.argmin(gaps))))
    return tuple(ordered)


def _entry(bench: Bench, swing: Swing) -> dict:
    rest = swing.equilibrium
    return {
        "cable_lengths_m": rest.lengths_m.tolist(),
        "equilibrium": _pose_entry(rest.zeta),
        "release": _pose_entry(swing.release),
        "tension_range_N": list(swing.tension_N),
        "frequencies_hz": swing.frequencies_hz.tolist(),
        "conditioning": swing.amplification,
        "reach": dict(zip(bench.free, swing.reach.tolist(), strict=True)),
    }


def _pose_entry(pose: Array) -> dict:
    return {"position_m": pose[:3].tolist(), "angles_rad": pose[3:].tolist()}
