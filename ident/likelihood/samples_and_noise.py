"""Raw samples of a run made ready for the likelihood: known ones, whitened, with stated lengths."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.robot import POSE_COORDINATES, Array
from freeswing.ident.likelihood.run_residuals import Samples
from freeswing.ident.runs import SwingRun

# Motion capture's noise; a fit scales it by what the residuals are, so that its ratio counts.
UNIT_NOISE_M = 1e-4
UNIT_NOISE_RAD = 5e-4
UNSTATED_LENGTH_STD_M = 1e-3  # encoders are finer, the zero of a winch is not
SMALLEST_LENGTH_STD_M = 1e-7  # stiffer walls leave a fit no digits for the rest
LEAST_SAMPLES = 50  # beside 12 numbers of the run's own: half a second of motion capture


def prepare(run: SwingRun, window_s: tuple[float, float]) -> Samples:
    """The known samples of a run inside its window of free motion.

    Noise that the trajectory does not state is taken as 0.1 mm and 0.5 mrad; the fit scales both.
    Lengths without a standard deviation are taken as known to 1 mm.

    Raises:
        ValueError: when fewer than 50 samples are known in the window.
    """
    inside = run.trajectory.window(*window_s)
    known = inside.is_known
    if known.sum() < LEAST_SAMPLES:
        raise ValueError(
            f"{known.sum()} samples are known from {window_s[0]:.2f} to {window_s[1]:.2f} s, "
            f"at least {LEAST_SAMPLES} are needed"
        )
    groups = np.array([0 if name in POSE_COORDINATES[:3] else 1 for name in inside.coordinates])
    times = inside.times_s[known]
    return Samples(
        name=run.name,
        times_s=times,
        coordinates=inside.coordinates,
        values=inside.values[known],
        whitener=_whitener(
            None if inside.covariances is None else inside.covariances[known],
            groups,
            int(known.sum()),
        ),
        groups=groups,
        lengths_m=run.lengths_m,
        lengths_std_m=max(length_std(run), SMALLEST_LENGTH_STD_M),
        span_s=(float(times[0]), float(times[-1])),
        payload=run.payload,
        slow=inside.slow,
        errors=run.pose_errors,
    )


def length_std(run: SwingRun) -> float:
    """Standard deviation of a run's stated cable lengths, m; 1 mm where it states none."""
    return UNSTATED_LENGTH_STD_M if run.lengths_std_m is None else run.lengths_std_m


def _whitener(covariances: Array | None, groups: np.ndarray, count: int) -> Array:
    unit = np.where(groups == 0, UNIT_NOISE_M, UNIT_NOISE_RAD)
    if covariances is None:
        return np.broadcast_to(np.diag(1.0 / unit), (count, len(unit), len(unit)))
    # Covariances over their units are of order one: a factorisation in SI units would be as exact
    # but its failure would be hard to tell from a tiny variance.
    scaled = covariances / unit[:, None] / unit
    floor = 1e-12 * np.eye(len(unit))
    return np.linalg.inv(np.linalg.cholesky(scaled + floor)) / unit
