"""What a swing tells the maximum-likelihood estimate about the inertia.

The free coordinates are measured with white noise; the initial state is unknown and the cable
lengths are known to a standard deviation, swing by swing. Both are eliminated, what is left adds up
over swings: its inverse bounds the covariance of the inertia (Cramer-Rao).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.robot import Array
from freeswing.cdpr.simulation.sensitivity import linearise
from freeswing.excite.swing import Bench, Swing


@dataclass(frozen=True, slots=True)
class MeasurementNoise:
    """How well swings are measured.

    Attributes:
        position_m: standard deviation of a sample of a free x y z.
        angle_rad: standard deviation of a sample of a free phi theta chi.
        frame_rate_hz: samples a second.
        length_m: standard deviation of a cable length.
    """

    position_m: float = 1e-4
    angle_rad: float = 1e-3
    frame_rate_hz: float = 100.0
    length_m: float = 5e-4


def swing_information(bench: Bench, swing: Swing, noise: MeasurementNoise | None = None) -> Array:
    """Fisher information of one swing about the nine inertia values, (9, 9).

    Raises:
        ValueError: when the motion cannot be followed.

    Source:
        Kay 1993, Fundamentals of Statistical Signal Processing: Estimation Theory, ch. 3.
    """
    from scipy.linalg import null_space

    noise = noise or MeasurementNoise()
    course = bench.course(swing.release, bench.duration_s)
    free, times = bench.free_indices, bench.times_s
    seen = linearise(course.motion).at(times)[0][:, free, :21]
    std = np.array([noise.position_m if k < 3 else noise.angle_rad for k in free])
    share = noise.frame_rate_hz * bench.duration_s / len(times)
    jacobian = evaluate(bench.model.cables, swing.release, bench.model.start_values)[3]
    # Rates that the locked cables allow; all rates at rest leave the lengths' own rates zero.
    allowed = null_space(jacobian)
    seen = seen / std[:, None] * np.sqrt(share)
    by_state = np.concatenate([seen[..., :6], seen[..., 6:12] @ allowed], axis=-1)
    by_state = by_state.reshape(-1, by_state.shape[-1])
    by_inertia = seen[..., 12:21].reshape(-1, 9)
    held = by_state.T @ by_state
    held[:6, :6] += jacobian.T @ jacobian / noise.length_m**2
    mixed = by_state.T @ by_inertia
    return by_inertia.T @ by_inertia - mixed.T @ np.linalg.solve(held, mixed)


def predicted_std(information: Array) -> Array:
    """Standard deviations of the inertia values that (9, 9) information allows; NaN if singular.

    Source:
        Kay 1993, Fundamentals of Statistical Signal Processing: Estimation Theory, ch. 3:
        the Cramer-Rao bound.
    """
    scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    scaled = information * np.outer(scale, scale)
    if np.linalg.eigvalsh(scaled)[0] < 1e-12:
        return np.full(len(information), np.nan)
    return scale * np.sqrt(np.diag(np.linalg.inv(scaled)))
