"""The motion that an estimate predicts for a run: simulated, its initial state fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import POSE_COORDINATES, Array, frozen_array
from freeswing.cdpr.rotation import pose_differences
from freeswing.ident.likelihood.blocks import STARTS, each_run, first_unknowns, split_own
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_swings import (
    CONVERGED_DECREASE,
    ONWARD,
    FreeSwing,
    LikelihoodFit,
    Swings,
)
from freeswing.ident.likelihood.run_residuals import Samples, predicted, residuals
from freeswing.ident.likelihood.session_estimates import sampled, started
from freeswing.ident.likelihood.unknowns import Unknowns
from freeswing.ident.signals.band import independent_numbers
from freeswing.ident.signals.usable_runs import PreparedRun

# Ten samples a period at the 5 Hz where swings of a platform end (`band.LOWEST_PASS_HZ`).
PREDICTED_HZ = 50.0
# A fit that only weighs the next one is not followed further: errors differ by 0.3 %.
_WEIGHED_DECREASE = 0.5
_AS_GOOD = 1.1  # times the error under a model before: no reason for another, careful start
_ASTRAY = 0.05  # residual over motion beyond which a fit deserves a second, careful start


@dataclass(frozen=True, slots=True)
class Prediction:
    """A run's samples beside the predicted motion.

    Attributes:
        run: its name.
        times_s: of the samples used, (n,).
        coordinates: names of the measured coordinates.
        measured: samples, (n, n_c).
        predicted: (n, n_c).
        values: effect values of the motion, those that the run has for itself included, (k,).
    """

    run: str
    times_s: Array
    coordinates: tuple[str, ...]
    measured: Array
    predicted: Array
    values: Array

    @property
    def rmse_m(self) -> float | None:
        """Root mean square of the position residuals, a coordinate; None without positions."""
        return self._rmse(POSE_COORDINATES[:3])

    @property
    def rmse_rad(self) -> float | None:
        """Root mean square of the orientation's residuals, an axis; None without angles."""
        return self._rmse(POSE_COORDINATES[3:])

    def _rmse(self, names: tuple[str, ...]) -> float | None:
        places = [i for i, name in enumerate(self.coordinates) if name in names]
        if not places:
            return None
        if self.coordinates == POSE_COORDINATES:
            residuals = pose_differences(self.measured, self.predicted)[:, places]
        else:
            residuals = (self.measured - self.predicted)[:, places]
        return float(np.sqrt(np.mean(residuals**2)))


def predict(
    model: Model,
    run: PreparedRun,
    free: tuple[str, ...] | None,
    inertia: Array,
    values: Array | None = None,
) -> Prediction:
    """Predict a run with its initial state and cable lengths fitted and the inertia held.

    Args:
        model: the robot.
        run: the run.
        free: the coordinates to use of it, or None for full poses.
        inertia: the nine parameters, (9,).
        values: effect values, (k,); None for those that leave the declared model as it is.

    Raises:
        ValueError: when the motion cannot be simulated.
    """
    return _told(_fitted_to(Stage(model, inertia, values), run, free))


@dataclass(frozen=True, slots=True)
class Stage:
    """A model with its numbers, to be held against runs.

    Attributes:
        model: the robot with its effects.
        inertia: the nine parameters, (9,).
        values: effect values, (k,); None for those that leave the declared model as it is.
        freed: amplitudes of the errors that all runs share, taken out of their poses, (r,); None:
            the poses are as recorded.
    """

    model: Model
    inertia: Array
    values: Array | None
    freed: Array | None = None


def predict_in_turn(
    stages: Sequence[Stage], runs: Sequence[PreparedRun], free: tuple[str, ...] | None
) -> tuple[Prediction | None, ...]:
    """Predictions of a run by models that grew out of each other, as `predict` makes them.

    Each begins where the one before it ended, which is nearer than any guess; None where one
    cannot be simulated.

    Args:
        stages: the models.
        runs: the run as each of them sees it.
        free: the coordinates to use of it, or None for full poses.
    """
    found: list[Prediction | None] = []
    before = None
    for stage, run in zip(stages, runs, strict=True):
        try:
            before = _fitted_to(stage, run, free, before)
        except (ValueError, np.linalg.LinAlgError):
            before = None
        found.append(None if before is None else _told(before))
    return tuple(found)


def _fitted_to(
    stage: Stage,
    run: PreparedRun,
    free: tuple[str, ...] | None,
    before: LikelihoodFit | None = None,
) -> LikelihoodFit:
    """A run's own unknowns under a model, from where they were under another or from a guess.

    Of a platform on springs from both: where a rigid one was off by millimetres it stayed.
    """
    near = None if before is None else _carried_on(stage, run, free, before)
    if near is not None and not any(effect_named(name).springs for name in stage.model.effects):
        return _weighed(near)
    try:
        samples, first = started(stage.model, run, free, stage.inertia)
        swings = Swings(stage.model, (_thinned(samples),), np.ones(2))
        guessed = _followed(swings, _held(stage, swings, first[None]))
    except (ValueError, np.linalg.LinAlgError):
        if near is None:
            raise
        return _weighed(near)
    return _weighed(min(filter(None, (near, guessed)), key=lambda one: one.deviance))


