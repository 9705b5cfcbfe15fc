"""A candidate added to the model and fitted in earnest, with its score on runs left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.known_values import with_known
from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.leave_one_out import Evidence, Score, score
from freeswing.ident.diagnose.outstanding_runs import tempered
from freeswing.ident.diagnose.screen import BASE, screen
from freeswing.ident.diagnose.spectrum import residual_powers
from freeswing.ident.diagnose.variants import effect_of, extended, inside, reduced
from freeswing.ident.likelihood.joint_problem import State
from freeswing.ident.likelihood.likelihood import LikelihoodFit, correlation_factor, fit

RANKING_STEPS = 12
# Surveys and calibrations are good to a few tenths of a millimetre: 0.3 mm for a displaced point.
NEGLIGIBLE = 0.1
RANKING_ACCURACY_M = 3e-7


@dataclass(frozen=True, slots=True)
class Refit:
    """A fit with a set of effects in the model.

    Attributes:
        fit: the fit.
        evidence: linear, at the fit, over inertia and effect values.
        score: of that evidence over what is estimated: its held-out costs count.
    """

    fit: LikelihoodFit
    evidence: Evidence
    score: Score

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of those in the model."""
        return self.fit.model.effects

    @property
    def held_out(self) -> float:
        """Sum of squares over the runs, each predicted with shared unknowns from the others."""
        return float(self.score.held_out.sum())

    def values_of(self, name: str) -> slice:
        """Where an effect's values stand among the fit's."""
        return self.fit.model.place_of(name)


def colour_of(fit: LikelihoodFit, noise_scales: Array) -> float:
    """How much stronger than the noise the residual is in the band of the motion, >= 1."""
    power = float(residual_powers(fit, noise_scales).mean())
    return max(1.0, power * correlation_factor(fit.motions, fit.samples, noise_scales))


def rescored(current: LikelihoodFit, noise_scales: Array, colour: float) -> Refit:
    """Score a fit that is there already, by the unknowns that it estimates."""
    linear = screen(current, (), noise_scales, colour=colour)
    return Refit(current, linear.evidence, score(linear.evidence.subset(linear.base)))


def refit(
    current: LikelihoodFit, candidate: str, values: Array, noise_scales: Array, colour: float
) -> Refit:
    """Add a candidate to a fit's model and fit again.

    Args:
        current: the fit without it.
        candidate: its key.
        values: of the candidate, (k,), at which it does nothing: the fit goes on from where the
            current one stands, so its first step is the screening's linear answer.
        noise_scales: of metres and radians, (2,).
        colour: of the residual without it.

    Raises:
        ValueError: when the start cannot be simulated.
    """
    model, free, state = _joined(current.model, current.free, current.state, candidate, values)
    state = replace(state, scales=noise_scales * np.sqrt(colour))
    return rescored(_fitted(model, current, state, free), noise_scales, colour)


def _joined(
    before: Model, estimated: np.ndarray, start: State, key: str, values: Array
) -> tuple[Model, np.ndarray, State]:
    """The model with a candidate, which unknowns are estimated, and a state to go on from.

    `values` are those of the candidate's whole effect; what the model has of it already stays.
    """
    model, free = before, estimated.copy()
    all_values, own_values = start.values, start.own_values
    name = effect_of(key)
    if name in model.effects:
        free[BASE:][model.place_of(name)] |= inside(model.robot, key)
    else:
        model = extended(model, (name,))
        free = np.concatenate([free, inside(model.robot, key)])
        all_values = np.concatenate([all_values, values])
        own_values = _with_new(own_values, len(model.own_values))
    state = State(start.inertia, all_values, start.starts, start.scales, own_values=own_values)
    return model, free, state


