"""A rig of cameras from the board's sightings: start, adjust, drop what does not belong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.board.motion_pieces import Timeline, in_pieces
from freeswing.calib.board.platform_as_board import PlatformTags
from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.intrinsics import CameraStart, start_camera
from freeswing.calib.camera.lens_models import Array
from freeswing.calib.camera.off_plane_views import DroppedView
from freeswing.calib.rig.board_sag_and_growth import shape_std_m
from freeswing.calib.rig.bundle_adjustment import (
    ROUGHLY_CONVERGED,
    Adjustment,
    adjust,
)
from freeswing.calib.rig.line_times import reads_in_lines
from freeswing.calib.rig.normal_equations import Problem
from freeswing.calib.rig.outliers import (
    LEAST_CORNERS,
    determined_pieces,
    views_kept,
    without_far_corners,
)
from freeswing.calib.rig.reprojection import Scene, camera_slices
from freeswing.calib.rig.reprojection_kernels import CLOCK, POSE, WARP
from freeswing.calib.rig.survey_noise import survey_std
from freeswing.calib.rig.tie_by_shared_boards import BaseTie, board_groups, place_in_base, start_rig
from freeswing.calib.rig.views import FixedPoints, Views, joined_views

_MOST_SWEEPS = 3
_SURVEY_ROUNDS = 3


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
        platform: the platform's tags where they take part beside the board, else None.
    """

    adjustment: Adjustment
    problem: Problem
    reference: int
    dropped: tuple[DroppedView, ...]
    n_trimmed: int
    guessed_clocks: tuple[str, ...] = ()
    platform: PlatformTags | None = None

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """The calibrated cameras."""
        return self.adjustment.scene.cameras

    @property
    def is_tied_by_swings(self) -> bool:
        """Whether the platform's tags take part beside the board."""
        return self.platform is not None


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
    layout_std_m: Array | None = None,
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
        tie: surveyed tags and points, needed where cameras share no board.
        layout_std_m: how far each tag of the platform may be from its drawing, (n_tags,); none
            takes part when None.

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
    layout = np.zeros(0) if layout_std_m is None else layout_std_m
    shape_std = np.concatenate([shape_std_m(board_points_m), np.repeat(layout, 6)])
    free = free_unknowns(
        cameras,
        held_pose=start.reference if fixed is None else None,
        n_fixed=0 if fixed is None else len(fixed.points_base_m),
        warp=np.isfinite(shape_std),
        clocks=clocks,
        held_clocks=frozenset(board_groups(len(cameras), views).tolist()),
    )
    dropped = tuple(drop for camera in starts for drop in camera.dropped)
    problem = Problem(board_points_m, views, fixed, free, shape_std)
    rig = refine(scene, problem, start.reference, dropped, roughly=straighten is not None)
    if clocks:
        rig = _without_idle_lines(rig)
    if straighten is not None:
        scene = rig.adjustment.scene
        problem = replace(rig.problem, views=straighten(scene, rig.problem.views))
        rig = refine(scene, problem, rig.reference, rig.dropped, rig.n_trimmed)
    return rig


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
    """Which shared unknowns move: lenses, poses but one, base points, and shapes if asked.

    With `clocks` every line time is free, and every clock offset but those of `held_clocks`: the
    first camera's of each group that shares boards.
    """
    slices = camera_slices(cameras)
    shape = np.broadcast_to(warp, WARP) if isinstance(warp, bool) else warp
    free = np.ones(slices[-1].stop + len(shape) + 3 * n_fixed, dtype=bool)
    for index, (camera, own) in enumerate(zip(cameras, slices, strict=True)):
        k = len(camera.params)
        free[own.start : own.start + k] = not held_lenses
        free[own.start + k : own.start + k + POSE] = index != held_pose
        free[own.stop - CLOCK : own.stop] = (clocks and index not in held_clocks, clocks)
    free[slices[-1].stop : slices[-1].stop + len(shape)] = shape
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
        keep, limits, errors = views_kept(result, problem)
        trimmed = without_far_corners(result, problem)
        n_new = int(problem.views.seen.sum() - trimmed.seen.sum())
        enough = keep & (trimmed.seen.sum(axis=1) >= LEAST_CORNERS)
        if enough.all() and n_new == 0:
            break
        dropped += tuple(
            DroppedView(problem.views.label[i], errors[i], limits[i], "px")
            for i in np.flatnonzero(~enough)
        )
        n_trimmed += int(problem.views.seen[enough].sum() - trimmed.seen[enough].sum())
        enough &= determined_pieces(trimmed.select(enough), result.scene)[trimmed.piece]
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


def tie_to_base(rig: Rig, fixed: FixedPoints, unstated: NDArray[np.bool_] | None = None) -> Rig:
    """The rig in the base frame, surveyed points adjusted with everything else.

    Args:
        rig: solved in its own frame.
        fixed: surveyed points and their sightings.
        unstated: points whose survey's noise is measured from how it fits, instead of taken as
            given, (n,); all when None.
    """
    if unstated is None:
        unstated = np.ones(len(fixed.std_m), dtype=bool)
    scene = place_in_base(rig.adjustment.scene, fixed)
    shared = camera_slices(scene.cameras)[-1].stop + len(scene.warp_m)
    tied = np.ones(3 * len(fixed.points_base_m), dtype=bool)
    free = np.concatenate([rig.problem.free[:shared], tied])
    held = scene.cameras[rig.reference]
    first = camera_slices(scene.cameras)[rig.reference].start + len(held.params)
    free[first : first + POSE] = True
    problem = replace(rig.problem, fixed=fixed, free=free)
    result = adjust(scene, problem, rig.adjustment.sigma_px, rounds=1)
    for _ in range(_SURVEY_ROUNDS if unstated.any() else 1):
        if unstated.any():
            std = survey_std(result, fixed, unstated)
            fixed = replace(fixed, std_m=np.where(unstated, std, fixed.std_m))
            problem = replace(problem, fixed=fixed)
        result = adjust(result.scene, problem, result.sigma_px, rounds=1)
    return replace(rig, adjustment=result, problem=problem)
