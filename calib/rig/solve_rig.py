"""A rig of cameras from the board's sightings: start, adjust, drop what does not belong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.board.board_motion import Timeline, in_pieces
from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.intrinsics import CameraStart, DroppedView, start_camera
from freeswing.calib.camera.lens_models import Array
from freeswing.calib.rig.bundle_adjustment import (
    MEDIAN_OF_RAYLEIGH,
    ROUGHLY_CONVERGED,
    Adjustment,
    adjust,
)
from freeswing.calib.rig.normal_equations import Problem, length_with_share
from freeswing.calib.rig.reprojection import Scene, board_size, camera_slices, shape_modes
from freeswing.calib.rig.reprojection_kernels import CLOCK, POSE, WARP
from freeswing.calib.rig.rig_start import BaseTie, board_groups, place_in_base, start_rig
from freeswing.calib.rig.views import FixedPoints, Views, joined_views

Progress = Callable[[str, float], None]

# Of its camera's usual error: a moved or misread board leaves more.
VIEW_OUTLIER_SIGMAS = 5.0
VIEW_OUTLIER_FLOOR_PX = 0.5  # below half a pixel nothing was misread, whatever the others reach
CORNER_SIGMAS = 6.0  # one in 1e8 by chance: none of a session's 1e5 corners
# share of normal errors within the limit of a corner's on its own, as large for corners together
CORNER_WITHIN = 1.0 - np.exp(-0.5 * CORNER_SIGMAS**2)
_LEAST_CORNERS = 4  # three leave four poses of the board open
LINE_TIME_SIGMAS = 5.0
LEAST_READOUT_S = 5e-4
_MOST_SWEEPS = 3
_SURVEY_ROUNDS = 3
_SURVEY_PRIOR = 2.0
LEAST_SURVEY_STD_M = 2e-5
SAG_STD = 0.002
"""Of the board's width. Aluminium and glass keep 0.0003, foam and card on wood 0.001 to 0.005."""
GROWTH_STD = 0.02
"""Of a marker's side: ink spreads by some hundredths, and public boards state theirs 4 % off."""


@dataclass(frozen=True, slots=True)
class Rig:
    """A solved rig.

    Attributes:
        adjustment: estimate, covariance, noise and residuals.
        problem: the data kept and the unknowns that were free.
        reference: camera whose pose is the identity where there is no base frame.
        dropped: views left out, by name.
        n_trimmed: single corners left out.
        guessed_clocks: cameras whose start is only known by their stamps, by name.
    """

    adjustment: Adjustment
    problem: Problem
    reference: int
    dropped: tuple[DroppedView, ...]
    n_trimmed: int
    guessed_clocks: tuple[str, ...] = ()

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """The calibrated cameras."""
        return self.adjustment.scene.cameras

    @property
    def is_tied_by_swings(self) -> bool:
        """Whether the platform's tags take part beside the board."""
        points = self.problem.board_points_m
        return board_size(points) < len(points)


def start_cameras(
    names: tuple[str, ...],
    sizes_px: tuple[tuple[int, int], ...],
    models: tuple[str, ...],
    board_points_m: Array,
    views: Views,
) -> tuple[CameraStart, ...]:
    """Every camera on its own."""
    return tuple(
        start_camera(name, size, model, board_points_m, views.select(views.camera == index))
        for index, (name, size, model) in enumerate(zip(names, sizes_px, models, strict=True))
    )


def solve_rig(
    board_points_m: Array,
    starts: tuple[CameraStart, ...],
    offsets_s: Array | None = None,
    line: Timeline | None = None,
    straighten: Callable[[Scene, Views], Views] | None = None,
    tie: BaseTie | None = None,
) -> Rig:
    """All cameras and board poses at once, in the frame of the reference camera.

    With a `tie` the surveyed tags take part from the start, and their frame is the rig's.

    Args:
        board_points_m: the board's corners, (n_points, 3).
        starts: every camera on its own; equal moments of two cameras are simultaneous.
        offsets_s: clock offsets to start from, (n_cameras,).
        line: times and pieces of the moments when the board moves: clocks are then estimated, and
            time is the first camera's; None for a board that rests at each moment.
        straighten: puts the corners right once the rig is nearly known (`calib.tags.tag_bend`).
        tie: surveyed tags, needed where cameras share no board.

    Raises:
        DataError: when the cameras do not share enough views.
    """
    views = joined_views([start.views for start in starts])
    poses = np.concatenate([start.T_camera_boards for start in starts])
    offsets = np.zeros(len(starts)) if offsets_s is None else offsets_s
    cameras = tuple(
        replace(start.camera, clock_offset_s=float(offset))
        for start, offset in zip(starts, offsets, strict=True)
    )
    views, moments = views.compacted()
    start = start_rig(cameras, board_points_m, views, poses, tie)
    scene, clocks = start.scene, line is not None
    fixed = None if tie is None else tie.fixed
    if fixed is not None:
        scene = place_in_base(scene, fixed)
    if line is not None:
        scene, views = in_pieces(scene, views, Timeline(line.times_s[moments], line.piece[moments]))
    free = free_unknowns(
        cameras,
        held_pose=start.reference if fixed is None else None,
        n_fixed=0 if fixed is None else len(fixed.points_base_m),
        warp=np.isfinite(shape_std_m(board_points_m)),
        clocks=clocks,
        held_clocks=frozenset(board_groups(len(cameras), views).tolist()),
    )
    dropped = tuple(drop for camera in starts for drop in camera.dropped)
    problem = Problem(board_points_m, views, fixed, free, shape_std_m(board_points_m))
    rig = refine(scene, problem, start.reference, dropped, roughly=straighten is not None)
    if clocks:
        rig = _without_idle_lines(rig)
    if straighten is not None:
        scene = rig.adjustment.scene
        problem = replace(rig.problem, views=straighten(scene, rig.problem.views))
        rig = refine(scene, problem, rig.reference, rig.dropped, rig.n_trimmed)
    return rig


