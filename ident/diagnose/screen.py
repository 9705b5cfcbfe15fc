"""Evidence for every candidate effect at once, linearised at a fit that does not have them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.known_values import prior_whitener, with_effects
from freeswing.cdpr.robot import Array
from freeswing.cdpr.simulation.sensitivity import linearise
from freeswing.ident.diagnose.leave_one_out import Evidence
from freeswing.ident.diagnose.variants import effect_of, inside
from freeswing.ident.likelihood.blocks import columns_of, shared_size
from freeswing.ident.likelihood.fit_swings import LikelihoodFit
from freeswing.ident.likelihood.run_residuals import Samples, reduce_run


@dataclass(frozen=True, slots=True)
class Screen:
    """Linear evidence for a base model and candidates beside it.

    Attributes:
        model: with the accepted effects first and the candidates after them.
        values: at which it was linearised: fitted ones, and candidates that do nothing.
        evidence: over [9 inertia values; effect values].
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


def screen(
    fit: LikelihoodFit,
    keys: Sequence[str],
    noise_scales: Array,
    shapes: dict[str, dict[str, float]] | None = None,
    colour: float = 1.0,
) -> Screen:
    """Linearise a fit by its own unknowns and by the amplitudes of candidates.

    Args:
        fit: the current model's.
        keys: candidates: effects that are not in it, or parts that it holds.
        noise_scales: of metres and radians: those of the noise, not of the residual, (2,).
        shapes: values for shape parameters (a frequency) by effect and parameter name.
        colour: power of the residual in the band of the motion over the noise's, >= 1: samples
            that a model does not reach count that much less beside the priors.
    """
    fresh = [n for n in dict.fromkeys(map(effect_of, keys)) if n not in fit.model.effects]
    model = with_effects(fit.model, fresh) if fresh else fit.model
    values = model.start_values.copy()
    values[: len(fit.values)] = fit.values
    for name in fresh:
        where = model.place_of(name)
        for k in range(where.start, where.stop):
            parameter = model.parameters[k]
            values[k] = (shapes or {}).get(name, {}).get(parameter.name, parameter.start)
    triangles, counts = [], []
    for motion, samples in zip(fit.motions, fit.samples, strict=True):
        mine = values.copy()
        mine[: len(fit.values)] = motion.values
        reduced = reduce_run(
            linearise(replace(motion, model=model, values=mine), len(values) - len(fit.values)),
            samples,
            noise_scales,
            prior_weight=float(np.sqrt(colour)),
        )
        triangles.append(reduced.rows)
        counts.append(_count(samples, model))
    evidence = Evidence(
        tuple(s.name for s in fit.samples),
        np.array(triangles),
        np.array(counts, dtype=np.float64),
        np.sqrt(colour) * value_priors(model, values),
    )
    columns = {key: _amplitudes(model, key) for key in keys}
    return Screen(model, values, evidence, np.flatnonzero(fit.free), columns)


def _count(samples: Samples, model: Model) -> int:
    n = model.robot.n_cables
    own = 12 - n + len(model.own_values)
    return samples.values.size - own + (0 if samples.lengths_m is None else n)


def _amplitudes(model: Model, key: str) -> np.ndarray:
    chosen = inside(model.robot, key)
    parameters = model.parameters[model.place_of(effect_of(key))]
    offsets = [k for k, p in enumerate(parameters) if chosen[k] and p.amplitude and not p.per_run]
    return columns_of(model, effect_of(key))[offsets]


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
