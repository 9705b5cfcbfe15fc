"""The renderer against plain dense sampling of the same geometry."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import erf

from freeswing.vision.render.patterns import Sphere
from freeswing.vision.render.render_scene import Look, Renderer, Scene, still
from tests.vision.scenes import camera, facing, tag

CLEAN = Look(noise=0.0, texture=0.0, psf_px=0.7)
FINE = 8


def dense_image(view, patch, look, box) -> np.ndarray:
    """Grey values of one static patch on the plain background, by 8 x 8 point samples."""
    left, top, size = box
    pad = 4
    at = (np.arange((size + 2 * pad) * FINE) + 0.5) / FINE - 0.5 - pad
    u, v = np.meshgrid(left + at, top + at)
    rays = view.normalise(np.stack([u, v], axis=-1))
    T_camera_patch = view.T_camera_base @ patch.T_parent_patch
    plane = T_camera_patch[:3, [0, 1, 3]]
    local = np.concatenate([rays, np.ones((*u.shape, 1))], axis=-1) @ np.linalg.inv(plane).T
    x, y = local[..., 0] / local[..., 2], local[..., 1] / local[..., 2]
    rows, columns = patch.cells.shape
    c = np.floor((x / patch.size_m[0] + 0.5) * columns).astype(int)
    r = np.floor((0.5 - y / patch.size_m[1]) * rows).astype(int)
    inside = (c >= 0) & (c < columns) & (r >= 0) & (r < rows)
    cells = patch.cells[np.clip(r, 0, rows - 1), np.clip(c, 0, columns - 1)]
    light = np.where(inside, look.black + (look.white - look.black) * cells, look.background)
    scale = 1 / (np.sqrt(2) * look.psf_px)
    offset = (np.arange((2 * pad + 1) * FINE) + 0.5) / FINE - 0.5 - pad
    taps = erf((offset + 0.5) * scale) - erf((offset - 0.5) * scale)
    taps /= taps.sum()
    windows = np.lib.stride_tricks.sliding_window_view(light, taps.size, axis=1)[:, ::FINE] @ taps
    return np.lib.stride_tricks.sliding_window_view(windows, taps.size, axis=0)[::FINE] @ taps


def rendered(view, patch, look) -> np.ndarray:
    renderer = Renderer(view, Scene((patch,), still()), look)
    image = renderer._still.copy()
    renderer._draw(image, [patch], 0.0)
    return image.astype(float)


@pytest.mark.parametrize(("x", "z", "yaw"), [(-0.5, 0.35, 0.5)])
def test_corners_are_unbiased_against_dense_sampling(x, z, yaw) -> None:
    view = camera(position=(0.0, -1.6, 0.0))
    patch = tag(7, position=(x, 0.0, z), yaw=yaw, roll=0.3)  # point samples need slanted edges
    half = 0.065
    corners = np.array([[-half, half], [half, half], [half, -half], [-half, -half]])
    local = np.column_stack([corners, np.zeros(4), np.ones(4)])
    pixels = view.project(view.to_camera((local @ patch.T_parent_patch.T)[:, :3]))
    low = np.floor(pixels.min(axis=0)).astype(int) - 18
    size = int(np.ceil(np.ptp(pixels, axis=0).max())) + 36
    window = (slice(low[1], low[1] + size), slice(low[0], low[0] + size))
    image = rendered(view, patch, CLEAN)
    error = image[window] - dense_image(view, patch, CLEAN, (low[0], low[1], size))
    step = 1e-4
    shifts = []
    for axis in (0, 2):
        moved = patch.T_parent_patch.copy()
        moved[axis, 3] += step
        shifts.append((rendered(view, replace(patch, T_parent_patch=moved), CLEAN) - image)[window])
    moved_px = np.array([900.0, -905.0]) / 1.6 * step
    biases = []
    for corner in pixels:
        v, u = np.mgrid[window]
        near = np.hypot(u - corner[0], v - corner[1]) < 12
        design = np.stack([s[near] / p for s, p in zip(shifts, moved_px, strict=True)], axis=-1)
        biases.append(np.linalg.lstsq(design, error[near], rcond=None)[0])
    worst = np.abs(biases).max()
    assert worst < 0.003, f"corner bias {worst:.4f} px"
    assert np.abs(error).max() < 3.0, f"largest grey difference {np.abs(error).max():.2f}"


def test_a_patch_on_a_pixel_edge_keeps_the_centre_convention() -> None:
    """A patch whose border falls on the edge between pixels leaves them pure without blur."""
    view = camera(model="PINHOLE", params=[1000.0, 1000.0, 359.5, 287.5], position=(0.0, -1.0, 0.0))
    patch = replace(tag(0), cells=np.ones((1, 1)), size_m=(0.1, 0.1))
    image = rendered(view, patch, replace(CLEAN, psf_px=1e-3))
    row = image[287]
    assert np.isclose(row[310:410], 200.0, atol=0.01).all(), row[305:315]
    assert np.isclose(row[[308, 309, 410, 411]], 110.0, atol=0.01).all(), row[305:315]


def test_sphere_weighs_what_its_cone_covers() -> None:
    view = camera()
    ball = Sphere(np.array([0.2, 0.0, 0.1]), 0.02)
    renderer = Renderer(view, Scene((), still(), (ball,)), CLEAN)
    image = renderer._still.copy()
    renderer._draw_sphere(image, ball, 0.0)
    light = (image - 110.0) / (40.0 + 160.0 * 1.2 - 110.0)
    centre = view.to_camera(ball.position_m)
    distance = np.linalg.norm(centre)
    axis = centre / distance
    across = np.linalg.svd(axis[None])[2][1:]
    angle = np.linspace(0, 2 * np.pi, 4000, endpoint=False)
    limit = np.arcsin(0.01 / distance)
    cone = np.cos(limit) * axis + np.sin(limit) * (
        np.cos(angle)[:, None] * across[0] + np.sin(angle)[:, None] * across[1]
    )
    rim = view.project(cone)
    x, y = rim.T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    area = cross.sum() / 2
    centroid = ((rim + np.roll(rim, -1, axis=0)) * cross[:, None]).sum(axis=0) / (6 * area)
    v, u = np.mgrid[: image.shape[0], : image.shape[1]]
    found = np.array([(u * light).sum(), (v * light).sum()]) / light.sum()
    assert abs(light.sum() / abs(area) - 1) < 0.01, f"{light.sum()} of {area}"
    assert np.abs(found - centroid).max() < 0.005, f"{found - centroid}"


def test_same_seed_same_frames_and_other_frames_other_noise() -> None:
    scene = Scene((tag(),), still())
    first, second = (Renderer(camera(), scene, seed=3) for _ in range(2))
    assert (first.frame(0.0, 5) == second.frame(0.0, 5)).all()
    difference = first.frame(0.0, 6).astype(float) - second.frame(0.0, 5)
    spread = difference.std() / np.sqrt(2)
    assert abs(spread - 2.02) < 0.05, f"noise {spread:.3f}"


def test_rolling_shutter_and_clock_move_the_image_as_the_motion_does() -> None:
    """A sideways motion at 1 m/s: the clock shifts, line time shears, exposure blurs evenly."""

    def motion(times_s):
        positions = np.zeros((len(times_s), 3))
        positions[:, 0] = times_s
        return positions, np.tile(np.eye(3), (len(times_s), 1, 1))

    scene = Scene((tag(2),), motion)
    late = Renderer(camera(clock_offset_s=0.006), scene, CLEAN).frame(0.0)
    on_time = Renderer(camera(), scene, CLEAN).frame(0.006)
    assert (late == on_time).all()
    rolling = Renderer(camera(line_time_s=1e-5), scene, CLEAN).frame(0.0).astype(float)
    at_row = Renderer(camera(), scene, CLEAN)
    rows = range(270, 300, 7)
    worst = max(np.abs(rolling[r] - at_row.frame(r * 1e-5).astype(float)[r]).max() for r in rows)
    assert worst <= 1.0, f"row differs by {worst}"
    blurred = Renderer(camera(), scene, replace(CLEAN, exposure_s=0.004)).frame(0.0)
    centre = (blurred.astype(float) - 110).sum(axis=0) @ np.arange(720)
    sharp = (Renderer(camera(), scene, CLEAN).frame(0.0).astype(float) - 110).sum(axis=0)
    total = sharp.sum()
    assert abs(centre / (blurred.astype(float) - 110).sum() - sharp @ np.arange(720) / total) < 0.1


def test_a_frame_with_six_tags_is_fast() -> None:
    places = [(x, 0.0, z) for z in (0.1, -0.1) for x in (-0.2, 0.0, 0.2)]
    patches = tuple(tag(k, position=p) for k, p in enumerate(places))
    renderer = Renderer(camera(), Scene(patches, still()))
    renderer.frame(0.0)
    times = []
    for index in range(8):
        start = time.process_time()
        renderer.frame(0.0, index)
        times.append(time.process_time() - start)
    best = min(times)
    assert best < 0.03, f"{best * 1e3:.1f} ms a frame"


def test_a_tag_seen_from_behind_is_not_drawn() -> None:
    patch = replace(tag(), T_parent_patch=facing(yaw=np.pi))
    image = Renderer(camera(), Scene((patch,), still()), CLEAN).frame(0.0)
    assert np.ptp(image) == 0, f"range {np.ptp(image)}"
