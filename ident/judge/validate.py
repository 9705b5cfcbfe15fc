"""Cross-validation on runs that were never fitted (FIDIM 2022, eq. 50), and prediction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.regressor import regressor
from freeswing.cdpr.robot import POSE_COORDINATES, Array
from freeswing.ident.judge.prediction import Prediction, predict
from freeswing.ident.signals.usable_runs import PreparedRun


@dataclass(frozen=True, slots=True)
class ValidatedRun:
    """How one run agrees with an estimate.

    Attributes:
        run: its name.
        sigma_perp: standard deviation of the internal dynamics' error (eq. 50), m/s^2.
        prediction_rmse_m: root mean square, a coordinate, of measured minus predicted position
            over the whole run, its initial state and lengths fitted; None where that fails.
        noise_floor_m: what the samples' own noise would leave.
        note: what a reader should know, or empty.
        prediction: the predicted samples, where they were asked for.
    """

    run: str
    sigma_perp: float
    prediction_rmse_m: float | None
    noise_floor_m: float | None
    note: str = ""
    prediction: Prediction | None = None

    def document(self) -> dict[str, object]:
        """The entry of `validation` in results/identification.json."""
        entry: dict[str, object] = {
            "run": self.run,
            "sigma_perp": self.sigma_perp,
            "prediction_rmse_m": self.prediction_rmse_m,
            "noise_floor_m": self.noise_floor_m,
        }
        return {**entry, "note": self.note} if self.note else entry


def sigma_perp(regressors: Array, inertia: Array) -> float:
    """sqrt(eps^T eps / n) of eps = W chi over the n samples of a run (eq. 50).

    Args:
        regressors: (n, 6 - n_cables, 10).
        inertia: the nine parameters, (9,).
    """
    error = regressors @ np.concatenate([[1.0], inertia])
    return float(np.sqrt(np.sum(error**2) / len(error)))


def validate_run(
    model: Model, run: PreparedRun, inertia: Array, full: bool, simulated: bool = True
) -> ValidatedRun:
    """Confront one run with an estimate.

    Args:
        model: the robot.
        run: prepared, with the motion that `full` asks for.
        inertia: the nine parameters, (9,).
        full: by full poses, or by free coordinates alone.
        simulated: whether its motion is predicted too.

    Raises:
        ValueError: when the run lacks that motion.
    """
    motion = run.full if full else run.free
    if motion is None:
        raise ValueError(f"run {run.name}: {run.why_not_free or 'full poses were not measured'}")
    # Near a singularity of the free coordinates the projected equations blow up: say so.
    prediction, note = None, run.why_not_free if full else ""
    try:
        if simulated:
            prediction = predict(model, run, None if full else motion.free, inertia)
    except (ValueError, np.linalg.LinAlgError) as error:
        note = f"not predicted: {error}"
    return ValidatedRun(
        run.name,
        sigma_perp(regressor(model, motion), inertia),
        None if prediction is None else prediction.rmse_m,
        _noise_floor(run, motion.free, full),
        note,
        prediction,
    )


def _noise_floor(run: PreparedRun, free: tuple[str, ...], full: bool) -> float | None:
    names = POSE_COORDINATES if full else free
    places = [run.signals.coordinates.index(name) for name in names if name in POSE_COORDINATES[:3]]
    if not places:
        return None
    return float(np.sqrt(np.mean(run.signals.noise_std[places] ** 2)))
