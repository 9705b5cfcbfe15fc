"""What the calibration's own uncertainty does to the poses.

Pixel noise scatters the poses; a calibration that is a little wrong shifts them all alike, and no
residual shows it. The covariance that `calibrate` leaves in calibration.json is carried through
the solve: dpose = N^-1 J' W (d rays / d lens - d rays / d pose of the camera) d calibration.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vision.fuse import Fit, Poses, camera_matrices, whitened
from vision.pose_kernels import linearise_block
from vision.run_views import Block, CameraViews, blocks
from vision.watch import Watch

Array = NDArray[np.float64]

_POSE_NAMES = ("tx_m", "ty_m", "tz_m", "rx_rad", "ry_rad", "rz_rad")
_BLOCK_SAMPLES = 12


@dataclass(frozen=True, slots=True)
class CalibrationNoise:
    """Covariance (n, n) of named numbers such as `cam0.fx` and `cam0.rx_rad`."""

    names: tuple[str, ...]
    matrix: Array


def read_calibration_noise(path: Path) -> CalibrationNoise | None:
    """From calibration.json; None where there is none, or it tells no covariance."""
    try:
        table: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        share = table["covariance"]
        names = tuple(str(name) for name in share["names"])
        matrix = np.array(share["matrix"], dtype=np.float64)
    except (OSError, ValueError, KeyError, TypeError):
        return None
    if matrix.shape != (len(names), len(names)) or not np.isfinite(matrix).all():
        return None
    return CalibrationNoise(names, matrix)


def calibration_deviations(
    poses: Poses,
    fit: Fit,
    views: Sequence[CameraViews],
    watch: Watch,
    noise: CalibrationNoise,
) -> Array:
    """Standard deviations of position and small rotation at some instants of a run, (n, 6)."""
    focal = np.array([v.camera.focal_px.mean() for v in views])
    found = [np.zeros((0, 6))]
    for block in blocks(views, watch, poses.times_s):
        span = slice(block.first, block.first + len(block.starts) - 1)
        chosen = np.flatnonzero(poses.known[span])
        if len(chosen):
            chosen = chosen[:: max(1, len(chosen) // _BLOCK_SAMPLES)]
            shares = _shares(block, poses, views, fit.floor_px / focal, noise, chosen)
            found.append(np.sqrt(np.diagonal(shares, axis1=1, axis2=2)))
    return np.concatenate(found)


def _shares(
    block: Block,
    poses: Poses,
    views: Sequence[CameraViews],
    floors: Array,
    noise: CalibrationNoise,
    chosen: NDArray[np.int64],
) -> Array:
    """Covariance of the pose by the calibration at the chosen instants, (n, 6, 6)."""
    count = len(block.starts) - 1
    span = slice(block.first, block.first + count)
    n_o = len(block.things)
    instant = np.repeat(np.arange(count), np.diff(block.starts))
    lags = np.ascontiguousarray(block.times_s - poses.times_s[span][instant][:, None])
    residuals, rates = np.zeros((n_o, 8)), np.zeros((n_o, 8))
    jacobians, places = np.zeros((n_o, 8, 6)), np.ones((n_o, 4, 3))
    linearise_block(
        block.starts, np.ascontiguousarray(poses.rotations[span]),
        np.ascontiguousarray(poses.positions_m[span]), poses.known[span],
        np.ascontiguousarray(poses.motions[span]), camera_matrices(views), block.camera_of,
        block.points, block.rays, lags, block.counts, residuals, jacobians, rates, places,
    )  # fmt: skip
    white = whitened(block, floors)
    shares = np.zeros((len(chosen), 6, 6))
    for row, k in enumerate(chosen):
        normal, cross = np.zeros((6, 6)), np.zeros((6, len(noise.names)))
        for o in range(block.starts[k], block.starts[k + 1]):
            m = 2 * int(block.counts[o])
            weight = white[o, :m, :m].T @ white[o, :m, :m]
            if not np.isfinite(places[o]).all() or (residuals[o, :m] == 0.0).all():
                continue
            jacobian = jacobians[o, :m]
            normal += jacobian.T @ weight @ jacobian
            view = views[block.camera_of[o]]
            slope = _ray_slopes(view, places[o, : m // 2], noise.names)
            cross += jacobian.T @ weight @ slope
        solved = np.linalg.pinv(normal, hermitian=True) @ cross
        shares[row] = solved @ noise.matrix @ solved.T
    return shares


def _ray_slopes(view: CameraViews, places: Array, names: tuple[str, ...]) -> Array:
    """How residual rays of points (n, 3) change with the calibration, (2 n, n_names)."""
    camera = view.camera
    rays = np.column_stack([places[:, :2] / places[:, 2:], np.ones(len(places))])
    _, by_point, by_lens = camera.project_jacobian(rays)
    lens = -np.linalg.solve(by_point[:, :, :2], by_lens)
    offset = camera.T_camera_base[:3, 3]
    columns = {name: k for k, name in enumerate(names)}
    slopes = np.zeros((2 * len(places), len(names)))
    for k, name in enumerate(_lens_names(view)):
        if (column := columns.get(f"{camera.name}.{name}")) is not None:
            slopes[:, column] = lens[:, :, k].ravel()
    for i, place in enumerate(places):
        x, y = place[:2] / place[2]
        g = np.array([[1.0, 0.0, -x], [0.0, 1.0, -y]]) / place[2]
        extrinsic = -np.hstack([g, np.cross(place - offset, g)])
        for k, name in enumerate(_POSE_NAMES):
            if (column := columns.get(f"{camera.name}.{name}")) is not None:
                slopes[2 * i : 2 * i + 2, column] = extrinsic[:, k]
    return slopes


def _lens_names(view: CameraViews) -> tuple[str, ...]:
    from calib.camera_models import PARAMETER_NAMES

    return PARAMETER_NAMES[view.camera.model]
