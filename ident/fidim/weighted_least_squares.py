"""Covariance-weighted total least squares: where the regressor's noise is far from even.

Plain total least squares is right when every entry of W has the same independent noise. It never
has: columns differ in unit, and W's entries share the same few measured signals. Here each
sample's equation is weighted by the covariance that the signals' noise gives it, and the expected
product of the regressor's own noise is taken off (renormalisation, Kanatani 1996), which removes
the bias that it would cause.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.frozen import freeze
from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.free_motion import coordinate_indices, free_basis
from freeswing.cdpr.model.regressor import SwingMotion, regressor
from freeswing.cdpr.robot import Array, frozen_array
from freeswing.ident.fidim.scatter import CORRELATED_S
from freeswing.ident.fidim.shares import Weighing
from freeswing.ident.fidim.total_least_squares import least_by_noise
from freeswing.ident.signals.derivatives import Signals
from freeswing.ident.signals.motions import free_motion

_SWEEPS = 12


@dataclass(frozen=True, slots=True)
class NoisyRegressor:
    """A run's regressor with its first-order answer to the signals.

    Attributes:
        W: (n, e, 10) with e = 6 - n_cables equations a sample.
        answers: dW / d(values, velocities, accelerations), (n, 3 n_c, e, 10).
        covariances: of those signals, (n, 3 n_c, 3 n_c).
        period_s: between samples.
    """

    W: Array
    answers: Array
    covariances: Array
    period_s: float

    def __post_init__(self) -> None:
        freeze(self, "W", "answers", "covariances")


@dataclass(frozen=True, slots=True)
class WeightedSolution:
    """What the weighted problem gives.

    Attributes:
        values: the nine parameters, (9,).
        covariance: allowing for serial correlation of the equations' errors, (9, 9).
        noise_ratio: root of the errors' variance over that which the signals' noise explains:
            far above 1, the model is wrong, not the samples.
    """

    values: Array
    covariance: Array
    noise_ratio: float


def noisy_regressor(model: Model, signals: Signals, motion: SwingMotion) -> NoisyRegressor:
    """Differentiate a run's regressor by its signals (central differences at their own noise).

    Args:
        model: the robot.
        signals: of the full pose, or of the free coordinates that `motion` was made from.
        motion: the motion the regressor is taken along.
    """
    steps = np.sqrt(np.median(signals.covariances.diagonal(axis1=1, axis2=2), axis=0))
    steps = np.maximum(steps, 1e-9)
    answers = [
        (_moved(model, signals, motion, j, step) - _moved(model, signals, motion, j, -step))
        / (2.0 * step)
        for j, step in enumerate(steps)
    ]
    return NoisyRegressor(
        W=regressor(model, motion),
        answers=np.stack(answers, axis=1),
        covariances=signals.covariances,
        period_s=float(np.median(np.diff(signals.times_s))),
    )


def _moved(model: Model, signals: Signals, motion: SwingMotion, j: int, step: float) -> Array:
    """The regressor with signal j (value, velocity or acceleration of a coordinate) moved."""
    order, column = divmod(j, len(signals.coordinates))
    change = np.zeros(len(signals.coordinates))
    change[column] = step
    field = ("values", "velocities", "accelerations")[order]
    moved = replace(signals, **{field: getattr(signals, field) + change})
    if len(signals.coordinates) == 6:
        names = ("zetas", "rates", "accelerations")
        return regressor(model, replace(motion, **{names[order]: getattr(moved, field)}))
    zetas = motion.zetas
    if order == 0:
        basis = free_basis(model, motion.free, zetas, 0.0 * zetas, model.start_values)
        zetas = _held(model, zetas + basis.zeta_map @ change, motion)
    return regressor(model, free_motion(model, moved, motion.lengths_m, zetas, exact=False))


def _held(model: Model, zetas: Array, motion: SwingMotion) -> Array:
    """Poses moved along the free directions, put back on the cable lengths by one Newton step."""
    evaluated = evaluate(model.cables, zetas, model.start_values)
    chosen = coordinate_indices(motion.free)
    dependent = [i for i in range(6) if i not in chosen]
    corrected = zetas.copy()
    gap = evaluated[0] - motion.lengths_m
    block = evaluated[3][:, :, dependent]
    corrected[:, dependent] -= np.linalg.solve(block, gap[..., None])[..., 0]
    return corrected


def weighted_fidim(runs: list[NoisyRegressor], start: Array) -> WeightedSolution:
    """Solve W chi = 0 with every equation weighted by its own covariance.

    Args:
        runs: noisy regressors.
        start: the nine parameters to start from, (9,).

    Raises:
        ValueError: when the weighted problem loses rank.
    """
    chi = np.concatenate([[1.0], start])
    size = 1.0
    for _ in range(_SWEEPS):
        signal, noise = _sums(runs, chi)
        values, size = least_by_noise(np.linalg.cholesky(signal).T, noise)
        before, chi = chi, np.append(1.0, values)
        if np.abs(chi - before).max() < 1e-10 * np.abs(chi).max():
            break
    signal, noise = _sums(runs, chi)
    normal = (signal - size * noise)[1:, 1:]
    inverse = np.linalg.inv(normal)
    covariance = inverse @ _score_spread(runs, chi, size * noise) @ inverse
    return WeightedSolution(
        values=frozen_array(chi[1:], (9,), "values"),
        covariance=frozen_array(0.5 * (covariance + covariance.T), (9, 9), "covariance"),
        noise_ratio=float(np.sqrt(size)),
    )


def weighing(runs: list[NoisyRegressor], values: Array) -> Weighing:
    """How a solution's equations count, for others of the same runs.

    Args:
        runs: noisy regressors.
        values: the nine parameters that the weights belong to, (9,).
    """
    chi = np.append(1.0, values)
    roots = (np.swapaxes(np.linalg.cholesky(_weights(run, chi)), 1, 2) for run in runs)
    return Weighing(tuple(roots), _sums(runs, chi)[1])


def _weights(run: NoisyRegressor, chi: Array) -> Array:
    """Inverse covariance of each sample's equation errors, (n, e, e)."""
    answer = run.answers @ chi
    spread = np.einsum("nje,njk,nkf->nef", answer, run.covariances, answer, optimize=True)
    return np.linalg.inv(spread)


