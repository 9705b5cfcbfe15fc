"""Evidence for every candidate effect at once, linearised at a fit that does not have them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.model.elastic_motion import SPRUNG
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.known_values import prior_whitener, with_effects
from freeswing.cdpr.robot import Array
from freeswing.cdpr.simulation.free_swing import Motion
from freeswing.cdpr.simulation.sensitivity import linearise, linearise_beside
from freeswing.cdpr.system.threads import side_by_side
from freeswing.ident.diagnose.leave_one_out import Evidence
from freeswing.ident.diagnose.own_values import OwnValues
from freeswing.ident.diagnose.variants import effect_of, inside
from freeswing.ident.likelihood.blocks import columns_of, shared_size
from freeswing.ident.likelihood.calibration_modes import amplitudes_of, motion_shifts
from freeswing.ident.likelihood.fit_swings import LikelihoodFit
from freeswing.ident.likelihood.run_residuals import Reduced, Samples, own_numbers, reduce_run

NONE = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class Screen:
    """Linear evidence for a base model and candidates beside it.

    Attributes:
        model: with the accepted effects first and the candidates after them.
        values: at which it was linearised: fitted ones, and candidates that do nothing.
        evidence: over [9 inertia values; effect values; amplitudes of errors that runs share].
        base: columns of inertia and of what is estimated of the accepted effects.
        columns: of each candidate's amplitudes, but those that each run has for itself: these
            are eliminated with its state.
    """

    model: Model
    values: Array
    evidence: Evidence
    base: np.ndarray
    columns: dict[str, np.ndarray]

    def with_candidate(self, *keys: str) -> Evidence:
        """Evidence over the base and the named candidates' amplitudes."""
        return self.evidence.subset(np.concatenate([self.base, *(self.columns[n] for n in keys)]))

    def start_of(self, key: str) -> Array:
        """Values of a candidate's whole effect as it was screened, doing nothing, (k,)."""
        return self.values[self.model.place_of(effect_of(key))].copy()


def screen(
    fit: LikelihoodFit,
    keys: Sequence[str],
    noise_scales: Array,
    shapes: dict[str, dict[str, float]] | None = None,
    colour: float = 1.0,
    beside: np.ndarray = NONE,
) -> Screen:
    """Linearise a fit by its own unknowns and by the amplitudes of candidates.

    Args:
        fit: the current model's.
        keys: candidates: effects that are not in it, or parts that it holds.
        noise_scales: of metres and radians: those of the noise, not of the residual, (2,).
        shapes: values for shape parameters (a frequency) by effect and parameter name.
        colour: power of the residual in the band of the motion over the noise's, >= 1: samples
            that a model does not reach count that much less beside the priors.
        beside: further shared unknowns to linearise by, held though they are, (h,).
    """
    return screens(fit, [(keys, shapes or {})], noise_scales, colour, beside)[0]


Group = tuple[Sequence[str], dict[str, dict[str, float]]]


@dataclass(frozen=True, slots=True)
class _Asked:
    """Candidates that are screened together.

    Attributes:
        model: with them after the accepted effects.
        values: at which it is linearised.
        columns: of each candidate's amplitudes.
        wanted: by which of the shared unknowns.
        stretches: whether one of the candidates stretches cables.
    """

    model: Model
    values: Array
    columns: dict[str, np.ndarray]
    wanted: np.ndarray
    stretches: bool


