"""One run's cable lengths as linear equations of all that may be wrong with them.

With the unknowns v: l(z, g) - what effects such as stretch and creep add = a constant of the run,
where z is the measured pose less what effects on the measurement, the run's platform frame and
noise add.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.model.batch import evaluate, with_jacobian
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array, Robot
from freeswing.cdpr.rotation import angle_rate_matrix, matrix_from_angles
from freeswing.ident.diagnose.lengths.local_polynomials import local_derivatives
from freeswing.ident.likelihood.run_residuals import Samples

# Slow errors follow the swing (up to some 2 Hz): means over a tenth of a second lose none of them.
BLOCK_S = 0.1
RATES_OVER_S = 0.15
# The shape of slow errors: half-hidden markers and tags move poses by a tenth of a millimetre, the
# pulley's run-out and the seat in its groove a length by a few. Their size is estimated, and at
# least so much: below it the small print of every error decides what is wrong. On real recordings
# the residual of a general enough model is a tenth of it, and pulleys had to be a quarter
# turn off to reach it.
DRIFT_M = 1e-4
DRIFT_RAD = 5e-4
RUN_OUT_M = 3e-4
LEAST_SIZE = 1.0
# Poses that say nothing of slow errors are believed, but never below 20 micrometres.
LEAST_SIZE_UNSTATED = 0.2


@dataclass(frozen=True, slots=True)
class LengthRows:
    """Means over blocks of a run's equations own u + shared v + right = noise.

    Attributes:
        run: its name.
        own: by the run's constants: lengths, then its frame in standard deviations, (b, n, o).
        shared: by the unknowns that all runs share, (b, n, p).
        right: lengths less their mean, with the unknowns at zero, (b, n).
        white: covariance of the white noise, (b, n, n).
        slow: of slow errors of unit size, (b, n, n).
        least_size: of the slow errors.
        beside: further equations of unit noise over [own; shared; right], (k, o + p + 1), or None.
        weight: of the lengths beside these.
    """

    run: str
    own: Array
    shared: Array
    right: Array
    white: Array
    slow: Array
    least_size: float
    beside: Array | None = None
    weight: float = 1.0


def measured_rates(times_s: Array, values: Array) -> Array:
    """Time derivatives of samples (n, c) at their times (n,), by cubics over `RATES_OVER_S`.

    Source:
        Savitzky, Golay 1964, Smoothing and Differentiation of Data by Simplified Least
        Squares.
    """
    return local_derivatives(times_s, values, RATES_OVER_S, 3, 1)


def length_rows(
    model: Model,
    inertia: Array,
    samples: Samples,
    noise_scales: Array,
    values: Array,
    patterns: dict[str, Array],
) -> LengthRows:
    """A run's equations, linearised at values of the geometry.

    Args:
        model: with all effects that displace or measure; its values come first among the shared
            unknowns, then those of the patterns.
        inertia: of the platform, (9,).
        samples: its poses.
        noise_scales: of metres and radians, (2,).
        values: at which to linearise, (k,); those of measurement effects at zero.
        patterns: how other effects would make lengths vary, (n_t, n, k) each.
    """
    zetas, times = samples.values, samples.times_s
    n = model.robot.n_cables
    lengths, slopes = evaluate(with_jacobian(model.lengths, (0, 1)), zetas, values)
    by_pose, by_values = slopes[:, :, :6], slopes[:, :, 6:]
    rates = measured_rates(times, zetas)
    shown = evaluate(
        with_jacobian(model.measured, (4,)), times, zetas, rates, inertia, model.start_values
    )[1]
    geometry = by_values - by_pose @ shown
    turn = np.linalg.inv(angle_rate_matrix(zetas[:, 3:]))
    by_twist = np.concatenate([by_pose[:, :, :3], by_pose[:, :, 3:] @ turn], axis=2)
    rotations = matrix_from_angles(zetas[:, 3:])
    in_platform = np.concatenate([by_twist[..., :3] @ rotations, by_twist[..., 3:] @ rotations], 2)
    shared = np.concatenate([geometry, *(-pattern for pattern in patterns.values())], axis=2)
    right = lengths - np.einsum("tck,k->tc", by_values, values)
    blocks = _blocks(times)
    noise = by_twist @ np.linalg.inv(samples.whitener) * noise_scales[samples.groups]
    drift = usual_drift()
    own = [np.broadcast_to(np.eye(n), (len(times), n, n))]
    least = LEAST_SIZE_UNSTATED
    if samples.slow is not None:
        least = LEAST_SIZE
        drift = drift + samples.slow.drift_covariance
        own.append(in_platform @ frame_root(model.robot, samples))
    mean_in_platform = _means(in_platform, blocks)
    counts = np.bincount(blocks)[:, None, None]
    return LengthRows(
        samples.name,
        _means(np.concatenate(own, axis=2), blocks),
        _means(shared, blocks),
        _means(right - right.mean(axis=0), blocks),
        _means(noise @ np.swapaxes(noise, 1, 2), blocks) / counts,
        slow_covariance(mean_in_platform, drift),
        least,
    )


def usual_drift() -> Array:
    """Covariance of slow errors of a pose, platform frame, m and rad, (6, 6).

    Source:
        JCGM 100:2008, sec. 4.3: values that are believed, as no statistics tell them.
    """
    return np.diag([DRIFT_M**2] * 3 + [DRIFT_RAD**2] * 3)


def slow_covariance(in_platform: Array, drift: Array) -> Array:
    """Covariance of lengths (..., n, n) by slow errors of poses and by the pulleys' run-out.

    Args:
        in_platform: slopes of lengths by a small motion of the platform, its frame, (..., n, 6).
        drift: of the pose, (6, 6).

    Source:
        JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, eq. (13):
        propagation.
    """
    n = in_platform.shape[-2]
    return in_platform @ drift @ np.swapaxes(in_platform, -1, -2) + RUN_OUT_M**2 * np.eye(n)


def frame_root(robot: Robot, samples: Samples) -> Array:
    """A factor of the covariance of a run's platform frame, (6, 6); (6, 0) where none is stated.

    Source:
        Golub, Van Loan 2013, Matrix Computations, ch. 8: by its eigenvectors.
    """
    if samples.slow is None:
        return np.zeros((6, 0))
    known = robot.tolerances
    usual = np.diag([known.frame_m**2] * 3 + [known.frame_rad**2] * 3)
    return _root(samples.slow.frame_covariance + usual)


def _blocks(times_s: Array) -> np.ndarray:
    """Which block each sample belongs to, (n,), without empty ones."""
    raw = ((times_s - times_s[0]) / BLOCK_S).astype(np.int64)
    return np.unique(raw, return_inverse=True)[1]


def _means(values: Array, blocks: np.ndarray) -> Array:
    flat = values.reshape(len(values), -1)
    starts = np.flatnonzero(np.diff(blocks, prepend=-1))
    sums = np.add.reduceat(flat, starts, axis=0)
    return (sums / np.bincount(blocks)[:, None]).reshape(-1, *values.shape[1:])


def _root(covariance: Array) -> Array:
    """A factor of a positive semi-definite matrix."""
    sizes, axes = np.linalg.eigh(covariance)
    return axes * np.sqrt(np.maximum(sizes, 0.0))
