"""Patches of a plane laid over other views of it, rendered from a formula."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.rotation import exp_rotation, transform
from freeswing.vision.untagged.aligned_patches import (
    HALF_PX,
    Patches,
    SmoothImage,
    align,
    align_seen,
    cut,
    normals_of,
    overlap,
    tangents_of,
)
from tests.vision.untagged import boxes

CAMERAS = boxes.cameras()
FACE = np.array([1.0, 0.0, 0.0])  # out of the plane x = 0 of the platform
REST = transform(np.eye(3), boxes.HOME_M)
WAVES = 2 * np.pi * np.random.default_rng(7).normal(0.0, 45.0, (60, 2))  # rad a metre
PHASES = np.random.default_rng(8).uniform(0.0, 6.0, 60)


def spots(count: int, rng: np.random.Generator) -> np.ndarray:
    """Places on the face, (n, 3)."""
    return np.c_[np.zeros(count), rng.uniform(-0.08, 0.08, (count, 2))]


def picture(camera: Camera, T_base_platform: np.ndarray, noise: float = 0.0, seed: int = 1):
    """What a camera sees of the plane, grey 110 +- 30, about the platform's middle."""
    T = camera.T_camera_base @ T_base_platform
    u, v = camera.project(T[:3, 3]).round().astype(int)
    left, top = int(u) - 110, int(v) - 110
    grid = np.stack(np.meshgrid(np.arange(220.0) + left, np.arange(220.0) + top), axis=-1)
    rays = np.concatenate([camera.normalise(grid), np.ones((220, 220, 1))], axis=-1) @ T[:3, :3]
    eye = -T[:3, :3].T @ T[:3, 3]
    on = eye + rays * (-eye[0] / rays[..., :1])
    waves = np.cos(on[..., 1:] @ WAVES.T + PHASES)
    grey = 110.0 + 30.0 * waves.sum(axis=-1) / np.sqrt(30.0)
    grey += noise * np.random.default_rng(seed).normal(size=grey.shape)
    return SmoothImage.of(np.clip(grey, 0.0, 255.0), left, top)


def cut_from(camera: Camera, points: np.ndarray, noise: float = 0.0) -> Patches:
    T = camera.T_camera_base @ REST
    normals = np.tile(FACE, (len(points), 1))
    pixels = camera.project(points @ T[:3, :3].T + T[:3, 3])
    greys, gain = cut(picture(camera, REST, noise), pixels)
    return Patches(greys, gain, tangents_of(camera, T, points, normals), normals)


def turned(angle_deg: float) -> np.ndarray:
    """Another pose: about the vertical, a nod, and 5 cm aside."""
    turn = exp_rotation(np.deg2rad([3.0, -4.0, angle_deg]))
    return transform(turn, boxes.HOME_M + np.array([-0.05, 0.03, 0.02]))


def seen_from_aside(noise: float, angle_deg: float, start_px: float = 0.8):
    """Patches of the middle camera in the left one's view of another pose: errors, told ones."""
    points = spots(60, np.random.default_rng(2))
    patches, camera = cut_from(CAMERAS[1], points, noise / 3.0), CAMERAS[0]
    T = camera.T_camera_base @ turned(angle_deg)
    image = picture(camera, turned(angle_deg), noise, 5)
    start = T.copy()
    start[:2, 3] += start_px / camera.focal_px * T[2, 3] / np.sqrt(2.0)
    rows, found = align_seen(patches, image, camera, start, points)
    true = camera.project(points[rows] @ T[:3, :3].T + T[:3, 3])
    return found.pixels - true, found.std_px, len(rows)


@pytest.mark.parametrize("angle_deg", [-20.0, 0.0, 15.0])
def test_a_spot_is_where_it_is_from_wherever_it_is_looked_at(angle_deg) -> None:
    """Up to 42 degrees apart: the middle of a blob moves by 0.2 px, a patch by a hundredth."""
    off, _, count = seen_from_aside(0.0, angle_deg)
    assert count > 50, count
    rms = np.sqrt(np.mean(off**2))
    assert rms < 0.012, rms


def test_told_deviations_hold() -> None:
    """Greys of noise 4 on contrast 30: 60 spots of two numbers each, whose rms is known to 7 %."""
    off, told, count = seen_from_aside(4.0, 0.0)
    assert count > 50, count
    z = off / told[:, None]
    assert 0.75 < np.sqrt(np.mean(z**2)) < 1.3, np.sqrt(np.mean(z**2, axis=0))
    assert 0.005 < np.median(told) < 0.05, np.median(told)


