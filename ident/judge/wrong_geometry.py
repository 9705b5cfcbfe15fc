"""What a robot file that is wrong does to an inertia: as much as it leaves in the residuals.

A diameter given for a radius, or an anchor measured from another corner, moves what all runs say
alike: no scatter between runs tells, and motions are followed to little more than the noise. The
residuals do tell that something is off, and by how much: errors of the cables' ends and pulleys are
taken for independent, in proportion to their tolerances, and as large as makes the residuals
likeliest. What errors of that size do to the inertia belongs to its deviations.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import chdtri

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.frozen import freeze
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.model.known_values import with_effects
from freeswing.cdpr.robot import Array, Robot
from freeswing.cdpr.simulation.free_swing import Motion
from freeswing.cdpr.simulation.sensitivity import linearise
from freeswing.cdpr.system.threads import side_by_side
from freeswing.ident.estimate import Estimate
from freeswing.ident.fidim.essential_parameters import undetermined
from freeswing.ident.likelihood.blocks import MODES, columns_of, state_of
from freeswing.ident.likelihood.cable_ends import GeometryPriors
from freeswing.ident.likelihood.calibration_modes import amplitudes_of, motion_shifts
from freeswing.ident.likelihood.fit_swings import LikelihoodFit
from freeswing.ident.likelihood.joint_problem import PAYLOADS, Problem, State
from freeswing.ident.likelihood.run_residuals import Samples, reduce_run

# What robot.toml says of a cable, each with a tolerance (`cdpr.tolerances`).
OF_CABLES = ("anchor_offset", "attachment_offset", "pulley_radius", "pulley_axis")
ENDS = {"anchor_offset": "entry points", "attachment_offset": "attachment points"}
# Errors of no size are likeliest in every second session without any, and by chance others are a
# little likelier: in one of a thousand by so much.
CHANCE = 1e-3
# A size is looked for from a hundredth of the tolerances, which moves nothing, to a metre.
SIZES = np.append(0.0, np.geomspace(1e-2, 1e3, 241))
# What else is in the residuals: from a hundredth of their power, the noise of a fit that leaves ten
# times as much, to all of it, coloured as it is.
LEAST_REST, RESTS = 1e-2, 40


@dataclass(frozen=True, slots=True)
class WrongGeometry:
    """Errors of the cables' geometry, as large as residuals ask for.

    Attributes:
        size: in tolerances, of cable ends in the deviations that are stated where they are; zero
            where residuals need none.
        covariance: what errors of that size do to the inertia, (9, 9).
        stated: those deviations, by effect.
    """

    size: float
    covariance: Array
    stated: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        freeze(self, "covariance")


NOTHING_WRONG = WrongGeometry(0.0, np.zeros((9, 9)))


def wrong_geometry(found: LikelihoodFit) -> WrongGeometry:
    """How large errors of the cables' geometry a fit's residuals ask for, and what they do.

    Args:
        found: the fit.

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 3.5: the evidence of a linear
        model's prior size and noise.
    """
    rows, unknown, errors = _equations(found)
    scale = np.linalg.norm(rows[:, unknown], axis=0)
    scale[scale == 0.0] = 1.0
    together = np.hstack([rows[:, unknown] / scale, rows[:, errors], rows[:, -1:]])
    triangle = np.asarray(np.linalg.qr(together, mode="r"))
    first, last = len(unknown), len(unknown) + len(errors)
    left, answers, _ = np.linalg.svd(triangle[first:last, first:last])
    size = likely_size(answers, left.T @ triangle[first:last, -1], found.enlargement)
    if size == 0.0:
        return NOTHING_WRONG
    change = np.linalg.lstsq(triangle[:first, :first], triangle[:first, first:last], rcond=None)[0]
    moved = np.zeros((9, len(errors)))
    moved[unknown[unknown < 9]] = (change / scale[:, None])[unknown < 9]
    return WrongGeometry(size, size**2 * moved @ moved.T, _stated(found.model))


def likely_size(answers: Array, seen: Array, colour: float) -> float:
    """The size of errors that makes what is seen of them likeliest; zero where chance may do that.

    Args:
        answers: singular values: what independent errors of size one make of each number, (k,).
        seen: the numbers, in units of the residuals, (k,).
        colour: power of the residuals where platforms swing over that of white noise, at least 1.

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 3.5; Self, Liang 1987,
        Asymptotic properties of maximum likelihood estimators under nonstandard conditions: half a
        chi-square where a size cannot be below zero.
    """
    rest = np.geomspace(LEAST_REST, colour, RESTS)[:, None, None]
    variance = rest + (SIZES[:, None] * answers) ** 2
    surprise = np.sum(np.log(variance) + seen**2 / variance, axis=-1).min(axis=0)
    best = int(surprise.argmin())
    sure = surprise[0] - surprise[best] > chdtri(1, 2.0 * CHANCE)
    return float(SIZES[best]) if sure else 0.0


def geometry_of(robot: Robot, priors: GeometryPriors) -> Model:
    """The robot with its cables' geometry as values known as the size of errors is counted.

    Args:
        robot: as declared.
        priors: how well cable ends are known where that is stated; the rest by its tolerances.
    """
    model = build_model(robot, _shown(robot))
    stds = {name: priors.stds.get(name, _tolerance(robot, name)) for name in model.effects}
    spread = [stds[name] for name in model.effects for _ in columns_of(model, name)]
    parameters = tuple(
        one.known(0.0, std, "as stated, or tolerances of the robot file")
        for one, std in zip(model.parameters, spread, strict=True)
    )
    return replace(model, parameters=parameters)


def with_wrong_geometry(entry: Estimate, wrong: WrongGeometry) -> Estimate:
    """The estimate with deviations that hold what a wrong robot file does."""
    if wrong.size == 0.0:
        return entry
    before = entry.consistency.sentence()
    covariance = entry.covariance + wrong.covariance
    wider = float(np.sqrt(np.diag(covariance) / np.diag(entry.covariance)).max())
    told = replace(
        entry,
        covariance=covariance,
        essential=~undetermined(entry.values, np.sqrt(np.diag(covariance))),
        notes=(*(note for note in entry.notes if note != before), _sentence(wrong, wider)),
        extra={**entry.extra, "geometry_std": np.sqrt(np.diag(wrong.covariance)).tolist()},
    )
    said = told.consistency.sentence()
    return replace(told, notes=(*told.notes, said)) if said else told


def with_doubts(entry: Estimate, found: LikelihoodFit) -> tuple[Estimate, WrongGeometry]:
    """A fit's estimate with what a wrong robot file does, or the word that it cannot be told."""
    try:
        wrong = wrong_geometry(found)
    except (ValueError, np.linalg.LinAlgError) as error:
        note = (
            "standard deviations hold nothing of what errors of robot.toml do to the inertia: the "
            f"residuals could not be asked for them ({error})"
        )
        return replace(entry, notes=(*entry.notes, note)), NOTHING_WRONG
    return with_wrong_geometry(entry, wrong), wrong


