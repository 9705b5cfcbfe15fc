"""What errors of the robot file and missing forces do to residuals and inertia, to first order."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.effects import Recorded, catalogue, effect_named
from freeswing.cdpr.frozen import freeze
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.known_values import with_effects
from freeswing.cdpr.robot import Array, Robot
from freeswing.cdpr.simulation.free_swing import Motion
from freeswing.cdpr.simulation.sensitivity import linearise
from freeswing.cdpr.system.threads import side_by_side
from freeswing.ident.likelihood.blocks import MODES, columns_of, state_of
from freeswing.ident.likelihood.calibration_modes import amplitudes_of, motion_shifts
from freeswing.ident.likelihood.fit_swings import LikelihoodFit
from freeswing.ident.likelihood.joint_problem import PAYLOADS, Problem, State
from freeswing.ident.likelihood.run_residuals import Samples, reduce_run

# What robot.toml says of a cable, each with a tolerance (`cdpr.tolerances`).
OF_CABLES = ("anchor_offset", "attachment_offset", "pulley_radius", "pulley_axis")
GEOMETRY = "geometry"  # the cause that all of these are together
NONE = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class Asked:
    """Errors of size one, what a fit leaves of them, and what they do to its inertia.

    Attributes:
        answers: what they make of the numbers that the fit leaves of them, (k, q).
        seen: these numbers, in units of the residuals, (k,).
        moved: what they do to the fit's shared unknowns, the inertia's nine first, (p, q).
        causes: columns of each cause; all errors of the cables' geometry are one, in tolerances,
            of other effects of their typical size.
        colour: power of the residuals where platforms swing over that of white noise.
    """

    answers: Array
    seen: Array
    moved: Array
    causes: dict[str, np.ndarray]
    colour: float

    def __post_init__(self) -> None:
        freeze(self, "answers", "seen", "moved")


def asked_errors(found: LikelihoodFit, settled: np.ndarray = NONE) -> Asked:
    """What errors of the cables' geometry and missing effects would do, to first order about a fit.

    Args:
        found: the fit.
        settled: places among its effects' values of geometry that is known by itself, (g,): no
            error of the robot file.
    """
    rows, unknown, causes = _equations(found, settled)
    errors = np.concatenate(list(causes.values()))
    scale = np.linalg.norm(rows[:, unknown], axis=0)
    scale[scale == 0.0] = 1.0
    stacked = np.hstack([rows[:, unknown] / scale, rows[:, errors], rows[:, -1:]])
    triangle = np.asarray(np.linalg.qr(stacked, mode="r"))
    first, last = len(unknown), len(unknown) + len(errors)
    change = np.linalg.lstsq(triangle[:first, :first], triangle[:first, first:last], rcond=None)[0]
    moved = np.zeros((len(found.free), len(errors)))
    moved[np.flatnonzero(found.free)] = change / scale[:, None]
    starts = np.cumsum([0, *map(len, causes.values())])
    places = {
        name: np.arange(begin, begin + len(columns))
        for (name, columns), begin in zip(causes.items(), starts[:-1], strict=True)
    }
    answers, seen = triangle[first:last, first:last], triangle[first:last, -1]
    return Asked(answers, seen, moved, places, found.enlargement)


def missing_names(found: LikelihoodFit) -> tuple[str, ...]:
    """Effects of the catalogue that a fit lacks and that cost no more to linearise.

    Not those of the cables' geometry, nor what each run has for itself.
    """
    robot = found.model.robot
    recorded = Recorded(lengths=any(run.lengths_m is not None for run in found.samples))
    names = []
    for name, effect in catalogue().items():
        known = name in (*OF_CABLES, *found.model.effects)
        costly = effect.needs_tension or effect.nuisance or not effect.on_free
        if known or costly or effect.cannot_show(robot, recorded):
            continue
        if not any(one.per_run for one in effect.parameters(robot)):
            names.append(name)
    return tuple(names)


def _equations(
    found: LikelihoodFit, settled: np.ndarray
) -> tuple[Array, np.ndarray, dict[str, np.ndarray]]:
    """The fit to first order over [shared unknowns; modes; errors of size one; residual].

    Returns:
        Its rows, and the columns of what is estimated and of the errors of each cause.
    """
    forces = missing_names(found)
    cables = [n for n in shown(found.model.robot) if n not in found.model.effects]
    model = with_effects(found.model, [*cables, *forces])
    values, modes = model.start_values.copy(), len(amplitudes_of(found.samples))
    values[: len(found.values)] = found.values
    rest = found.unknowns.without(MODES) if MODES in found.unknowns else found.unknowns
    state = replace(state_of(rest, found.model, found.scales), values=values)
    problem = Problem(model, found.samples)

    def reduced(motion: Motion, run: Samples) -> Array:
        mine = values.copy()
        mine[: len(found.values)] = motion.values
        linear = linearise(replace(motion, model=model, values=mine), wanted=problem.wanted)
        return reduce_run(linear, run, found.scales, motion_shifts(motion, run, modes)).rows[:-1]

    parts = []
    for run, rows in enumerate(side_by_side(reduced, found.motions, found.samples)):
        seen = problem.shared_map(run, state)
        parts.append(np.hstack([rows[:, : len(seen)] @ seen, rows[:, len(seen) :]]))
    parts.append(_prior_rows(problem, state, found, modes))
    rows = np.vstack(parts)
    estimated = _estimated(found, problem, modes)
    known = len(parts[-1])
    blocks = {GEOMETRY: _error_columns(rows, model, found, known, settled)}
    blocks |= {name: _force_columns(rows, model, name, known) for name in forces}
    causes, place = {}, rows.shape[1] - 1
    for name, block in blocks.items():
        causes[name] = place + np.arange(block.shape[1])
        place += block.shape[1]
    return np.hstack([rows[:, :-1], *blocks.values(), rows[:, -1:]]), estimated, causes


def _force_columns(rows: Array, model: Model, name: str, known: int) -> Array:
    """What an effect's amplitudes of typical size do to rows, the last `known` of which are priors.

    Its shape (where a drag acts) is as it starts.
    """
    parameters = model.parameters[model.place_of(name)]
    pairs = zip(columns_of(model, name), parameters, strict=True)
    block = np.array([rows[:, k] * one.scale for k, one in pairs if one.amplitude]).T
    block[len(rows) - known :] = 0.0
    return block


def shown(robot: Robot) -> tuple[str, ...]:
    """Those of which the robot has a part: an eyelet has no pulley."""
    return tuple(name for name in OF_CABLES if effect_named(name).parameters(robot))


def tolerance(robot: Robot, name: str) -> float:
    """How well an effect of the cables' geometry is known, by the robot file."""
    return float(getattr(robot.tolerances, effect_named(name).tolerance))


