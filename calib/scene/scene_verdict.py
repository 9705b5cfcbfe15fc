"""May cameras that were tied by the laboratory's features be used, and how well are they known."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import PARAMETER_NAMES, Array
from freeswing.calib.rig.bundle_adjustment import ROUGHLY_CONVERGED, Adjustment, adjust
from freeswing.calib.rig.reprojection import camera_slices
from freeswing.calib.rig.solve_rig import Rig
from freeswing.calib.rig.triangulation import triangulate
from freeswing.calib.scene.scene_rig import rig_part
from freeswing.calib.verdict.halves_and_lengths import rigidly_fitted, volume_std_m
from freeswing.calib.verdict.limits_of_use import (
    GOOD_FILLED,
    GOOD_FOCAL_STD,
    GOOD_VOLUME_M,
    LEAST_FILLED,
    WORST_FOCAL_STD,
    WORST_PX,
    WORST_VOLUME_M,
    Finding,
    high,
    low,
    refused,
)
from freeswing.cdpr.rotation import log_rotation

# Fourteen unknowns of a camera: 40 points of two numbers determine them with some to spare.
LEAST_POINTS = 40  # three numbers each, for the fourteen of a camera with its lens, ten times over
GOOD_POINTS = 200
_GRID = 4
_VOLUME_POINTS = 200


@dataclass(frozen=True, slots=True)
class SceneChecks:
    """What a calibration by features is worth.

    Attributes:
        growth: by how much claimed deviations have to grow, from the halves; at least 1.
        halves_shape_rms_m: rms distance of volume points between the two halves' cameras, after
            the best rigid fit and scale; NaN without such points.
        volume_std_m: rms standard deviation of volume points, by the grown covariance.
        volume_size_m: extent of the volume, (3,).
        filled: share of each camera's image that has points, (n,).
        points: how many each camera sees, (n,).
    """

    growth: float
    halves_shape_rms_m: float
    volume_std_m: float
    volume_size_m: Array
    filled: Array
    points: np.ndarray


def halves_of(rig: Rig, count: int, *, by_size: bool = False) -> tuple[Adjustment, Adjustment]:
    """Two adjustments that share no point: those of even and of odd number.

    With `by_size` those of the smaller and of the larger blobs, after which points are numbered:
    what moves the middles of blobs moves those of large ones more.
    """
    found = []
    number = rig.problem.views.piece
    second = number > np.median(number) if by_size else number % 2 == 1
    for parity in (False, True):
        views, pieces = rig.problem.views.select(second == parity).compacted()
        problem = replace(rig.problem, views=views)
        start = rig.adjustment.scene.pieces(pieces)
        sigma = rig.adjustment.sigma_px
        result = adjust(start, problem, sigma, rounds=1, converged=ROUGHLY_CONVERGED)
        half = Rig(result, problem, rig.reference, (), 0)
        found.append(rig_part(half, count).adjustment)
    return found[0], found[1]


def can_be_halved_by_size(rig: Rig, count: int) -> bool:
    """Whether smaller and larger blobs are enough for a lens in each of the rig's `count` cameras.

    Images of the walk, whose lens is one, need a fourth of that for their poses.
    """
    views = rig.problem.views
    second = views.piece > np.median(views.piece)
    wanted = np.where(np.arange(len(rig.cameras)) < count, LEAST_POINTS, LEAST_POINTS / 4)
    return all(
        (np.bincount(views.camera[half], minlength=len(wanted)) >= wanted).all()
        for half in (second, ~second)
    )


def growth_of(first: Adjustment, second: Adjustment, free: np.ndarray) -> float:
    """Deviations between two independent halves over what they claim, at least 1.

    Errors of features are no white noise: nearby views err alike, and matches have tails.

    Args:
        first: one half.
        second: the other, in the same frame and scale.
        free: unknowns that moved, (p,).
    """
    end = camera_slices(first.scene.cameras)[-1].stop
    own = np.flatnonzero(free[:end])
    change = _between(first.scene.cameras, second.scene.cameras)[own]
    covariance = (first.covariance + second.covariance)[np.ix_(own, own)]
    scale = np.sqrt(np.diag(covariance))
    white = np.linalg.solve(covariance / np.outer(scale, scale), change / scale)
    return max(1.0, float(np.sqrt(change / scale @ white / len(own))))


def _between(first: tuple[Camera, ...], second: tuple[Camera, ...]) -> Array:
    parts = []
    for a, b in zip(first, second, strict=True):
        shift = b.T_camera_base[:3, 3] - a.T_camera_base[:3, 3]
        turn = log_rotation(b.T_camera_base[:3, :3] @ a.T_camera_base[:3, :3].T)
        parts += [b.params - a.params, shift, turn, np.zeros(2)]
    return np.concatenate(parts)


def grown(rig: Rig, growth: float) -> Rig:
    """The rig with deviations that are `growth` times larger."""
    covariance = rig.adjustment.covariance * growth**2
    return replace(rig, adjustment=replace(rig.adjustment, covariance=covariance))


def check_scene(rig: Rig, halves: tuple[Adjustment, Adjustment], growth: float) -> SceneChecks:
    """What is known of a rig whose deviations have been grown.

    Args:
        rig: the cameras of the rig alone, in metres.
        halves: the same by two halves of the points, in a scale of their own.
        growth: what `growth_of` says of them.
    """
    points = _volume(rig)
    views = rig.problem.views
    count = np.bincount(views.camera, minlength=len(rig.cameras))
    filled = [
        _filled(camera, views.pixels[views.camera == k, 0]) for k, camera in enumerate(rig.cameras)
    ]
    shape = np.nan
    if len(points) >= 4:
        pixels = np.stack([_seen(camera, points) for camera in rig.cameras])
        a, b = (triangulate(half.scene.cameras, pixels) for half in halves)
        good = np.isfinite(a[:, 0]) & np.isfinite(b[:, 0])
        if good.sum() >= 4:
            shape = _shape(a[good], b[good], points[good])
    return SceneChecks(
        growth,
        shape,
        volume_std_m(rig.adjustment, points) if len(points) else np.nan,
        np.ptp(points, axis=0) if len(points) else np.zeros(3),
        np.array(filled),
        count,
    )


def _shape(first: Array, second: Array, true: Array) -> float:
    """Rms difference of two shapes in metres, their scales apart."""

    def size(x: Array) -> float:
        return float(np.sqrt(np.sum((x - x.mean(axis=0)) ** 2)))

    a = first * (size(true) / size(first))
    b = second * (size(true) / size(second))
    return float(np.sqrt(np.mean(np.sum((b - rigidly_fitted(a, b)) ** 2, axis=1))))


def _volume(rig: Rig) -> Array:
    """Points half-way to what the cameras see, as far as two of them look there, (n, 3)."""
    views, places = rig.problem.views, rig.adjustment.scene.T_base_boards[:, :3, 3]
    eyes = np.array([camera.position_base_m for camera in rig.cameras])
    middle = 0.5 * (places[views.piece] + eyes[views.camera])
    few = np.unique(np.linspace(0, len(middle) - 1, 4 * _VOLUME_POINTS).round().astype(int))
    middle = middle[few]
    seen = np.sum([np.isfinite(_seen(c, middle)[:, 0]) for c in rig.cameras], axis=0)
    middle = middle[seen >= 2]
    few = np.unique(np.linspace(0, len(middle) - 1, _VOLUME_POINTS).round().astype(int))
    return middle[few] if len(middle) else np.zeros((0, 3))


def _seen(camera: Camera, points: Array) -> Array:
    inside = camera.to_camera(points)
    return np.where(camera.sees(inside)[:, None], camera.project(inside), np.nan)


def _filled(camera: Camera, pixels: Array) -> float:
    """Share of a grid's cells in which the camera sees a point."""
    cells = np.clip((pixels / np.array(camera.size_px) * _GRID).astype(int), 0, _GRID - 1)
    return len(np.unique(cells @ [1, _GRID])) / _GRID**2


