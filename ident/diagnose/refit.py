"""A candidate added to the model and fitted in earnest, with its score on runs left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.effects import Parameter, effect_named
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.known_values import with_effects, with_known, without_effect
from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.leave_one_out import Evidence, Score, score
from freeswing.ident.diagnose.outstanding_runs import tempered
from freeswing.ident.diagnose.screen import NONE, screen
from freeswing.ident.diagnose.spectrum import residual_powers
from freeswing.ident.diagnose.variants import effect_of, inside
from freeswing.ident.likelihood.blocks import (
    each_run,
    effect_blocks,
    effect_values,
    with_effect_values,
)
from freeswing.ident.likelihood.calibration_modes import CONVERGED, freed_samples
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_swings import ONWARD, LikelihoodFit, Swings, correlation_factor
from freeswing.ident.likelihood.unknowns import Unknowns

RANKING_STEPS = 12
BY_LENGTHS = "the lengths along the runs"
# Surveys and calibrations are good to a few tenths of a millimetre: 0.3 mm for a displaced point.
NEGLIGIBLE = 0.1
RANKING_ACCURACY_M = 3e-7
# Of the colour that a fit leaves over the one by which it was weighed: beyond, its samples count
# too little beside lengths and frames, and its inertia makes up for what these cannot.
REWEIGHED = 2.0
# What is told of the last one is fitted again from there, with its own noise.
SEARCHED = replace(ONWARD, foresees=True)


@dataclass(frozen=True, slots=True)
class Refit:
    """A fit with a set of effects in the model.

    Attributes:
        fit: the fit.
        evidence: linear, at the fit, over inertia and effect values.
        score: of that evidence over what is estimated: its held-out costs count.
        slowly: why it has an effect's slow part alone, where that has another; empty elsewhere.
    """

    fit: LikelihoodFit
    evidence: Evidence
    score: Score
    slowly: str = ""

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


def rescored(
    current: LikelihoodFit, noise_scales: Array, colour: float, beside: np.ndarray = NONE
) -> Refit:
    """Score a fit that is there already, by the unknowns that it estimates.

    Args:
        current: the fit.
        noise_scales: of metres and radians, (2,).
        colour: of its residual.
        beside: shared unknowns that the evidence is by as well, held though they are, (h,).
    """
    linear = screen(current, (), noise_scales, colour=colour, beside=beside)
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
        ValueError: when the start cannot be simulated, or no step from there lowers the cost.
    """
    effect = effect_named(effect_of(candidate))
    names = [one.name for one in effect.parameters(current.model.robot)]
    starts = [values]
    for shape in effect.further_shapes():
        starts.append(np.array([shape.get(n, v) for n, v in zip(names, values, strict=True)]))
    fits: list[LikelihoodFit] = []
    for start in starts:
        with suppress(ValueError):  # another start may be followed
            fits.append(_refitted(current, candidate, start, noise_scales * np.sqrt(colour)))
        if fits and fits[-1].converged:
            break
    if not fits:
        raise ValueError(f"{candidate}: no start can be followed")
    found = min(fits, key=lambda one: one.cost)
    if _does_nothing(found, candidate):
        raise ValueError(f"{candidate}: no step from doing nothing lowers the cost")
    return rescored(found, noise_scales, colour)


def _refitted(current: LikelihoodFit, key: str, values: Array, scales: Array) -> LikelihoodFit:
    """A candidate fitted from where it does nothing, its samples counted by `scales`, (2,)."""
    runs = len(current.samples)
    model, unknowns = _joined(current.model, current.unknowns, key, values, runs)
    swings = replace(current.swings, scales=scales).under(model, unknowns, RANKING_ACCURACY_M)
    # What the current fit costs under these scales: its own may be the noise's, a thousandth.
    cost = current.cost * float(np.mean(np.square(current.scales / scales)))
    return ranked(swings, unknowns, cost)


def _does_nothing(found: LikelihoodFit, key: str) -> bool:
    """Whether a candidate stayed where it does nothing, whatever its linear evidence promises.

    Beside segments of 0.3 s, too long for a force at 37 Hz, that is of a slow force.
    """
    where = found.model.place_of(effect_of(key))
    mine = inside(found.model.robot, key) & [p.amplitude for p in found.model.parameters[where]]
    starts = np.array([p.start for p in found.model.parameters[where]])[mine]
    return all(bool((one.values[where][mine] == starts).all()) for one in found.motions)


