"""Recordings of a rigid set of markers, made without the code that fits them."""

import numpy as np
from scipy.spatial.transform import Rotation

from freeswing.cdpr.measured.marker_recording import MarkerRecording
from freeswing.cdpr.measured.target import Marker, Target

NAMES = ("P", "A", "B", "C", "D")
LAYOUT = np.array(
    [[0, 0, 0], [-0.18, -0.15, 0.04], [0.19, -0.14, 0.05], [0.2, 0.14, 0.03], [-0.19, 0.16, 0.04]]
)


def target(layout=LAYOUT):
    return Target(markers=tuple(Marker(n, p) for n, p in zip(NAMES, layout, strict=False)))


def motion(n=400, seed=0, rate_hz=100.0):
    """Times, R (n, 3, 3) and t (n, 3) of a swing of three frequencies."""
    rng = np.random.default_rng(seed)
    times = np.arange(n) / rate_hz
    waves = np.sin(2 * np.pi * np.outer(times, [0.4, 0.7, 1.1]) + rng.uniform(0, 6, 3))
    R = Rotation.from_rotvec(waves @ rng.normal(0, 0.15, (3, 3))).as_matrix()
    return times, R, waves @ rng.normal(0, 0.2, (3, 3)) + [1.0, 0.2, -0.9]


def recording(layout=LAYOUT, noise_m=2e-5, seed=0, n=400, name="run"):
    """A recording, with its true R and t."""
    times, R, t = motion(n, seed)
    points = np.einsum("tij,mj->tmi", R, layout) + t[:, None]
    points += noise_m * np.random.default_rng(1000 + seed).normal(size=points.shape)
    return MarkerRecording(times, NAMES[: len(layout)], points, name), R, t


def drift(n, seed, time_constant=80):
    """Slow noise (n, 3) of standard deviation 1 and that correlation time in samples."""
    rng = np.random.default_rng(seed)
    keep = np.exp(-1.0 / time_constant)
    state, result = rng.normal(size=3), np.empty((n, 3))
    for k in range(n):
        result[k] = state
        state = keep * state + np.sqrt(1 - keep**2) * rng.normal(size=3)
    return result
