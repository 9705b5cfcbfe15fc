"""Where the platform's tags really sit is an unknown of the adjustment that they tie cameras by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from freeswing.calib.board.platform_as_board import platform_tags
from freeswing.calib.rig.reprojection import shape_modes, warped
from freeswing.calib.rig.solve_rig import Rig, solve_rig, start_cameras
from freeswing.calib.rig.tie_by_shared_boards import pose_from_points
from freeswing.calib.rig.views import Views, joined_views, make_views
from freeswing.calib.verdict.halves_and_lengths import rigidly_fitted
from freeswing.cdpr.measured.target import Target, read_target, write_target
from freeswing.cdpr.rotation import exp_rotation
from tests.calib import rigs
from tests.calib.rig import test_rings as rings

BOARDS, INSTANTS, NOISE_PX = 12, 25, 0.02
GAP = np.full((4, 3), np.nan)


def corners(tags) -> np.ndarray:
    return np.concatenate([tag.corners_platform_m for tag in tags])


def test_a_tag_moves_by_three_shifts_and_three_turns() -> None:
    """Against the tag put elsewhere by a rotation matrix: alike to the square of the turn."""
    tags = rings.platform_tags()[:2]
    points = np.concatenate([rigs.board(), GAP, corners(tags)])
    change, turn = np.array([1e-3, -2e-3, 5e-4]), np.array([3e-4, 1e-4, -2e-4])
    reach = tags[1].size_m / np.sqrt(2.0)
    T = tags[1].T_platform_tag.copy()
    T[:3, 3] += change
    T[:3, :3] = exp_rotation(turn) @ T[:3, :3]
    wanted = replace(tags[1], T_platform_tag=T).corners_platform_m
    warp = np.concatenate([np.zeros(9), change, reach * turn])
    found = warped(points, warp)
    assert np.abs(found[-4:] - wanted).max() < reach * float(turn @ turn)
    assert np.array_equal(found[:-4], points[:-4], equal_nan=True)
    assert shape_modes(points).shape == (len(points), 3, 15)


def test_a_tag_states_how_well_its_place_is_known(tmp_path) -> None:
    tags = [replace(tag, std_m=1e-3 if tag.id == 1 else None) for tag in rings.platform_tags()]
    write_target(tmp_path / "target.toml", Target(tuple(tags)))
    body = platform_tags(read_target(tmp_path / "target.toml"))
    assert body is not None
    assert body.std_m[:3] == (3e-4, 1e-3, 3e-4)


def body_views(cameras, tags) -> Views:
    """The tags that face each camera, at instants of a swing."""
    rng, rows, sightings = np.random.default_rng(7), [], []
    places, turns = rings.swing(np.linspace(0.0, 12.0, INSTANTS))
    for index, camera in enumerate(cameras):
        for k in range(INSTANTS):
            pixels = np.full((4 * len(tags), 2), np.nan)
            for n, tag in enumerate(tags):
                there = tag.corners_platform_m @ turns[k].T + places[k]
                normal = turns[k] @ tag.T_platform_tag[:3, 2]
                if normal @ (camera.position_base_m - there.mean(axis=0)) > 0.8:
                    pixels[4 * n : 4 * n + 4] = camera.project(camera.to_camera(there))
            pixels += NOISE_PX * rng.normal(size=pixels.shape)
            rows.append((index, len(cameras) * BOARDS + k))
            sightings.append(pixels)
    index, moment = np.array(rows).T
    return make_views(index, moment, np.array(sightings))


def solved(cameras, tags, told, std_m: float | None) -> Rig:
    """A ring whose boards tie nothing, by the platform whose tags are `told` to sit somewhere."""
    alone, n_board = rings.boards_apart(cameras, BOARDS, NOISE_PX), len(rigs.board())
    names, sizes = tuple(c.name for c in cameras), tuple(c.size_px for c in cameras)
    starts = start_cameras(names, sizes, ("OPENCV",) * len(cameras), rigs.board(), alone)
    seen, points = body_views(cameras, tags), corners(told)
    both = []
    for index, start in enumerate(starts):
        own = seen.select(seen.camera == index)
        T = []
        for pixels in own.pixels:
            known = np.isfinite(pixels[:, 0])
            pose = pose_from_points(start.camera, points[known], pixels[known])
            assert pose is not None
            T.append(pose)
        parts = [widened(start.views, 0, 4 + len(points)), widened(own, n_board + 4, 0)]
        poses = np.concatenate([start.T_camera_boards, np.array(T)])
        both.append(replace(start, views=joined_views(parts), T_camera_boards=poses))
    everything = np.concatenate([rigs.board(), GAP, points])
    stds = np.full(len(tags), 1e-9 if std_m is None else std_m)
    return solve_rig(everything, tuple(both), layout_std_m=stds)


def widened(views: Views, before: int, after: int) -> Views:
    pixels = np.pad(views.pixels, ((0, 0), (before, after), (0, 0)), constant_values=np.nan)
    whitening = np.broadcast_to(np.eye(2), (*pixels.shape[:2], 2, 2))
    return replace(views, pixels=pixels, whitening=np.ascontiguousarray(whitening))


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_layout_half_a_millimetre_off_is_found_and_leaves_claims_right(seed) -> None:
    cameras, tags = rings.ring(3), rings.platform_tags()
    rng = np.random.default_rng(seed)
    told = []
    for tag in tags:
        T = tag.T_platform_tag.copy()
        T[:3, 3] += 5e-4 * rng.normal(size=3)
        told.append(replace(tag, T_platform_tag=T))
    rig = solved(cameras, tags, told, 5e-4)
    square, free = rigs.error_square(rig, cameras)
    assert square / free < 1.6, f"chi-square {square:.0f} of {free}"
    moved = rig.adjustment.scene.warp_m[3:].reshape(-1, 6)[:, :3]
    error = (moved - [a.centre_m - b.centre_m for a, b in zip(tags, told, strict=True)]).ravel()
    shifts = np.arange(6 * len(tags)).reshape(-1, 6)[:, :3].ravel() + len(rig.problem.free) - 36
    spread = rig.adjustment.covariance[np.ix_(shifts, shifts)]
    square = float(error @ np.linalg.solve(spread, error))
    assert square / len(error) < 2.2, f"chi-square of the layout {square:.0f} of {len(error)}"
    found = np.array([tag.centre_m for tag in told]) + moved
    apart = found - rigidly_fitted(np.array([tag.centre_m for tag in tags]), found)
    assert rings.rms(apart) < 2.5e-4, apart  # of 0.87 mm, what all do together left out
    held = solved(cameras, tags, told, None)
    square, free = rigs.error_square(held, cameras)
    assert square / free > 5.0, f"an exact layout would have done: {square:.0f} of {free}"