@pytest.mark.parametrize(("off_px", "found"), [(2.7, True), (3.3, False)])
def test_beyond_three_pixels_it_is_another_patch(off_px, found) -> None:
    grid = np.stack(np.meshgrid(np.arange(80.0), np.arange(80.0)), axis=-1)
    hill = 100.0 + 90.0 * np.exp(-((grid - 40.0) ** 2).sum(axis=-1) / 2.0 / 8.0**2)
    image, middle = SmoothImage.of(hill), np.array([[40.0, 40.0]])
    greys, gain = cut(image, middle)
    gain[:, [0, 1, 3, 4]] = 0.0  # a round hill tells no turn
    patch = Patches(greys, gain, np.zeros((1, 3, 2)), np.zeros((1, 3)))
    _, good = align(patch, image, np.eye(2)[None], middle + np.array([off_px, 0.0]))
    assert bool(good[0]) == found


@pytest.mark.parametrize(("likeness", "found"), [(0.8, False), (0.9, True)])
def test_another_print_is_not_the_same_patch(likeness, found) -> None:
    """Its greys changed by what no warp explains, until they correlate so."""
    points = spots(1, np.random.default_rng(4))
    patch = cut_from(CAMERAS[1], points)
    basis = np.concatenate([patch.greys[0][None], np.linalg.pinv(patch.gain[0]).T])
    other = np.random.default_rng(6).normal(size=patch.greys.shape[1])
    other -= other.mean()
    other -= basis.T @ np.linalg.lstsq(basis.T, other, rcond=None)[0]
    other /= np.linalg.norm(other)
    mixed = likeness * patch.greys[0] + np.sqrt(1.0 - likeness**2) * other
    side = 2 * HALF_PX + 1
    wide = np.pad(mixed.reshape(side, side), 6, mode="edge")
    middle = np.full((1, 2), HALF_PX + 6.0)
    _, good = align(patch, SmoothImage.of(1e3 * wide), np.eye(2)[None], middle)
    assert bool(good[0]) == found


@pytest.mark.parametrize(("facing", "found"), [(0.23, False), (0.27, True)])
def test_a_plane_seen_too_aslant_shows_nothing(facing, found) -> None:
    points, camera = np.zeros((1, 3)), CAMERAS[1]
    patch = cut_from(camera, points)
    T = camera.T_camera_base @ REST
    sight = -T[:3, :3].T @ T[:3, 3]
    sight /= np.linalg.norm(sight)
    aside = np.cross(sight, [0.0, 0.0, 1.0])
    aside /= np.linalg.norm(aside)
    normal = facing * sight + np.sqrt(1.0 - facing**2) * aside
    leaning = Patches(patch.greys, patch.gain, patch.tangents, normal[None])
    rows, _ = align_seen(leaning, picture(camera, REST), camera, T, points)
    assert bool(len(rows)) == found


def test_points_tell_the_planes_they_lie_on() -> None:
    rng = np.random.default_rng(3)
    points = spots(40, rng) + 1e-4 * rng.normal(size=(40, 3))
    found = normals_of(points, np.tile([0.4, 0.5, -0.2], (40, 1)))
    assert (found @ FACE).min() > np.cos(np.deg2rad(2.0))
    np.testing.assert_allclose(normals_of(points, np.tile(-FACE, (40, 1))), -found)


def test_a_sum_over_patches_that_share_pixels_scatters_as_is_told() -> None:
    """White noise summed over patches of whole pixels: variance of the sum, by drawing it."""
    rng = np.random.default_rng(9)
    at = rng.integers(HALF_PX, 60 - HALF_PX, (12, 2))
    cover = np.zeros((60, 60))
    for u, v in at:
        cover[v - HALF_PX : v + HALF_PX + 1, u - HALF_PX : u + HALF_PX + 1] += 1.0
    sums = rng.normal(size=(4000, 3600)) @ cover.ravel()
    alone = 12 * (2 * HALF_PX + 1) ** 2
    assert overlap(at.astype(float)) == pytest.approx(np.var(sums) / alone, rel=0.1)
    assert overlap(np.array([[0.0, 0.0], [500.0, 0.0]])) == pytest.approx(1.0)