def _joined(
    before: Model, unknowns: Unknowns, key: str, values: Array, runs: int
) -> tuple[Model, Unknowns]:
    """The model with a candidate, and its unknowns to go on from.

    `values` are those of the candidate's whole effect; what the model has of it already stays.
    """
    name, chosen = effect_of(key), inside(before.robot, key)
    if name in before.effects:
        return before, unknowns.estimating(name, chosen)
    model = _about(with_effects(before, (name,)), name, values)
    count = sum(p.per_run for p in model.parameters[model.place_of(name)])
    return model, unknowns.joined(
        *effect_blocks(model, name, values, chosen, np.zeros((runs, count)))
    )


def _about(model: Model, name: str, values: Array) -> Model:
    """The model with an effect's shape (a frequency) known about where it starts, as widely.

    An effect that does nothing yet says nothing of its shape: a step would take it to the middle
    of its plausible range, away from the line that the residual shows.
    """
    where, parameters = model.place_of(name), list(model.parameters)
    parameters[where] = [
        one if one.amplitude else replace(one, start=float(value))
        for one, value in zip(parameters[where], values, strict=True)
    ]
    return replace(model, parameters=tuple(parameters))


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
    model, unknowns = found.model, found.unknowns
    for key in keys:
        nothing = [p.start for p in effect_named(effect_of(key)).parameters(model.robot)]
        model, unknowns = _joined(model, unknowns, key, np.array(nothing), len(found.samples))
    values = effect_values(unknowns, model)
    chosen = np.concatenate(
        [
            np.arange(len(values))[model.place_of(effect_of(key))][inside(model.robot, key)]
            for key in keys
        ]
    )
    values[chosen] = centre
    known = with_known(model, chosen, centre, covariance, BY_LENGTHS)
    unknowns = with_effect_values(unknowns, known, values)
    swings = Swings(known, found.samples, scales)
    return polished(ranked(swings, unknowns, found.cost), noise_scales)


def exchanged(
    found: LikelihoodFit,
    key: str,
    places: Sequence[str],
    values: Mapping[str, Array],
    noise_scales: Array,
) -> Refit:
    """A fit with other places in it instead of one, from where it stands, converged.

    Args:
        found: the fit.
        key: of the place that leaves.
        places: keys of those that come.
        values: to begin with, of the whole effects of `places`, (k,) each.
        noise_scales: of metres and radians, (2,).

    Raises:
        ValueError: when that start cannot be followed.
    """
    model, unknowns = _freed_of(found, key)
    for place in places:
        begun = values[effect_of(place)]
        model, unknowns = _joined(model, unknowns, place, begun, len(found.samples))
    together = effect_values(unknowns, model)
    for place in places:
        together[model.place_of(effect_of(place))] = values[effect_of(place)]
    unknowns = with_effect_values(unknowns, model, together)
    swings = Swings(model, found.samples, found.scales)
    return polished(ranked(swings, unknowns, found.cost), noise_scales)


def _freed_of(found: LikelihoodFit, key: str) -> tuple[Model, Unknowns]:
    """A fit's model and unknowns without one place; parts of its kind that are not it stay."""
    name, model, unknowns = effect_of(key), found.model, found.unknowns
    block, mine = unknowns.block(name), inside(model.robot, key)
    if not (block.mask & ~mine).any():
        return _lacking(model, unknowns, name)
    start = np.array([p.start for p in model.parameters[model.place_of(name)]])
    value = np.where(mine, start, block.value)
    return model, unknowns.exchanged(replace(block, value=value, estimated=block.mask & ~mine))


def polished(found: LikelihoodFit, noise_scales: Array) -> Refit:
    """A fit that goes on to convergence, weighed by what it leaves, not by what it began with."""
    while True:
        colour = colour_of(found, noise_scales)
        samples, scales = tempered(found, noise_scales), noise_scales * np.sqrt(colour)
        exact = fit(replace(found.swings, samples=samples, scales=scales), found.unknowns, SEARCHED)
        if colour < REWEIGHED * colour_of(exact, noise_scales):
            return rescored(exact, noise_scales, colour)
        found = exact


