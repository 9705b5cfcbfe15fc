"""Before and after on the validation runs: how well a model predicts runs it never saw."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.model.free_motion import free_basis
from freeswing.cdpr.model.regressor import SwingMotion
from freeswing.cdpr.robot import POSE_COORDINATES, Array
from freeswing.ident.diagnose.answer.averages import median, rms
from freeswing.ident.judge.prediction import Prediction, Stage, predict_in_turn
from freeswing.ident.likelihood.calibration_modes import freed
from freeswing.ident.signals.derivatives import SignalSettings
from freeswing.ident.signals.usable_runs import PreparedRun, prepare_runs


@dataclass(frozen=True, slots=True)
class HeldOutRun:
    """One validation run under one model.

    Attributes:
        run: its name.
        sigma_perp: standard deviation of the internal dynamics' error (FIDIM 2022, eq. 50).
        prediction: of the whole run, its start state and lengths fitted; None where that fails.
        noise_floor_m: what the samples' own noise leaves.
        offset: of the measured frame in this run, beside the prediction's error: shift in m and
            turn in rad; None where poses do not say how far they err together.
    """

    run: str
    sigma_perp: float
    prediction: Prediction | None
    noise_floor_m: float
    offset: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class HeldOut:
    """All validation runs under one model."""

    runs: tuple[HeldOutRun, ...]

    @property
    def errors_m(self) -> list[float]:
        """Prediction errors of the runs whose positions could be predicted."""
        return [
            run.prediction.rmse_m
            for run in self.runs
            if run.prediction is not None and run.prediction.rmse_m is not None
        ]

    @property
    def noise_floor_m(self) -> float | None:
        """What the samples' own noise leaves, over all runs."""
        return rms([run.noise_floor_m for run in self.runs])

    def document(self) -> dict[str, object]:
        """Root mean squares and medians over the runs."""
        errors = self.errors_m
        turns = [
            run.prediction.rmse_rad
            for run in self.runs
            if run.prediction is not None and run.prediction.rmse_rad is not None
        ]
        sigmas = [run.sigma_perp for run in self.runs]
        return {
            "sigma_perp": rms(sigmas),
            "prediction_rmse_m": rms(errors),
            "noise_floor_m": self.noise_floor_m,
            "prediction_rmse_rad": rms(turns),
            "sigma_perp_median": median(sigmas),
            "prediction_median_m": median(errors),
            **self._offsets(),
            "runs": [
                {
                    "run": run.run,
                    "sigma_perp": run.sigma_perp,
                    "prediction_rmse_m": None if run.prediction is None else run.prediction.rmse_m,
                    "prediction_rmse_rad": (
                        None if run.prediction is None else run.prediction.rmse_rad
                    ),
                    "noise_floor_m": run.noise_floor_m,
                }
                for run in self.runs
            ],
        }

    def _offsets(self) -> dict[str, float | None]:
        """Constant offsets of the runs' frames, apart from the swing's own error."""
        known = [run.offset for run in self.runs if run.offset is not None]
        if not known:
            return {}
        shifts, turns = zip(*known, strict=True)
        return {"frame_shift_m": rms(list(shifts)), "frame_turn_rad": rms(list(turns))}


def held_out(
    stages: Sequence[Stage],
    runs: list[PreparedRun],
    free: tuple[str, ...] | None,
    pool: Executor | None = None,
) -> Callable[[], tuple[HeldOut, ...]]:
    """Confront validation runs with models that grew out of each other: one result a model.

    It is begun at once, and waited for where what comes back is called.

    Args:
        stages: the models.
        runs: validation runs.
        free: the coordinates measured, or None for full poses.
        pool: takes runs side by side; None: one after another, when they are asked for.
    """
    calls = [
        pool.submit(_one, stages, run, free).result
        if pool is not None
        else partial(_one, stages, run, free)
        for run in runs
    ]
    return lambda: tuple(HeldOut(under) for under in zip(*(call() for call in calls), strict=True))


def _one(
    stages: Sequence[Stage], run: PreparedRun, free: tuple[str, ...] | None
) -> tuple[HeldOutRun, ...]:
    """One run under each of the models."""
    seen = [_as_seen(stage, run) for stage in stages]
    predictions = predict_in_turn(stages, seen, free)
    return tuple(
        _confronted(stage, prediction, one, free)
        for stage, prediction, one in zip(stages, predictions, seen, strict=True)
    )


def _as_seen(stage: Stage, run: PreparedRun) -> PreparedRun:
    """The run without the errors that all runs share, as far as a model's fit has found them.

    As recorded where its full poses were not measured.
    """
    if stage.freed is None:
        return run
    swing, robot = freed(run.run, stage.freed), stage.model.robot
    if swing is run.run:
        return run
    names = None if run.free_signals is None else run.free_signals.coordinates
    told = replace(robot, free_coordinates=robot.free_coordinates if names is None else names)
    again = prepare_runs([swing], build_model(told), SignalSettings())
    return next(iter(again.runs), run)


def _confronted(
    stage: Stage, prediction: Prediction | None, run: PreparedRun, free: tuple[str, ...] | None
) -> HeldOutRun:
    values = stage.values if prediction is None else prediction.values
    values = stage.model.start_values if values is None else values
    motion = run.full if free is None else run.free
    sigma = np.nan
    if motion is not None:
        sigma = internal_error(stage.model, motion, stage.inertia, values)
    names = POSE_COORDINATES[:3] if free is None else free
    places = [run.signals.coordinates.index(n) for n in names if n in POSE_COORDINATES[:3]]
    floor = float(np.sqrt(np.mean(run.signals.noise_std[places] ** 2)))
    return HeldOutRun(run.name, sigma, prediction, floor, _offset(stage.model, prediction))


def _offset(model: Model, prediction: Prediction | None) -> tuple[float, float] | None:
    """Root mean squares over the axes of what nuisances of the measurement were fitted to."""
    effects = [effect_named(name) for name in model.effects]
    nuisances = [one.name for one in effects if one.nuisance and one.stage == "measurement"]
    if prediction is None or not nuisances:
        return None
    places = [k for n in nuisances for k in range(len(model.names))[model.place_of(n)]]
    by_unit = {
        unit: [prediction.values[k] for k in places if model.names[k].endswith(unit)]
        for unit in ("_m", "_rad")
    }
    return rms(by_unit["_m"]) or 0.0, rms(by_unit["_rad"]) or 0.0


def internal_error(model: Model, motion: SwingMotion, inertia: Array, values: Array) -> float:
    """sigma-perp (eq. 50) of a model with effects: Xi-perp^T M (measured - modelled acceleration).

    Without effects it is the paper's: cable forces do no work on the free directions.
    """
    error = internal_residual(model, motion, inertia, values)
    return float(np.sqrt(np.sum(error**2) / len(error)))


def internal_residual(model: Model, motion: SwingMotion, inertia: Array, values: Array) -> Array:
    """Force per mass that the model lacks along each free coordinate, (n, 6 - n_cables).

    Source:
        FIDIM 2022, eqs. (10), (35): what they leave.
    """
    arguments = (motion.times_s, motion.zetas, motion.rates, inertia, values)
    modelled = evaluate(model.acceleration, *arguments)[0]
    mass = evaluate(model.mass_matrix, motion.zetas, inertia, values)[0]
    basis = free_basis(model, motion.free, motion.zetas, motion.rates, values).zeta_map
    missing = mass @ (motion.accelerations - modelled)[..., None]
    return (np.swapaxes(basis, -1, -2) @ missing)[..., 0]
