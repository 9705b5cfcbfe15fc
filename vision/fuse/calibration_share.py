"""What the calibration's own uncertainty does to the poses.

Pixel noise scatters the poses; a calibration that is a little wrong shifts them all alike, and no
residual shows it. The covariance that `calibrate` leaves in calibration.json is carried through
the solve: dpose = N^-1 J' W (d rays / d calibration) d calibration, at some instants of each run.
Where the platform's tags tie the cameras their places are part of it.
What the runs have in common is kept as modes, each of one standard deviation; `identify` takes
them as what they are, errors that all poses of the session share.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.lens_models import PARAMETER_NAMES
from freeswing.calib.verdict.calibration_result import read_camera_covariance
from freeswing.calib.verdict.platform_layout import read_layout, tag_entries
from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.measured.pose_errors import TERMS, PoseErrors, error_terms, fitted_terms
from freeswing.vision.fuse.blocks import blocks
from freeswing.vision.fuse.corner_noise import Noise, whitened
from freeswing.vision.fuse.fuse_cameras import Fit, free_of
from freeswing.vision.fuse.linearised_block import linearised
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.run_views import Block, CameraViews
from freeswing.vision.look.watched_target import Watch

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

_POSE_NAMES = ("tx_m", "ty_m", "tz_m", "rx_rad", "ry_rad", "rz_rad")
_INSTANTS_A_RUN = 150
_STILL = 7  # of `TERMS`: those that hold no velocity
_LEFT_OUT = 1e-4  # of the variance, over all runs


@dataclass(frozen=True, slots=True)
class CalibrationNoise:
    """Covariance (n, n) of named numbers such as `cam0.fx`, `platform.tag36h11 3.rx_rad`."""

    names: tuple[str, ...]
    matrix: Array

    def roots(self) -> Array:
        """L with L L' the covariance, one column an independent cause, (n, m)."""
        values, vectors = np.linalg.eigh(self.matrix)
        real = values > 1e-14 * max(float(values[-1]), 1e-300)
        return vectors[:, real] * np.sqrt(values[real])


@dataclass(frozen=True, slots=True)
class RunShare:
    """The calibration's share of one run's poses.

    Attributes:
        std: median standard deviations of position and small rotation, (6,).
        errors: one mode for each independent cause in the calibration.
        spread: root of the mean products of the errors' terms along the run, (13, k): terms that go
            together in a short swing count by what they do together.
    """

    std: Array
    errors: PoseErrors
    spread: Array


def read_calibration_noise(path: Path, *, tied: bool = True) -> CalibrationNoise | None:
    """From calibration.json; None where there is none, or it tells no covariance.

    Args:
        path: of the file.
        tied: whether tags of the platform that tie the cameras are taken where it has them; then
            their places are off together with the cameras.
    """
    try:
        told = read_camera_covariance(path)
        layout = read_layout(path) if tied else None
    except InputError:
        return None
    if layout is not None and layout.covariance is not None:
        told = layout.covariance if np.isfinite(layout.covariance.matrix).all() else told
    return CalibrationNoise(told.names, told.matrix) if np.isfinite(told.matrix).all() else None