def _sentence(wrong: WrongGeometry, wider: float) -> str:
    told = ", ".join(f"{1e3 * std:.3g} mm of {ENDS[name]}" for name, std in wrong.stated.items())
    unit = f" (as such count {told}, as stated)" if told else ""
    return (
        "the residuals are as if cable ends and pulleys of robot.toml were off by "
        f"{wrong.size:.2g} times their tolerances{unit}: standard deviations hold what errors of "
        f"that size do to the inertia, and are up to {wider:.1f} times as large for it; see what "
        "freeswing check and freeswing diagnose say"
    )


def _equations(found: LikelihoodFit) -> tuple[Array, np.ndarray, np.ndarray]:
    """The fit to first order over [shared unknowns; modes; errors of size one; residual].

    Returns:
        Its rows, and the columns of what is estimated and of the errors.
    """
    model = with_effects(
        found.model, [n for n in _shown(found.model.robot) if n not in found.model.effects]
    )
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
    errors = _error_columns(rows, model, found, len(parts[-1]))
    places = rows.shape[1] - 1 + np.arange(errors.shape[1])
    return np.hstack([rows[:, :-1], errors, rows[:, -1:]]), estimated, places


def _stated(model: Model) -> dict[str, float]:
    """The deviations of cable ends that a fit's priors state, by effect."""
    places = {name: columns_of(model, name) for name in ENDS if name in model.effects}
    stds = {name: model.parameters[where[0] - 9].prior_std for name, where in places.items()}
    return {name: std for name, std in stds.items() if std is not None}


def _shown(robot: Robot) -> tuple[str, ...]:
    """Those of which the robot has a part: an eyelet has no pulley."""
    return tuple(name for name in OF_CABLES if effect_named(name).parameters(robot))


def _tolerance(robot: Robot, name: str) -> float:
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


def _error_columns(rows: Array, model: Model, found: LikelihoodFit, known: int) -> Array:
    """What errors of one tolerance do to rows, the last `known` of which are priors, (n, q).

    A cable end that is estimated is off its prior, as far as that is wide: the prior's row errs.
    """
    columns = []
    for name in _shown(model.robot):
        where, stated = columns_of(model, name), name in found.model.effects
        size = _tolerance(model.robot, name)
        for column in where:
            error = rows[:, column] * (model.parameters[column - 9].prior_std if stated else size)
            part = slice(None, -known) if stated else slice(len(rows) - known, None)
            error[part] = 0.0
            columns.append(error)
    return np.array(columns).T