def _prior_rows(problem: Problem, state: State, found: LikelihoodFit, modes: int) -> Array:
    """What the fit knew beforehand, over [shared unknowns; modes; residual]."""
    rows = problem.prior_rows(state)
    fitted = np.ones(len(rows), dtype=bool)
    fitted[len(found.values) : len(state.values)] = False
    known = np.insert(rows[fitted], [rows.shape[1] - 1] * modes, 0.0, axis=1)
    beside = np.zeros((modes, known.shape[1]))
    beside[:, -1 - modes : -1] = np.eye(modes)
    beside[:, -1] = amplitudes_of(found.samples)
    return np.vstack([known, beside])


def _estimated(found: LikelihoodFit, problem: Problem, modes: int) -> np.ndarray:
    """Columns of what the fit estimated."""
    size, payloads = problem.layout.size, problem.layout.place(PAYLOADS)
    places = [np.arange(9 + len(found.values)), np.arange(size)[payloads]]
    if MODES in found.unknowns:
        places.append(size + np.arange(modes))
    return np.concatenate(places)[found.free]


def _error_columns(
    rows: Array, model: Model, found: LikelihoodFit, known: int, settled: np.ndarray
) -> Array:
    """What errors of one tolerance do to rows, the last `known` of which are priors, (n, q).

    A cable end that is estimated is off its prior, as far as that is wide: the prior's row errs.
    """
    columns = []
    for name in shown(model.robot):
        size = tolerance(model.robot, name)
        for column in columns_of(model, name):
            if column - 9 in settled:
                continue
            stated = name in found.model.effects and found.free[column]
            error = rows[:, column] * (model.parameters[column - 9].prior_std if stated else size)
            part = slice(None, -known) if stated else slice(len(rows) - known, None)
            error[part] = 0.0
            columns.append(error)
    return np.array(columns).T.reshape(len(rows), -1)