def run_share(
    poses: Poses,
    fit: Fit,
    views: Sequence[CameraViews],
    watch: Watch,
    noise: CalibrationNoise | None,
    shared: Array | None = None,
) -> RunShare | None:
    """The share of a run's poses, from instants spread over it; None where none is told.

    Args:
        poses: of the run.
        fit: how its sightings agree with them.
        views: its cameras.
        watch: what was looked for.
        noise: the calibration's, None where it is not known.
        shared: causes more that the run has in common with others, such as the platform's frame or
            what cameras that contradict each other leave open, at `share_instants`, (n, 6, m).
    """
    if noise is None and shared is None:
        return None
    known = np.flatnonzero(poses.known)
    if not len(known):
        return None
    chosen = share_instants(poses)
    slopes = np.zeros((len(chosen), 6, 0))
    if noise is not None:
        slopes = pose_slopes(poses, fit, views, watch, noise.names) @ noise.roots()
    moving = slopes.shape[2]  # clocks are the calibration's alone: other causes know no velocity
    if shared is not None:
        slopes = np.concatenate([slopes, shared], axis=2)
    about = int(known[len(known) // 2])
    origin, turn = poses.positions_m[about], poses.rotations[about]
    terms = error_terms(
        poses.positions_m[chosen], poses.rotations[chosen], poses.motions[chosen, :6], origin, turn
    )
    fitted = fitted_terms(terms, slopes[:, :, :moving])
    still = fitted_terms(terms[:, :_STILL], slopes[:, :, moving:])
    still = np.concatenate([still, np.zeros((6, TERMS - _STILL, still.shape[2]))], axis=1)
    modes = np.moveaxis(np.concatenate([fitted, still], axis=2), 2, 0)
    return RunShare(
        np.median(np.sqrt(np.sum(slopes**2, axis=2)), axis=0),
        PoseErrors(origin, turn, modes),
        np.linalg.qr(terms / np.sqrt(len(terms)))[1].T,
    )


def pose_slopes(
    poses: Poses, fit: Fit, views: Sequence[CameraViews], watch: Watch, names: tuple[str, ...]
) -> Array:
    """How poses at `share_instants` change with numbers of the cameras, (n, 6, n_names).

    Args:
        poses: of a run.
        fit: how its sightings agree with them.
        views: its cameras.
        watch: what was looked for.
        names: such as `cam0.fx`, `cam0.line_time_s` and `platform.tag36h11 3.tx_m`.

    Source:
        Triggs et al. 2000, Bundle Adjustment: A Modern Synthesis, sec. 6: what is held changes
        what is estimated through the normal equations.
    """
    chosen, found = share_instants(poses), []
    for block in blocks(views, watch, poses.times_s, poses):
        mine = chosen[(chosen >= block.first) & (chosen < block.first + len(block.starts) - 1)]
        if len(mine):
            found.append(_pose_slopes(block, poses, views, fit.noise, names, mine, watch))
    return np.concatenate(found) if found else np.zeros((0, 6, len(names)))


def share_instants(poses: Poses) -> Ints:
    """Some known instants, spread over a run, that tell how its poses are off together, (n,)."""
    known = np.flatnonzero(poses.known)
    return np.asarray(known[:: max(1, len(known) // _INSTANTS_A_RUN)])


def frame_causes(poses: Poses, covariance: Array) -> Array:
    """What an error of the platform's frame does to each pose, one column a cause, (n, 6, 6).

    Args:
        poses: of a run.
        covariance: of a small shift (m) and turn (rad) of that frame in itself, (6, 6).

    Source:
        Murray, Li, Sastry 1994, A Mathematical Introduction to Robotic Manipulation, ch. 2: errors
        of a frame as small screws.
    """
    values, vectors = np.linalg.eigh(covariance)
    roots = vectors * np.sqrt(values.clip(0.0))
    return np.concatenate([poses.rotations @ roots[:3], poses.rotations @ roots[3:]], axis=1)


def common_errors(shares: Sequence[RunShare | None]) -> list[PoseErrors | None]:
    """The runs' errors with the fewest modes that hold all but a trace of their variance.

    A radian counts as much as a metre: cables of a metre or two make them do the same.
    """
    seen = [share for share in shares if share is not None]
    if not seen:
        return [None] * len(shares)
    most = max(len(s.errors.modes) for s in seen)  # a run without doubt has a cause fewer
    weighted = [
        np.moveaxis(_padded(s.errors.modes, most) @ s.spread, 0, 2).reshape(-1, most) for s in seen
    ]
    _, sizes, mixes = np.linalg.svd(np.concatenate(weighted), full_matrices=False)
    left = 1.0 - np.cumsum(sizes**2) / max(float(np.sum(sizes**2)), 1e-300)
    count = int(np.searchsorted(-left, -_LEFT_OUT)) + 1
    return [None if share is None else _mixed(share.errors, mixes[:count]) for share in shares]


def _padded(modes: Array, count: int) -> Array:
    """With causes that do nothing up to so many."""
    return np.concatenate([modes, np.zeros((count - len(modes), *modes.shape[1:]))])


def _mixed(errors: PoseErrors, mixes: Array) -> PoseErrors:
    modes = np.einsum("jr,rab->jab", mixes, _padded(errors.modes, mixes.shape[1]))
    return PoseErrors(errors.about_m, errors.about_rotation, modes)


def _pose_slopes(
    block: Block,
    poses: Poses,
    views: Sequence[CameraViews],
    corners: Noise,
    names: tuple[str, ...],
    chosen: Ints,
    watch: Watch,
) -> Array:
    """Change of the pose by the calibration at the chosen instants, (n, 6, n_names)."""
    free, tags = free_of(watch), _tag_columns(watch, names)
    linear = linearised(block, views, poses)
    residuals, rates, places = linear.residuals, linear.rates, linear.places
    white = whitened(block, corners, views)
    slopes = np.zeros((len(chosen), 6, len(names)))
    for row, k in enumerate(chosen - block.first):
        turn = poses.rotations[chosen[row]]
        normal, cross = np.zeros((free, free)), np.zeros((free, len(names)))
        for o in range(block.starts[k], block.starts[k + 1]):
            points = int(block.counts[o])
            m = 2 * points
            if not np.isfinite(places[o]).all() or (residuals[o, :m] == 0.0).all():
                continue
            jacobian = white[o, :m, :m] @ linear.jacobians[o, :m, :free]
            normal += jacobian.T @ jacobian
            view = views[block.camera_of[o]]
            by_time = rates[o, :m].reshape(points, 2)
            slope = _ray_slopes(view, places[o, :points], by_time, block.rows_px[o], names)
            if (columns := tags.get(int(block.things[o]))) is not None:
                slope[:, columns] = _tag_slopes(linear.jacobians[o, :m, :3] @ turn, block.points[o])
            cross += jacobian.T @ white[o, :m, :m] @ slope
        slopes[row, :free] = np.linalg.pinv(normal, hermitian=True) @ cross
    return slopes


def _tag_columns(watch: Watch, names: tuple[str, ...]) -> dict[int, list[int]]:
    """Where the numbers of the places of tags stand among the names, by the tag's index."""
    at = {name: k for k, name in enumerate(names)}
    entries = {thing: tag_entries(*tag) for thing, tag in enumerate(watch.tags)}
    return {
        thing: [at[name] for name in own]
        for thing, own in entries.items()
        if all(name in at for name in own)
    }


def _tag_slopes(by_point: Array, corners_m: Array) -> Array:
    """How residual rays of a tag's corners (4, 3) change with its shift and turn, (8, 6).

    A corner that moves on the platform moves as it would with the platform: `by_point` (8, 3) is
    what the rays of the corners do then, along the platform's axes.
    """
    arms = np.repeat(corners_m - corners_m.mean(axis=0), 2, axis=0)
    return -np.concatenate([by_point, np.cross(arms, by_point)], axis=1)


def _ray_slopes(
    view: CameraViews, places: Array, by_time: Array, rows_px: Array, names: tuple[str, ...]
) -> Array:
    """How residual rays of points (n, 3) change with the calibration, (2 n, n_names)."""
    camera = view.camera
    rays = np.column_stack([places[:, :2] / places[:, 2:], np.ones(len(places))])
    _, by_point, by_lens = camera.project_jacobian(rays)
    lens = -np.linalg.solve(by_point[:, :, :2], by_lens)
    g = np.zeros((len(places), 2, 3))
    g[:, 0, 0] = g[:, 1, 1] = 1.0
    g[:, :, 2] = -rays[:, :2]
    g /= places[:, 2][:, None, None]
    arms = places - camera.T_camera_base[:3, 3]
    by_pose = -np.concatenate([g, np.cross(arms[:, None, :], g)], axis=2)
    clocks = -np.stack([by_time, by_time * rows_px[: len(places), None]], axis=2)
    parts = np.concatenate([lens, by_pose, clocks], axis=2)
    entries = (*PARAMETER_NAMES[camera.model], *_POSE_NAMES, "clock_offset_s", "line_time_s")
    columns = {name: k for k, name in enumerate(names)}
    slopes = np.zeros((2 * len(places), len(names)))
    for k, entry in enumerate(entries):
        if (column := columns.get(f"{camera.name}.{entry}")) is not None:
            slopes[:, column] = parts[:, :, k].ravel()
    return slopes