def screens(
    fit: LikelihoodFit,
    groups: Sequence[Group],
    noise_scales: Array,
    colour: float = 1.0,
    beside: np.ndarray = NONE,
) -> list[Screen]:
    """Linearise a fit by its own unknowns once, and by the amplitudes of candidates by groups.

    Args:
        fit: the current model's.
        groups: candidates, and values for shape parameters by effect and parameter name.
        noise_scales: as of `screen`.
        colour: as well.
        beside: as well.
    """
    base, common = np.flatnonzero(fit.free), len(amplitudes_of(fit.samples))
    asked = [_asked(fit, *group, np.concatenate([base, beside])) for group in groups]
    size = shared_size(fit.model)
    first = np.any([one.wanted[:size] for one in asked], axis=0)
    for one in asked:
        one.wanted[:size] = first

    def reduced(
        motion: Motion, samples: Samples
    ) -> list[tuple[Array, OwnValues | None, OwnValues | None]]:
        known = linearise(replace(motion, model=fit.model), first)
        shifts = motion_shifts(motion, samples, common) if common else None
        found = []
        for one in asked:
            mine = np.append(motion.values, one.values[len(motion.values) :])
            moved = replace(motion, model=one.model, values=mine)
            linear = known
            if one.stretches:
                linear = linearise(moved, one.wanted, len(one.values) - len(fit.values))
            elif one.model is not fit.model:
                linear = linearise_beside(known, moved, one.wanted)
            run = reduce_run(linear, samples, noise_scales, shifts, float(np.sqrt(colour)))
            found.append((run.rows, _own_values(run, moved, colour), _plucked(run, moved, colour)))
        return found

    by_run = list(side_by_side(reduced, fit.motions, fit.samples))
    told = []
    for one, runs in zip(asked, zip(*by_run, strict=True), strict=True):
        triangles, own, plucked = zip(*runs, strict=True)
        evidence = Evidence(
            tuple(s.name for s in fit.samples),
            np.array(triangles),
            np.array([_count(samples, one.model) for samples in fit.samples], dtype=np.float64),
            np.sqrt(colour) * known_rows(one.model, one.values, fit.samples),
            common,
            _together(own),
            _together(plucked),
        )
        told.append(Screen(one.model, one.values, evidence, base, one.columns))
    return told


def _asked(
    fit: LikelihoodFit,
    keys: Sequence[str],
    shapes: dict[str, dict[str, float]],
    held: np.ndarray,
) -> _Asked:
    """What a group of candidates asks for, beside the columns of what is fitted."""
    fresh = [n for n in dict.fromkeys(map(effect_of, keys)) if n not in fit.model.effects]
    model = with_effects(fit.model, fresh) if fresh else fit.model
    values = model.start_values.copy()
    values[: len(fit.values)] = fit.values
    for name in fresh:
        where = model.place_of(name)
        for k in range(where.start, where.stop):
            parameter = model.parameters[k]
            values[k] = shapes.get(name, {}).get(parameter.name, parameter.start)
    columns = {key: _amplitudes(model, key) for key in keys}
    wanted = np.zeros(shared_size(model), dtype=bool)
    own = len(fit.inertia) + model.own_values
    wanted[np.concatenate([held, own, *columns.values()])] = True
    return _Asked(model, values, columns, wanted, any(effect_named(n).stretches for n in fresh))


def _count(samples: Samples, model: Model) -> int:
    lengths = 0 if samples.lengths_m is None else model.robot.n_cables
    return samples.values.size - own_numbers(model) + lengths


def _amplitudes(model: Model, key: str) -> np.ndarray:
    chosen = inside(model.robot, key)
    parameters = model.parameters[model.place_of(effect_of(key))]
    offsets = [k for k, p in enumerate(parameters) if chosen[k] and p.amplitude and not p.per_run]
    return columns_of(model, effect_of(key))[offsets]