def _sums(runs: list[NoisyRegressor], chi: Array) -> tuple[Array, Array]:
    """Weighted W^T W and its expectation for the regressor's noise alone, (10, 10) each."""
    signal, noise = np.zeros((10, 10)), np.zeros((10, 10))
    for run in runs:
        weights = _weights(run, chi)
        signal += np.einsum("nea,nef,nfb->ab", run.W, weights, run.W, optimize=True)
        spread = np.einsum("njk,nkfb->njfb", run.covariances, run.answers, optimize=True)
        turned = np.einsum("nef,njfb->njeb", weights, spread, optimize=True)
        noise += np.einsum("njea,njeb->ab", run.answers, turned, optimize=True)
    n_equations = sum(run.W.shape[0] * run.W.shape[1] for run in runs)
    return signal / n_equations, noise / n_equations


def _score_spread(runs: list[NoisyRegressor], chi: Array, bias: Array) -> Array:
    """Covariance of the normal equations' residual, errors correlated over a second, (9, 9)."""
    total = np.zeros((9, 9))
    n_equations = sum(run.W.shape[0] * run.W.shape[1] for run in runs)
    for run in runs:
        weights = _weights(run, chi)
        scores = np.einsum("nea,nef,nf->na", run.W, weights, run.W @ chi, optimize=True)
        scores = (scores / n_equations - (bias @ chi) * run.W.shape[1] / n_equations)[:, 1:]
        total += scores.T @ scores
        lags = min(len(scores) - 1, round(CORRELATED_S / run.period_s))
        for lag in range(1, lags + 1):
            pair = scores[lag:].T @ scores[:-lag]
            total += (1.0 - lag / (lags + 1.0)) * (pair + pair.T)
    return total