def shape_std_m(board_points_m: Array) -> Array:
    """How far a board's shape is from its drawing before anything was seen: sags, growth, (3,).

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 3.3: a Gaussian prior; its sizes
        are shares of the board's.
    """
    board_points_m = board_points_m[: board_size(board_points_m)]
    modes = np.abs(shape_modes(board_points_m))
    plane = board_points_m[:, :2]
    extent = np.ptp(plane, axis=0)
    side = 0.0
    if modes[:, :, 2].any():
        tags = plane.reshape(-1, 4, 2)
        side = float(np.linalg.norm(tags[:, 1] - tags[:, 0], axis=1).mean())
    return np.array([*(SAG_STD * extent), GROWTH_STD * side if side else np.inf])


def reads_in_lines(line_time_s: float, std_s: float, rows: int) -> bool:
    """Whether a line time stands out, and from the first row to the last makes a difference."""
    stands_out = abs(line_time_s) > LINE_TIME_SIGMAS * std_s
    return stands_out and rows * abs(line_time_s) > LEAST_READOUT_S


def _without_idle_lines(rig: Rig) -> Rig:
    """Hold line times at zero where they do not stand out: most cameras have a global shutter."""
    free, scene = rig.problem.free.copy(), rig.adjustment.scene
    cameras = list(scene.cameras)
    for index, own in enumerate(camera_slices(scene.cameras)):
        last = own.stop - 1
        std = float(np.sqrt(rig.adjustment.covariance[last, last]))
        camera = cameras[index]
        if free[last] and not reads_in_lines(camera.line_time_s, std, camera.size_px[1]):
            free[last] = False
            cameras[index] = replace(cameras[index], line_time_s=0.0)
    if np.array_equal(free, rig.problem.free):
        return rig
    problem = replace(rig.problem, free=free)
    start = replace(scene, cameras=tuple(cameras))
    return refine(start, problem, rig.reference, rig.dropped, rig.n_trimmed)


def free_unknowns(
    cameras: tuple[Camera, ...],
    *,
    held_pose: int | None = None,
    n_fixed: int = 0,
    warp: bool | NDArray[np.bool_] = False,
    held_lenses: bool = False,
    clocks: bool = False,
    held_clocks: frozenset[int] = frozenset({0}),
) -> np.ndarray:
    """Which shared unknowns move: lenses, poses but one, base points, and warp if asked.

    With `clocks` every line time is free, and every clock offset but those of `held_clocks`: the
    first camera's of each group that shares boards.
    """
    slices = camera_slices(cameras)
    free = np.ones(slices[-1].stop + WARP + 3 * n_fixed, dtype=bool)
    for index, (camera, own) in enumerate(zip(cameras, slices, strict=True)):
        k = len(camera.params)
        free[own.start : own.start + k] = not held_lenses
        free[own.start + k : own.start + k + POSE] = index != held_pose
        free[own.stop - CLOCK : own.stop] = (clocks and index not in held_clocks, clocks)
    free[slices[-1].stop : slices[-1].stop + WARP] = warp
    return free


def refine(
    scene: Scene,
    problem: Problem,
    reference: int,
    dropped: tuple[DroppedView, ...] = (),
    n_trimmed: int = 0,
    *,
    roughly: bool = False,
) -> Rig:
    """Adjust, drop outlying views and corners, and adjust again until none is left.

    `roughly` leaves out the last steps, for a result that is to be refined again.
    """
    result = adjust(scene, problem, rounds=1, converged=ROUGHLY_CONVERGED)
    for _ in range(_MOST_SWEEPS):
        keep, limits, errors = _views_kept(result, problem)
        trimmed = _trimmed(result, problem)
        n_new = int(problem.views.seen.sum() - trimmed.seen.sum())
        enough = keep & (trimmed.seen.sum(axis=1) >= _LEAST_CORNERS)
        if enough.all() and n_new == 0:
            break
        dropped += tuple(
            DroppedView(problem.views.label[i], errors[i], limits[i], "px")
            for i in np.flatnonzero(~enough)
        )
        n_trimmed += int(problem.views.seen[enough].sum() - trimmed.seen[enough].sum())
        enough &= _determined(trimmed.select(enough), result.scene)[trimmed.piece]
        views, pieces = trimmed.select(enough).compacted()
        problem = replace(problem, views=views)
        result = adjust(
            result.scene.pieces(pieces),
            problem,
            result.sigma_px,
            rounds=1,
            converged=ROUGHLY_CONVERGED,
        )
    if not roughly:
        result = adjust(result.scene, problem, result.sigma_px, rounds=1)
    return Rig(result, problem, reference, dropped, n_trimmed)


