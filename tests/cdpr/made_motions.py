"""Seeded motions and recordings for the tests of trajectory files."""

import numpy as np

from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.cdpr.measured.marker_recording import MarkerRecording
from freeswing.cdpr.measured.target import Marker, Target
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import Cable, Robot

POSE = ("x", "y", "z", "phi", "theta", "chi")
POSITIONS = [[0, 0, 0], [-0.18, -0.15, 0.04], [0.19, -0.14, 0.04], [0.2, 0.14, 0.05]]
TARGET = Target(markers=tuple(Marker(n, p) for n, p in zip("PABC", POSITIONS, strict=True)))


def robot(free):
    cables = tuple(Cable(str(i), np.zeros(3), 0.0, np.zeros(3)) for i in range(4))
    return Robot("r", cables, free_coordinates=free)


def swing(coordinates=POSE, n=60, seed=0, with_noise=True, missing=True):
    rng = np.random.default_rng(seed)
    times = rng.uniform(-1, 1) + 0.01 * np.arange(n)
    rates = rng.uniform(3, 9, len(coordinates))
    values = 0.4 * rng.normal(size=len(coordinates)) + 0.5 * np.sin(np.outer(times, rates))
    roots = 1e-3 * rng.normal(size=(n, len(coordinates), len(coordinates)))
    covariances = roots @ roots.swapaxes(1, 2) if with_noise else None
    if missing:
        hidden = rng.random(n) < 0.2
        values[hidden] = np.nan
        covariances = (
            None if covariances is None else np.where(hidden[:, None, None], np.nan, covariances)
        )
    return Trajectory(times, coordinates, values, covariances, "test")


def recording(seed=0, n=40, n_markers=5, first=0):
    rng = np.random.default_rng(seed)
    positions = rng.uniform(-3, 3, size=(n, n_markers, 3))
    positions[rng.random((n, n_markers)) < 0.3] = np.nan
    names = tuple(f"M {i}é" for i in range(n_markers))
    return MarkerRecording((first + np.arange(n)) / 100.0, names, positions, "a")


def read(tmp_path, text, name="a.csv", free=None):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_trajectory(path, robot(free) if free is not None else None, TARGET)
