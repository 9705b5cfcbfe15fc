"""A candidate added to the model and fitted in earnest, with its score on runs left out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cdpr.effects import effect_named
from cdpr.model import Model, build_model
from cdpr.robot import Array
from ident.diagnose.rows import Evidence, Score, score
from ident.diagnose.screen import BASE, screen
from ident.joint import State
from ident.likelihood import LikelihoodFit, correlation_factor, fit
from ident.likelihood_run import residuals

RANKING_STEPS = 12
# Surveys and calibrations are good to a few tenths of a millimetre: 0.3 mm for a displaced point.
NEGLIGIBLE = 0.1
RANKING_ACCURACY_M = 3e-7


@dataclass(frozen=True, slots=True)
class Refit:
    """A fit with a set of effects in the model.

    Attributes:
        effects: in the model, the candidate last.
        fit: the fit.
        evidence: linear, at the fit, over inertia and effect values.
        score: of that evidence: its held-out costs count.
    """

    effects: tuple[str, ...]
    fit: LikelihoodFit
    evidence: Evidence
    score: Score

    @property
    def held_out(self) -> float:
        """Sum of squares over the runs, each predicted with shared unknowns from the others."""
        return float(self.score.held_out.sum())

    def values_of(self, name: str) -> slice:
        """Where an effect's values stand among the fit's."""
        used = 0
        for other in self.effects:
            count = len(effect_named(other).parameters(self.fit.model.robot))
            if other == name:
                return slice(used, used + count)
            used += count
        raise ValueError(f"{name} is not among {self.effects}")


def colour_of(fit: LikelihoodFit, noise_scales: Array) -> float:
    """How much stronger than the noise the residual is in the band of the motion, >= 1."""
    squares = np.mean(
        [
            np.mean(residuals(motion, run, noise_scales) ** 2)
            for motion, run in zip(fit.motions, fit.samples, strict=True)
        ]
    )
    return max(1.0, float(squares) * correlation_factor(fit.motions, fit.samples, noise_scales))


def rescored(current: LikelihoodFit, noise_scales: Array, colour: float) -> Refit:
    """Score a fit that is there already."""
    linear = screen(current, (), noise_scales, colour=colour)
    return Refit(current.model.effects, current, linear.evidence, score(linear.evidence))


def refit(
    current: LikelihoodFit, candidate: str, values: Array, noise_scales: Array, colour: float
) -> Refit:
    """Add a candidate to a fit's model and fit again.

    Args:
        current: the fit without it.
        candidate: its name.
        values: of the candidate, (k,), at which it does nothing: the fit goes on from where the
            current one stands, so its first step is the screening's linear answer.
        noise_scales: of metres and radians, (2,).
        colour: of the residual without it.

    Raises:
        ValueError: when the start cannot be simulated.
    """
    model = build_model(current.model.robot, (*current.model.effects, candidate))
    start = current.state
    state = State(
        start.inertia,
        np.concatenate([start.values, values]),
        start.starts,
        noise_scales * np.sqrt(colour),
        own_values=_with_new(start.own_values, len(model.own_values)),
    )
    return rescored(_fitted(model, current, state), noise_scales, colour)


def polished(found: LikelihoodFit, noise_scales: Array) -> Refit:
    """A fit that goes on to convergence."""
    colour = colour_of(found, noise_scales)
    state = replace(found.state, scales=noise_scales * np.sqrt(colour))
    exact = fit(found.model, found.samples, state, estimate_scales=False, grow=False)
    return rescored(exact, noise_scales, colour)


def without(found: LikelihoodFit, name: str, noise_scales: Array) -> Refit:
    """A fit without one of its effects, from where it stands, converged."""
    model = found.model
    place = [k for k, other in enumerate(model.names) if other.split(".")[0] == name]
    fewer = build_model(model.robot, tuple(other for other in model.effects if other != name))
    start = found.state
    own = start.own_values
    if own is not None:
        own = own[:, ~np.isin(model.own_values, place)]
    values = np.delete(start.values, place)
    state = State(start.inertia, values, start.starts, start.scales, own_values=own)
    exact = fit(fewer, found.samples, state, estimate_scales=False, grow=False)
    return rescored(exact, noise_scales, colour_of(exact, noise_scales))


def _fitted(model: Model, current: LikelihoodFit, state: State) -> LikelihoodFit:
    """Converged to a ten-thousandth of the cost: enough to rank candidates."""
    return fit(
        model,
        current.samples,
        state,
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


def plausible(refitted: Refit, name: str) -> list[str]:
    """What is not plausible about an effect's values: a sentence each."""
    where = refitted.values_of(name)
    parameters = refitted.fit.model.parameters[where]
    stds = refitted.fit.std[BASE:][where]
    complaints = []
    for parameter, value, std in zip(parameters, refitted.fit.values[where], stds, strict=True):
        slack = min(3.0 * std, 0.1 * (parameter.high - parameter.low))
        if parameter.amplitude and not parameter.low - slack <= value <= parameter.high + slack:
            complaints.append(
                f"{parameter.name} = {value:.4g} lies outside its plausible range "
                f"{parameter.low:g} to {parameter.high:g}"
            )
    sizes = np.array([p.scale for p in parameters])
    shares = np.abs(refitted.fit.values[where] - [p.start for p in parameters]) / sizes
    if effect_named(name).stage == "kinematics" and shares.max(initial=0.0) < NEGLIGIBLE:
        complaints.append(
            f"all its values are below {NEGLIGIBLE:g} of a typical size ({sizes.max():g}): "
            "neither a declared geometry nor a calibration is known better"
        )
    return complaints
