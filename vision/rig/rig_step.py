"""Finds what the calibration did not say: late clocks, rolling shutters, cameras that moved.

A camera has moved when the tags that stand in the base are not where its calibration puts them.
Clocks and line times follow from the platform's own swing: a camera that is late sees it where it
was. All are estimated together, the platform's poses eliminated, and applied to the cameras.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.tags.base_tags import SURVEY_STD_M
from freeswing.cdpr.measured.leaving_out import leaving_out_std
from freeswing.vision.fuse.blocks import blocks
from freeswing.vision.fuse.corner_noise import whitened
from freeswing.vision.fuse.fuse_cameras import Fit, fuse
from freeswing.vision.fuse.linearised_block import linearised
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.rig.moved_cameras import base_equations, moved_by
from freeswing.vision.rig.rig_kernels import (
    CLOCK,
    LINE,
    PER_CAMERA,
    POSE,
    RigEquations,
    RigSightings,
    add_rig_equations,
)

Array = NDArray[np.float64]

# twenty deviations: late clocks and knocks do so much, what does more is misread
_KEEP_SCORE = 400.0
# A quarter of a swing: what squeezed pictures do to a tag goes with its place and tilt.
STRETCH_S = 0.25
LEAST_PARTS = 4  # two cameras with two tags each; of fewer one part decides alone
_STEPS, _MOST_STEPS = 3, 20
_SETTLED = 0.3
"""Steps go on while one changes a number by more than this share of its deviation."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One camera's effect.

    Attributes:
        effect: `clock_offset`, `clock_rate`, `rolling_shutter`, `camera_moved` or `lost_frames`.
        camera: its name.
        parameters: (name, value, standard deviation).
    """

    effect: str
    camera: str
    parameters: tuple[tuple[str, float, float], ...]


@dataclass(frozen=True, slots=True)
class RigStep:
    """One Gauss-Newton step of the rig: changes (n_c, 8) and their standard deviations."""

    changes: Array
    deviations: Array
    covariance: Array


def rig_step(
    views: Sequence[CameraViews],
    watch: Watch,
    poses: Poses,
    fit: Fit,
    free: NDArray[np.bool_],
    survey_std_m: float = SURVEY_STD_M,
    *,
    told: bool = True,
    plain: bool = False,
) -> RigStep:
    """Solves for the rig's numbers marked in `free` (n_c, 8), the poses eliminated.

    Squeezed pictures err alike from frame to frame, each tag in its own way: deviations are those
    of leaving out one stretch of the recording, or one tag of one camera, at a time where these
    are larger; without `told` those of the equations alone. `plain` is that of `fuse`.
    """
    n_c = len(views)
    size = PER_CAMERA * n_c
    parts, others = _equations(views, watch, poses, fit, told, pixels_alone=plain)
    normal = sum((part.normal for part in parts), np.zeros((size, size)))
    right = sum((part.right for part in parts), np.zeros(size))
    for index, view in enumerate(views):
        more, also = base_equations(view, watch, survey_std_m)
        span = slice(PER_CAMERA * index + POSE, PER_CAMERA * (index + 1))
        normal[span, span] += more
        right[span] += also
    mask = free.ravel()
    changes, deviations = np.zeros(size), np.zeros(size)
    whole = np.zeros((size, size))
    if mask.any():
        chosen = np.ix_(mask, mask)
        inverse = _inverse(normal[chosen])
        changes[mask] = inverse @ right[mask]
        excess = max(fit.total[0] / max(fit.total[1], 1), 1.0)
        own = np.sqrt(np.diag(inverse) * excess)
        larger = own
        for left in (parts, others) if told else ():
            without = [
                _inverse((normal - one.normal)[chosen]) @ (right - one.right)[mask] for one in left
            ]
            larger = np.maximum(larger, leaving_out(np.array(without).reshape(-1, mask.sum())))
        times = np.divide(larger, own, out=np.ones_like(own), where=own > 0.0)  # 0: saw nothing
        whole[chosen] = inverse * excess * np.outer(times, times)
        deviations[mask] = larger
    return RigStep(changes.reshape(n_c, PER_CAMERA), deviations.reshape(n_c, PER_CAMERA), whole)


def _equations(
    views: Sequence[CameraViews],
    watch: Watch,
    poses: Poses,
    fit: Fit,
    by_tags: bool,
    *,
    pixels_alone: bool,
) -> tuple[list[RigEquations], list[RigEquations]]:
    """The rig's equations of each stretch, and what is lost of all without each camera's tag."""
    size = PER_CAMERA * len(views)
    offsets = np.array([v.camera.T_camera_base[:3, 3] for v in views])
    nothing = RigEquations(np.zeros((size, size)), np.zeros(size))
    by_stretch: dict[int, RigEquations] = {}
    by_tag: dict[tuple[int, int], RigEquations] = {}
    stretch_of = stretches(poses.times_s)
    for block in blocks(views, watch, poses.times_s, poses, pixels_alone=pixels_alone):
        span = slice(block.first, block.first + len(block.starts) - 1)
        known = poses.known[span] & (np.abs(poses.motions[span]).sum(axis=1) > 0.0)
        instant = np.repeat(np.arange(len(known)), np.diff(block.starts))
        linear = linearised(block, views, poses)
        white = whitened(block, fit.noise, views)
        scores = (np.einsum("oij,oj->oi", white, linear.residuals) ** 2).sum(axis=1) / (
            2 * block.counts
        )
        weights = np.where(known[instant], 1.0 / np.maximum(1.0, scores / _KEEP_SCORE) ** 2, 0.0)
        rows = block.camera_of, block.counts, block.rows_px, white
        whole = nothing
        for stretch in np.unique(stretch_of[span]).tolist():
            there = known & (stretch_of[span] == stretch)
            seen = RigSightings(block.starts, there, *rows, weights)
            part = add_rig_equations(nothing, seen, linear, offsets)
            by_stretch[stretch] = _sum(by_stretch.get(stretch, nothing), part)
            whole = _sum(whole, part)
        tags = {*zip(block.camera_of, block.things, strict=True)} if by_tags else set()
        for camera, thing in sorted(tags):
            own = (block.camera_of == camera) & (block.things == thing)
            seen = RigSightings(block.starts, known, *rows, np.where(own, 0.0, weights))
            rest = add_rig_equations(nothing, seen, linear, offsets)
            lost = RigEquations(whole.normal - rest.normal, whole.right - rest.right)
            name = int(camera), int(thing)
            by_tag[name] = _sum(by_tag.get(name, nothing), lost)
    return list(by_stretch.values()), list(by_tag.values())


def _sum(one: RigEquations, other: RigEquations) -> RigEquations:
    return RigEquations(one.normal + other.normal, one.right + other.right)


def stretches(times_s: Array) -> NDArray[np.int64]:
    """Which stretch of the recording each instant is in, (n,).

    Source:
        Kuensch 1989, The Jackknife and the Bootstrap for General Stationary Observations, sec. 2.
    """
    return np.floor((times_s - times_s.min(initial=np.inf)) / STRETCH_S).astype(np.int64)


def leaving_out(without: Array) -> Array:
    """Deviations of numbers by what they are without each of some parts, (g, k) to (k,).

    Fewer than `LEAST_PARTS` tell nothing: zero.

    Source:
        Kuensch 1989, The Jackknife and the Bootstrap for General Stationary Observations, sec. 2.
    """
    if len(without) < LEAST_PARTS:
        return np.zeros(without.shape[-1])
    return leaving_out_std(without)


def _inverse(normal: Array) -> Array:
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    inverse = np.linalg.pinv(normal / np.outer(scale, scale), rcond=1e-10, hermitian=True)
    return inverse / np.outer(scale, scale)


def applied(view: CameraViews, change: Array) -> CameraViews:
    """The camera with its eight numbers changed."""
    camera = moved_by(view.camera, change[POSE:])
    camera = replace(
        camera,
        clock_offset_s=camera.clock_offset_s + float(change[CLOCK]),
        line_time_s=camera.line_time_s + float(change[LINE]),
    )
    return view.believed(camera)


def iterated(
    current: list[CameraViews],
    watch: Watch,
    poses: Poses,
    fit: Fit,
    free: NDArray[np.bool_],
    total: Array,
    survey_std_m: float,
    *,
    told: bool = True,
    plain: bool = False,
) -> RigStep:
    """Gauss-Newton over rig and poses in turn; `current` and `total` are brought up to date.

    Without `told` the deviations are those of the equations alone; `plain` is that of `fuse`.
    """
    done = 0
    while True:
        step = rig_step(current, watch, poses, fit, free, survey_std_m, told=False, plain=plain)
        done += 1
        settled = bool((np.abs(step.changes) <= _SETTLED * step.deviations).all())
        last = done == _MOST_STEPS or (settled and done >= _STEPS)
        if last and told:
            step = rig_step(current, watch, poses, fit, free, survey_std_m)
        for index, change in enumerate(step.changes):
            current[index] = applied(current[index], change)
        total += step.changes
        if last:
            return step
        poses, fit = fuse(
            current, watch, poses.times_s, start=poses, passes=2, rough=True, plain=plain
        )


def frame_squares_px2(views: Sequence[CameraViews], watch: Watch, poses: Poses) -> dict[int, float]:
    """Mean square residual of the last camera's frames at instants that another sees too."""
    last = len(views) - 1
    focal = float(views[last].camera.focal_px.mean())
    squares: dict[int, float] = {}
    for block in blocks(views, watch, poses.times_s, poses):
        residuals = linearised(block, views, poses).residuals
        instant = np.repeat(np.arange(len(block.starts) - 1), np.diff(block.starts))
        others = np.unique(instant[block.camera_of != last])
        mine = (block.camera_of == last) & np.isin(instant, others)
        sums = (residuals[mine] ** 2).sum(axis=1) * focal**2
        for frame in np.unique(block.frames[mine]).tolist():
            own = block.frames[mine] == frame
            squares[int(frame)] = float(sums[own].sum() / (2 * block.counts[mine][own]).sum())
    return squares