def displaced(
    current: Refit,
    keys: Sequence[str],
    centre: Array,
    covariance: Array,
    noise_scales: Array,
) -> Refit:
    """A fit with a geometry in it that is known as a Gaussian.

    Args:
        current: the fit without it.
        keys: of the geometry effects.
        centre: their values, key after key, (k,).
        covariance: of these, (k, k): that of a prior about them.
        noise_scales: of metres and radians, (2,).
    """
    found = current.fit
    scales = noise_scales * np.sqrt(colour_of(found, noise_scales))
    model, free, state = found.model, found.free, found.state
    for key in keys:
        nothing = [p.start for p in effect_named(effect_of(key)).parameters(model.robot)]
        model, free, state = _joined(model, free, state, key, np.array(nothing))
    values = state.values.copy()
    chosen = np.concatenate(
        [
            np.arange(len(values))[model.place_of(effect_of(key))][inside(model.robot, key)]
            for key in keys
        ]
    )
    values[chosen] = centre
    known = with_known(model, chosen, centre, covariance)
    start = replace(state, values=values, scales=scales)
    return polished(_fitted(known, found, start, free), noise_scales)


def polished(found: LikelihoodFit, noise_scales: Array) -> Refit:
    """A fit that goes on to convergence."""
    colour = colour_of(found, noise_scales)
    state = replace(found.state, scales=noise_scales * np.sqrt(colour))
    samples = tempered(found, noise_scales)
    exact = fit(found.model, samples, state, found.free, estimate_scales=False, grow=False)
    return rescored(exact, noise_scales, colour)


def without(found: LikelihoodFit, name: str, noise_scales: Array) -> Refit:
    """A fit without one of its effects, from where it stands, converged."""
    model, start = found.model, found.state
    place = np.arange(len(start.values))[model.place_of(name)]
    fewer = reduced(model, name)
    own = start.own_values
    if own is not None:
        own = own[:, ~np.isin(model.own_values, place)]
    values, free = np.delete(start.values, place), np.delete(found.free, BASE + place)
    state = State(start.inertia, values, start.starts, start.scales, own_values=own)
    exact = fit(fewer, found.samples, state, free, estimate_scales=False, grow=False)
    return rescored(exact, noise_scales, colour_of(exact, noise_scales))


def _fitted(model: Model, current: LikelihoodFit, state: State, free: np.ndarray) -> LikelihoodFit:
    """Converged to a ten-thousandth of the cost: enough to rank candidates."""
    return fit(
        model,
        current.samples,
        state,
        free,
        estimate_scales=False,
        grow=False,
        steps=RANKING_STEPS,
        tolerance=max(0.1, 1e-4 * current.cost),
        accuracy_m=RANKING_ACCURACY_M,
    )


def _with_new(own_values: Array | None, count: int) -> Array | None:
    """The runs' own values with zeros for those of the candidate."""
    if own_values is None:
        return None
    return np.pad(own_values, ((0, 0), (0, count - own_values.shape[1])))


def plausible(refitted: Refit, key: str) -> list[str]:
    """What is not plausible about a candidate's values: a sentence each."""
    name = effect_of(key)
    where = refitted.values_of(name)
    chosen = np.flatnonzero(inside(refitted.fit.model.robot, key))
    parameters = [refitted.fit.model.parameters[where][k] for k in chosen]
    stds = refitted.fit.std[BASE:][where][chosen]
    values = refitted.fit.values[where][chosen]
    complaints = []
    for parameter, value, std in zip(parameters, values, stds, strict=True):
        slack = min(3.0 * std, 0.1 * (parameter.high - parameter.low))
        if parameter.amplitude and not parameter.low - slack <= value <= parameter.high + slack:
            complaints.append(
                f"{parameter.name} = {value:.4g} lies outside its plausible range "
                f"{parameter.low:g} to {parameter.high:g}"
            )
    sizes = np.array([p.scale for p in parameters])
    shares = np.abs(values - [p.start for p in parameters]) / sizes
    if effect_named(name).stage == "kinematics" and shares.max(initial=0.0) < NEGLIGIBLE:
        complaints.append(
            f"all its values are below {NEGLIGIBLE:g} of a typical size ({sizes.max():g}): "
            "neither a declared geometry nor a calibration is known better"
        )
    return complaints