def freed(one: Refit, noise_scales: Array) -> Refit:
    """A fit again, the errors that the poses of all runs share taken out as far as it asks.

    Args:
        one: the fit, scored: these errors are among the unknowns of its evidence.
        noise_scales: of metres and radians, (2,).
    """
    found, common = one.fit, one.evidence.common
    step = one.score.change[len(one.score.change) - common :]
    if np.abs(step).max(initial=0.0) < CONVERGED:
        return one
    samples = freed_samples(found.swings, step)
    scales = noise_scales * np.sqrt(colour_of(found, noise_scales))
    exact = fit(replace(found.swings, samples=samples, scales=scales), found.unknowns, SEARCHED)
    return rescored(exact, noise_scales, colour_of(exact, noise_scales))


def without(found: LikelihoodFit, name: str, noise_scales: Array) -> Refit:
    """A fit without one of its effects, from where it stands, converged."""
    fewer, unknowns = _lacking(found.model, found.unknowns, name)
    exact = fit(Swings(fewer, found.samples, found.scales), unknowns, SEARCHED)
    return rescored(exact, noise_scales, colour_of(exact, noise_scales))


def _lacking(model: Model, unknowns: Unknowns, name: str) -> tuple[Model, Unknowns]:
    """A model and its unknowns without an effect and what moves fully by it."""
    for one in (effect_named(name).fully, name):
        if one in model.effects:
            mine = (one, each_run(one)) if each_run(one) in unknowns else (one,)
            model, unknowns = without_effect(model, one), unknowns.without(*mine)
    return model, unknowns


def ranked(swings: Swings, unknowns: Unknowns, cost: float) -> LikelihoodFit:
    """Converged to a ten-thousandth of the cost before: enough to rank candidates.

    Args:
        swings: the runs.
        unknowns: where to start.
        cost: that of the fit before.
    """
    how = replace(
        SEARCHED,
        steps=RANKING_STEPS,
        tolerance=max(0.1, 1e-4 * cost),
        accuracy_m=RANKING_ACCURACY_M,
    )
    return fit(swings, unknowns, how)


def plausible(refitted: Refit, key: str) -> list[str]:
    """What is not plausible about a candidate's values: a sentence each."""
    complaints = impossible_values(refitted, key)
    parameters, values, _ = _estimated(refitted, key)
    sizes = np.array([p.scale for p in parameters])
    shares = np.abs(values - [p.start for p in parameters]) / sizes
    geometry = effect_named(effect_of(key)).stage == "kinematics"
    if geometry and shares.max(initial=0.0) < NEGLIGIBLE:
        complaints.append(
            f"all its values are below {NEGLIGIBLE:g} of a typical size ({sizes.max():g}): "
            "neither a declared geometry nor a calibration is known better"
        )
    return complaints


def impossible_values(refitted: Refit, key: str) -> list[str]:
    """Which of a candidate's values no such effect can have: a sentence each."""
    complaints = []
    parameters, values, stds = _estimated(refitted, key)
    for parameter, value, std in zip(parameters, values, stds, strict=True):
        slack = min(3.0 * std, 0.1 * (parameter.high - parameter.low))
        if parameter.amplitude and not parameter.low - slack <= value <= parameter.high + slack:
            complaints.append(
                f"{parameter.name} = {value:.4g} lies outside its plausible range "
                f"{parameter.low:g} to {parameter.high:g}"
            )
    amounts = [(p, v) for p, v in zip(parameters, values, strict=True) if p.amplitude]
    if amounts and all(p.low == p.start and value < p.low for p, value in amounts):
        told = ", ".join(f"{p.name} = {value:.4g}" for p, value in amounts)
        complaints.append(f"{told}: below {amounts[0][0].low:g}, which no such effect can have")
    return complaints


def _estimated(refitted: Refit, key: str) -> tuple[list[Parameter], Array, Array]:
    """A candidate's parameters, (k,), their values and standard deviations."""
    name = effect_of(key)
    where = refitted.values_of(name)
    chosen = np.flatnonzero(inside(refitted.fit.model.robot, key))
    parameters = [refitted.fit.model.parameters[where][k] for k in chosen]
    values, stds = refitted.fit.values[where], refitted.fit.std(name)
    return parameters, values[chosen], stds[chosen]