def judge_scene(rig: Rig, checks: SceneChecks) -> list[Finding]:
    """What warns of, or refuses, the cameras of a rig."""
    said: list[Finding | None] = []
    slices = camera_slices(rig.cameras)
    deviations = np.sqrt(np.diag(rig.adjustment.covariance))
    for k, camera in enumerate(rig.cameras):
        name, n, filled = f"camera {camera.name}", int(checks.points[k]), float(checks.filled[k])
        sigma = float(rig.adjustment.sigma_px[k])
        lenses = 1 if PARAMETER_NAMES[camera.model][0] == "f" else 2
        std = deviations[slices[k]][:lenses] / camera.params[:lenses]
        focal = float(np.max(std))
        walk = "walk to where you see the same from a little aside, and put posters on bare walls"
        said += [
            low(
                (n, GOOD_POINTS, LEAST_POINTS),
                f"{name}: {n} points of the laboratory, want {GOOD_POINTS} (least "
                f"{LEAST_POINTS}): {walk}",
            ),
            low(
                (filled, GOOD_FILLED, LEAST_FILLED),
                f"{name}: points in {100 * filled:.0f} % of the image, want "
                f"{100 * GOOD_FILLED:.0f} % (least {100 * LEAST_FILLED:.0f} %): {walk}",
            ),
            high(
                (focal, GOOD_FOCAL_STD, WORST_FOCAL_STD),
                f"{name}: focal length known to {100 * focal:.2g} %, want "
                f"{100 * GOOD_FOCAL_STD:.2g} % (worst {100 * WORST_FOCAL_STD:.2g} %): {walk}",
            ),
            refused(
                sigma > WORST_PX,
                f"{name}: points lie {sigma:.1f} px off, limit {WORST_PX} px: the lens is no "
                f"{camera.model}, the focus changed, or the laboratory did",
            ),
        ]
    limits = f"want {1e3 * GOOD_VOLUME_M:.0f} mm (worst {1e3 * WORST_VOLUME_M:.0f} mm)"
    more = "take more stills on the walk, from all around, and survey more points"
    said += [
        high(
            (checks.halves_shape_rms_m, GOOD_VOLUME_M, WORST_VOLUME_M),
            f"two halves of the points disagree by {1e3 * checks.halves_shape_rms_m:.2f} mm, "
            f"{limits}: {more}",
        ),
        high(
            (checks.volume_std_m, GOOD_VOLUME_M, WORST_VOLUME_M),
            f"points before the cameras are known to {1e3 * checks.volume_std_m:.2f} mm, "
            f"{limits}: {more}",
        ),
    ]
    return [finding for finding in said if finding is not None]