def _carried_on(
    stage: Stage, run: PreparedRun, free: tuple[str, ...] | None, before: LikelihoodFit
) -> LikelihoodFit | None:
    """The fit from where another model ended; None where that turns out not to be near."""
    swings = Swings(stage.model, (_thinned(sampled(run, free)),), np.ones(2))
    unknowns = _carried(_held(stage, swings, before.value(STARTS)), stage.model, before)
    return _near(swings, unknowns, _AS_GOOD * _error(before))


def _held(stage: Stage, swings: Swings, starts: Array) -> Unknowns:
    """Unknowns of a run of which only its own are looked for."""
    payloads = [run.payload for run in swings.samples]
    unknowns = first_unknowns(stage.model, stage.inertia, starts, payloads, stage.values)
    return unknowns.all_held()


def _carried(unknowns: Unknowns, model: Model, before: LikelihoodFit) -> Unknowns:
    """The same with what the run had for itself before, by name."""
    known = dict(zip(before.model.names, before.motions[0].values, strict=True))
    own = {}
    for name, values in split_own(model, model.own_values[None]).items():
        told = unknowns.value(each_run(name))[0]
        pairs = zip(values[0], told, strict=True)
        own[each_run(name)] = np.array([[known.get(model.names[k], was) for k, was in pairs]])
    return unknowns.moved(own)


def _near(swings: Swings, unknowns: Unknowns, error: float) -> LikelihoodFit | None:
    """The fit from a start that is near already; None where it turns out not to be.

    Args:
        swings: the run.
        unknowns: where to start.
        error: that of the fit that the start is from, or a little more: what is no worse is no
            more astray than that was.
    """
    try:
        found = _fitted(swings, unknowns, grow=False)
    except (ValueError, np.linalg.LinAlgError):
        return None
    good = not _is_astray(found) or _error(found) <= error
    return found if found.stop.converged and good else None


def _told(found: LikelihoodFit) -> Prediction:
    samples, seen = found.samples[0], _seen(found)
    return Prediction(
        samples.name,
        frozen_array(samples.times_s, samples.times_s.shape, "times"),
        samples.coordinates,
        frozen_array(samples.values, samples.values.shape, "measured"),
        frozen_array(seen, seen.shape, "predicted"),
        found.motions[0].values,
    )


def fitted_motions(found: LikelihoodFit) -> tuple[Prediction, ...]:
    """The runs of a fit beside the motions that it found for them, thinned to `PREDICTED_HZ`."""
    told = []
    for motion, samples in zip(found.motions, found.samples, strict=True):
        thinned = _thinned(samples)
        seen = predicted(motion, thinned.times_s)[:, samples.columns]
        parts = thinned.times_s, samples.coordinates, thinned.values, seen, motion.values
        told.append(Prediction(samples.name, *parts))
    return tuple(told)


def _followed(swings: Swings, unknowns: Unknowns) -> LikelihoodFit:
    """The fit of the start over the whole run at once, or grown into it where that is astray.

    A start too far off leaves the simulated swing out of phase, lets no step lower the cost, or
    cannot be simulated so long.
    """
    try:
        quick = _fitted(swings, unknowns, grow=False)
    except (ValueError, np.linalg.LinAlgError):
        return _fitted(swings, unknowns, grow=True)
    if quick.stop.converged and not _is_astray(quick):
        return quick
    careful = _fitted(swings, unknowns, grow=True)
    return min(quick, careful, key=lambda one: one.deviance)


def _is_astray(found: LikelihoodFit) -> bool:
    """Whether the residuals are not small beside the motion."""
    values = found.samples[0].values
    spread = np.sqrt(np.mean((values - values.mean(axis=0)) ** 2))
    return bool(_error(found) > _ASTRAY * spread)


def _error(found: LikelihoodFit) -> float:
    """Root mean square of what a fit leaves, all coordinates together."""
    return float(np.sqrt(np.mean((_seen(found) - found.samples[0].values) ** 2)))


def _weighed(found: LikelihoodFit) -> LikelihoodFit:
    """The fit again where a run has unknowns of its own beside its start, weighed honestly.

    What a model misses follows the swing: of thousands of samples a few dozen are independent, and
    counted one by one they turn a platform's frame by many times what markers can be off.
    """
    if not _is_weighed(found.model):
        return found
    (samples,), (motion,) = found.samples, found.motions
    white = residuals(motion, samples, found.scales)
    coloured = max(1.0, white.size / independent_numbers(white))
    swings = replace(found.swings, scales=found.scales * np.sqrt(coloured))
    return fit(swings, found.unknowns, ONWARD)


def _is_weighed(model: Model) -> bool:
    """Whether a run has unknowns of its own beside its start."""
    return bool(len(model.own_values))


def _fitted(swings: Swings, unknowns: Unknowns, grow: bool) -> LikelihoodFit:
    tolerance = _WEIGHED_DECREASE if _is_weighed(swings.model) else CONVERGED_DECREASE
    return fit(swings, unknowns, FreeSwing(tolerance=tolerance, grow=grow))


def _seen(found: LikelihoodFit) -> Array:
    samples = found.samples[0]
    return predicted(found.motions[0], samples.times_s)[:, samples.columns]


def _thinned(samples: Samples) -> Samples:
    """Every k-th sample, down to `PREDICTED_HZ`: initial states need no more."""
    period = float(np.median(np.diff(samples.times_s)))
    every = max(1, round(1.0 / (PREDICTED_HZ * period)))
    times = samples.times_s[::every]
    return replace(
        samples,
        times_s=times,
        values=samples.values[::every],
        whitener=samples.whitener[::every],
        span_s=(float(times[0]), float(times[-1])),
    )