def _views_kept(result: Adjustment, problem: Problem) -> tuple[np.ndarray, Array, Array]:
    """Views whose error stays near what is usual in their camera; limits and errors, px.

    The error is the median corner's, each axis: one bad corner is trimmed, not the whole view.
    """
    lengths = np.linalg.norm(result.residuals_px, axis=-1)
    errors = np.nanmedian(lengths, axis=1) / MEDIAN_OF_RAYLEIGH
    limits = np.zeros(len(errors))
    for index in range(len(result.scene.cameras)):
        own = problem.views.camera == index
        if own.any():
            usual = max(float(np.median(errors[own])), float(result.sigma_px[index]))
            limits[own] = max(VIEW_OUTLIER_SIGMAS * usual, VIEW_OUTLIER_FLOOR_PX)
    return errors <= limits, limits, errors


def _determined(views: Views, scene: Scene) -> np.ndarray:
    """Whether a piece still has as many moments as its motion has coefficients, (n_pieces,)."""
    pairs = np.unique(np.stack([views.piece, views.moment]), axis=1)
    moments = np.bincount(pairs[0], minlength=len(scene.motion))
    rests = np.bincount(views.piece, np.isnan(views.lag_s), len(scene.motion)) > 0
    return moments > np.where(rests, 0, scene.motion.shape[1])


def _trimmed(result: Adjustment, problem: Problem) -> Views:
    """The views with far-off corners blanked, all that were found together."""
    views = problem.views
    white = views.whitened(result.residuals_px)
    limit = length_with_share(CORNER_WITHIN, white.shape[-1]) * result.sigma_px[views.camera]
    with np.errstate(invalid="ignore"):
        far = np.linalg.norm(white, axis=-1) > limit[:, None]
    far = np.repeat(far, views.group_size, axis=1)
    return replace(views, pixels=np.where(far[..., None], np.nan, views.pixels))


def tie_to_base(rig: Rig, fixed: FixedPoints, *, estimate_survey: bool = True) -> Rig:
    """The rig in the base frame, surveyed points adjusted with everything else.

    Args:
        rig: solved in its own frame.
        fixed: surveyed points and their sightings.
        estimate_survey: measure the survey's noise from how it fits, instead of taking it as given.
    """
    scene = place_in_base(rig.adjustment.scene, fixed)
    shared = camera_slices(scene.cameras)[-1].stop + WARP
    tied = np.ones(3 * len(fixed.points_base_m), dtype=bool)
    free = np.concatenate([rig.problem.free[:shared], tied])
    held = scene.cameras[rig.reference]
    first = camera_slices(scene.cameras)[rig.reference].start + len(held.params)
    free[first : first + POSE] = True
    problem = replace(rig.problem, fixed=fixed, free=free)
    result = adjust(scene, problem, rig.adjustment.sigma_px, rounds=1)
    for _ in range(_SURVEY_ROUNDS if estimate_survey else 1):
        if estimate_survey:
            std = _survey_std(result, fixed)
            fixed = replace(fixed, std_m=np.full(len(fixed.std_m), std))
            problem = replace(problem, fixed=fixed)
        result = adjust(result.scene, problem, result.sigma_px, rounds=1)
    return replace(rig, adjustment=result, problem=problem)


def _survey_std(result: Adjustment, fixed: FixedPoints) -> float:
    """Standard deviation of a surveyed coordinate from the corrections the cameras ask for.

    Variance component estimation: squared corrections over the redundancy that carries them
    (Foerstner and Wrobel 2016, sec. 4.2.4). Few corrections leave the given value nearly alone:
    it counts as `_SURVEY_PRIOR` corrections of its own.
    """
    correction = result.scene.base_points_m - fixed.points_base_m
    given = float(fixed.std_m.mean())
    own = slice(len(result.covariance) - correction.size, None)
    left = np.diag(result.covariance)[own] / given**2
    redundancy = max(float(correction.size - left.sum()), 0.0)
    total = float(np.sum(correction**2)) + _SURVEY_PRIOR * given**2
    return max(np.sqrt(total / (redundancy + _SURVEY_PRIOR)), LEAST_SURVEY_STD_M)
