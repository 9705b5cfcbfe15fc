"""Evidence for every candidate effect at once, linearised at a fit that does not have them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdpr.effects import effect_named
from cdpr.model import Model, build_model
from cdpr.robot import Array
from cdpr.sensitivity import linearise
from ident.diagnose.rows import Evidence
from ident.likelihood import LikelihoodFit
from ident.likelihood_run import Samples, reduce_run

BASE = 9


@dataclass(frozen=True, slots=True)
class Screen:
    """Linear evidence for a base model and candidates beside it.

    Attributes:
        model: with the accepted effects first and the candidates after them.
        values: at which it was linearised: fitted ones, and candidates that do nothing.
        evidence: over [9 inertia values; effect values].
        base: columns of inertia and accepted effects.
        columns: of each candidate's amplitudes, but those that each run has for itself: these
            are eliminated with its state.
    """

    model: Model
    values: Array
    evidence: Evidence
    base: np.ndarray
    columns: dict[str, np.ndarray]

    def with_candidate(self, *names: str) -> Evidence:
        """Evidence over the base and the named candidates' amplitudes."""
        return self.evidence.subset(np.concatenate([self.base, *(self.columns[n] for n in names)]))


def screen(
    fit: LikelihoodFit,
    candidates: Sequence[str],
    noise_scales: Array,
    shapes: dict[str, dict[str, float]] | None = None,
    colour: float = 1.0,
) -> Screen:
    """Linearise a fit by its own unknowns and by the amplitudes of candidates.

    Args:
        fit: the current model's.
        candidates: names of effects that are not in it.
        noise_scales: of metres and radians: those of the noise, not of the residual, (2,).
        shapes: values for shape parameters (a frequency) by effect and parameter name.
        colour: power of the residual in the band of the motion over the noise's, >= 1: samples
            that a model does not reach count that much less beside the priors.
    """
    accepted = fit.model.effects
    model = build_model(fit.model.robot, (*accepted, *candidates))
    values, columns = _start(model, fit, candidates, shapes or {})
    base = np.arange(BASE + len(fit.values))
    triangles, counts = [], []
    for motion, samples in zip(fit.motions, fit.samples, strict=True):
        mine = values.copy()
        mine[: len(fit.values)] = motion.values
        reduced = reduce_run(
            linearise(replace(motion, model=model, values=mine)), samples, noise_scales
        )
        triangles.append(reduced.rows)
        counts.append(_count(samples, model))
    evidence = Evidence(
        tuple(s.name for s in fit.samples),
        np.array(triangles),
        np.array(counts, dtype=np.float64),
        np.sqrt(colour) * _priors(model, values),
    )
    return Screen(model, values, evidence, base, columns)


def _count(samples: Samples, model: Model) -> int:
    n = model.robot.n_cables
    own = 12 - n + len(model.own_values)
    return samples.values.size - own + (0 if samples.lengths_m is None else n)


def _start(
    model: Model,
    fit: LikelihoodFit,
    candidates: Sequence[str],
    shapes: dict[str, dict[str, float]],
) -> tuple[Array, dict[str, np.ndarray]]:
    values = model.start_values.copy()
    values[: len(fit.values)] = fit.values
    columns, used = {}, len(fit.values)
    for name in candidates:
        parameters = effect_named(name).parameters(model.robot)
        for offset, parameter in enumerate(parameters):
            values[used + offset] = shapes.get(name, {}).get(parameter.name, parameter.start)
        amplitudes = [k for k, p in enumerate(parameters) if p.amplitude and not p.per_run]
        columns[name] = BASE + used + np.array(amplitudes, dtype=np.int64)
        used += len(parameters)
    return values, columns


def _priors(model: Model, values: Array) -> Array:
    """Each effect value is within its plausible range: a weak row each."""
    count = BASE + len(values)
    rows = np.zeros((len(values), count + 1))
    for k, parameter in enumerate(model.parameters):
        if parameter.per_run:
            continue
        rows[k, BASE + k] = 1.0 / parameter.prior_std
        rows[k, -1] = (values[k] - parameter.start) / parameter.prior_std
    return rows