def _own_values(reduced: Reduced, motion: Motion, colour: float) -> OwnValues | None:
    """What a run knows of effect values that it has for itself, but for nuisances; None: none.

    Its triangle over its own unknowns holds what is known of them beforehand, raised by the
    residual's colour as everything that is weighed against its samples.
    """
    model, mine = motion.model, _claimed(motion.model)
    first = len(reduced.own) - len(reduced.own_columns)
    if not mine:
        return None
    places = model.own_values[mine]
    rows = reduced.own[first:, first : first + len(reduced.own_columns)]
    # What is left of nuisances is eliminated by the rows above.
    others = [i for i in range(len(model.own_values)) if i not in mine]
    both = np.column_stack([rows[:, [*others, *mine]], reduced.own[first:, -1]])
    square = np.asarray(np.linalg.qr(both, mode="r"))[len(others) :, len(others) :]
    kept, right = square[: len(mine), :-1], square[: len(mine), -1]
    size = np.array([model.parameters[k].prior_std for k in places])
    known = kept.T @ kept * np.outer(size, size) / colour
    values = motion.values[places] - np.linalg.solve(kept, right)
    return OwnValues(known - np.eye(len(mine)), known @ (values / size), np.array(1.0))


def _claimed(model: Model) -> list[int]:
    """Which of the values that each run has for itself are of no nuisance."""
    nuisances = {
        k
        for name in model.effects
        if effect_named(name).nuisance
        for k in range(len(model.names))[model.place_of(name)]
    }
    return [i for i, k in enumerate(model.own_values) if k not in nuisances]


def _plucked(reduced: Reduced, motion: Motion, colour: float) -> OwnValues | None:
    """What a run knows of how its start plucks cables, in the whole weight; None: they are held.

    Values of effects that the run has for itself stand where they are: these are charged with the
    start eliminated (`_own_values`), and what both say alike is charged once.

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 1.2: the product rule.
    """
    if not len(reduced.plucked):
        return None
    count, model = len(reduced.own), motion.model
    usual = float(motion.values[model.place_of(SPRUNG[1])][0])
    first = count - len(reduced.own_columns)
    free = np.setdiff1d(np.arange(count), first + np.array(_claimed(model), dtype=np.int64))
    square = np.asarray(np.linalg.qr(reduced.own[:, [*free, -1]], mode="r"))[: len(free)]
    own, right = square[:, :-1], square[:, -1]
    by_own, start = reduced.plucked[:, free], reduced.plucked[:, -1]
    values = usual * (start - by_own @ np.linalg.solve(own, right))
    root = usual * np.linalg.solve(own.T, by_own.T)
    known = np.linalg.inv(root.T @ root) / colour
    return OwnValues(known - np.eye(len(start)) / usual**2, known @ values, np.array(usual))


def _together(runs: Sequence[OwnValues | None]) -> OwnValues | None:
    known = [one for one in runs if one is not None]
    if not known:
        return None
    return OwnValues(*(np.array(part) for part in zip(*known, strict=True)))


def known_rows(model: Model, values: Array, samples: Sequence[Samples]) -> Array:
    """What is known of all shared unknowns beforehand, as rows of unit deviation.

    Args:
        model: with its effects.
        values: of these, (k,).
        samples: of the runs: what errors they share, and what is taken out of these.

    Returns:
        Over [9 inertia values; effect values; amplitudes; residual], (k + r, 9 + k + r + 1).

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 3.3: a Gaussian prior as
        rows.
    """
    of_values, amplitudes = value_priors(model, values), amplitudes_of(samples)
    count = len(amplitudes)
    beside = np.zeros((len(of_values), count))
    of_errors = np.zeros((count, of_values.shape[1] - 1))
    return np.vstack(
        [
            np.hstack([of_values[:, :-1], beside, of_values[:, -1:]]),
            np.hstack([of_errors, np.eye(count), amplitudes[:, None]]),
        ]
    )


def value_priors(model: Model, values: Array) -> Array:
    """Each effect value is within its plausible range: a weak row each, (k, 9 + k + 1).

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 3.3: a Gaussian prior as
        rows.
    """
    rows = np.zeros((len(values), shared_size(model) + 1))
    whitener = prior_whitener(model)
    whitener[model.own_values] = 0.0
    rows[:, -1 - len(values) : -1] = whitener
    rows[:, -1] = whitener @ (values - model.start_values)
    return rows
