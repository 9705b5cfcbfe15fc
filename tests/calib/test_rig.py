"""Bundle adjustment of synthetic rigs: truth recovered, covariance honest, nonsense refused."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from calib.adjustment import adjust
from calib.coverage import coverage_of
from calib.normal_equations import Problem
from calib.planar_pose import homographies
from calib.reprojection import WARP, Scene, board_jacobians, board_residuals, camera_slices, moved
from calib.rig import free_unknowns, solve_rig, start_cameras, tie_to_base
from calib.survey_check import check_survey
from calib.triangulation import triangulate
from calib.trust import judge
from calib.truth_checks import check_truth
from calib.views import FixedPoints, make_views
from cdpr.documents import DataError
from tests.calib import rigs

MODEL = ("OPENCV",)


def solve(cameras, points, views, **options):
    names, sizes = tuple(c.name for c in cameras), tuple(c.size_px for c in cameras)
    starts = start_cameras(names, sizes, MODEL * len(cameras), points, views)
    return solve_rig(points, starts, **options), np.array([s.rms_px for s in starts])


def edges_of(points):
    gap = np.linalg.norm(points[:, None] - points[None], axis=-1)
    return np.argwhere(np.triu(np.abs(gap - gap[gap > 0].min()) < 1e-9))


def test_jacobians_match_differences():
    cameras, points = rigs.rig(2), rigs.board()
    boards = rigs.poses(cameras, 3)
    views = rigs.observe(cameras, boards, points, 0.0)
    velocity = np.random.default_rng(0).normal(size=views.pixels.shape) * 100
    views = replace(views, velocity_px_s=velocity).select(views.camera == 1)
    scene = Scene(cameras, boards, np.zeros(WARP), np.zeros((0, 3)))
    _, d_camera, d_board, d_warp = board_jacobians(scene, points, views, 1)
    own = camera_slices(cameras)[1]
    size = own.stop + WARP
    for column in range(own.start, size):
        step = np.zeros(size)
        step[column] = 1e-6
        ahead = board_residuals(moved(scene, step, np.zeros((3, 6))), points, views, 1)
        behind = board_residuals(moved(scene, -step, np.zeros((3, 6))), points, views, 1)
        local = column - own.start
        k = own.stop - own.start
        expected = d_camera[..., local] if local < k else d_warp[..., local - k]
        np.testing.assert_allclose((behind - ahead) / 2e-6, expected, atol=2e-4)
    for column in range(6):
        step = np.zeros((3, 6))
        step[:, column] = 1e-6
        ahead = board_residuals(moved(scene, np.zeros(size), step), points, views, 1)
        behind = board_residuals(moved(scene, np.zeros(size), -step), points, views, 1)
        np.testing.assert_allclose((behind - ahead) / 2e-6, d_board[..., column], atol=2e-4)


def test_covariance_is_that_of_the_errors():
    """Normalised error squared over twelve rigs stays in its 99.8 % chi-square band."""
    total, freedom = 0.0, 0
    points = rigs.board()
    for seed in range(12):
        cameras = rigs.rig(3, seed)
        views = rigs.observe(cameras, rigs.poses(cameras, 14, seed + 50), points, 0.1, seed + 90)
        rig, _ = solve(cameras, points, views)
        free = rig.problem.free[: camera_slices(cameras)[-1].stop]
        error = rigs.errors(rig.adjustment.scene, cameras, rig.reference)[free]
        covariance = rig.adjustment.covariance[: len(free), : len(free)][np.ix_(free, free)]
        total += float(error @ np.linalg.solve(covariance, error))
        freedom += int(free.sum())
        assert rig.adjustment.rank == rig.problem.free.sum()
    low, high = chi2.ppf([0.001, 0.999], freedom)
    assert low < total < high, f"{total:.0f} outside {low:.0f} to {high:.0f}"


def test_same_data_same_bytes():
    cameras, points = rigs.rig(3), rigs.board()
    views = rigs.observe(cameras, rigs.poses(cameras, 12), points, 0.2)
    first, second = (solve(cameras, points, views)[0].adjustment for _ in range(2))
    assert first.covariance.tobytes() == second.covariance.tobytes()
    for a, b in zip(first.scene.cameras, second.scene.cameras, strict=True):
        assert a.params.tobytes() == b.params.tobytes()


def test_sagging_board_is_found_and_flat_one_left_alone():
    cameras, points = rigs.rig(3), rigs.board()
    boards = rigs.poses(cameras, 20)
    flat, _ = solve(cameras, points, rigs.observe(cameras, boards, points, 0.1))
    assert not flat.adjustment.scene.warp_m.any()
    u = points[:, 0] / np.ptp(points[:, 0]) * 2
    bent = points + np.outer(1 - u**2, [0, 0, 0.002])
    rig, _ = solve(cameras, points, rigs.observe(cameras, boards, bent, 0.1))
    sag = rig.adjustment.scene.warp_m
    assert sag[0] == pytest.approx(0.002, abs=1e-4), sag


def test_clocks_from_image_velocity():
    """Offsets to 0.1 ms and a line time of 12 us from a board moved by hand, exact velocities."""
    cameras = rigs.rig(3)
    clocks = ((0.0, 0.0), (0.0043, 0.0), (-0.0068, 1.2e-5))
    cameras = tuple(
        replace(c, clock_offset_s=o, line_time_s=line)
        for c, (o, line) in zip(cameras, clocks, strict=True)
    )
    points, rng = rigs.board(), np.random.default_rng(8)
    boards = rigs.poses(cameras, 30)
    speed = rng.normal(size=(30, 3)) * 0.3
    rows = []
    for index, camera in enumerate(cameras):
        for moment, T in enumerate(boards):
            place = points @ T[:3, :3].T + T[:3, 3]
            _, d_point, _ = camera.project_jacobian(camera.to_camera(place))
            v = d_point @ camera.T_camera_base[:3, :3] @ speed[moment]
            pixels = camera.project(camera.to_camera(place))
            for _ in range(3):
                delay = camera.clock_offset_s + pixels[:, 1] * camera.line_time_s
                shown = camera.to_camera(place + delay[:, None] * speed[moment])
                pixels = camera.project(shown)
            rows.append((index, moment, pixels + 0.05 * rng.normal(size=pixels.shape), v))
    camera, moment, pixels, velocity = (list(column) for column in zip(*rows, strict=True))
    views = make_views(camera, moment, np.array(pixels), np.array(velocity))
    rig, _ = solve(cameras, points, views, clocks=True)
    for found, true in zip(rig.cameras, cameras, strict=True):
        error_ms = 1e3 * (found.clock_offset_s - true.clock_offset_s)
        assert abs(error_ms) < 0.1, f"{true.name}: {error_ms} ms"
        assert found.line_time_s == pytest.approx(true.line_time_s, abs=3e-7), true.name


def survey_of(cameras, sigma=0.02, seed=3):
    rng = np.random.default_rng(seed)
    centres = rng.uniform([-0.6, -0.6, -0.5], [0.0, 0.0, 0.5], (5, 3))
    turn = rigs.facing(cameras) @ np.diag([1.0, -1.0, -1.0])
    square = 0.08 * np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])
    points = (centres[:, None] + square @ turn.T).reshape(-1, 3)
    sightings = [
        (index, number, pixel)
        for index, camera in enumerate(cameras)
        for number, pixel in enumerate(camera.project(camera.to_camera(points)))
    ]
    pixels = np.array([s[2] for s in sightings]) + sigma * rng.normal(size=(len(sightings), 2))
    return FixedPoints(
        tuple(f"tag36h11:{k} {corner}" for k in range(5) for corner in ("TL", "TR", "BR", "BL")),
        points,
        np.full(20, 2e-4),
        np.array([s[0] for s in sightings]),
        np.array([s[1] for s in sightings]),
        pixels,
        np.full(len(sightings), 0.2),
    )


def solved_rig():
    cameras, points = rigs.rig(3), rigs.board()
    views = rigs.observe(cameras, rigs.poses(cameras, 24), points, 0.1)
    return cameras, points, *solve(cameras, points, views)


def test_base_tags_place_the_rig():
    cameras, points, rig, alone = solved_rig()
    fixed = survey_of(cameras)
    survey = check_survey(rig.cameras, fixed)
    assert not survey.reasons
    tied = tie_to_base(rig, fixed)
    places = np.random.default_rng(4).uniform(-0.3, 0.3, (200, 3))
    pixels = np.stack([c.project(c.to_camera(places)) for c in cameras])
    error = np.linalg.norm(triangulate(tied.cameras, pixels) - places, axis=1)
    rms_mm = 1e3 * np.sqrt(np.mean(error**2))
    assert rms_mm < 0.1, f"{rms_mm} mm"
    verdict = judge(tied, check_truth(tied, edges_of(points)), survey, alone)
    assert verdict.usable, verdict.reasons
    assert abs(verdict.checks["length_bias"]) < 1e-4


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda p: p * [1, -1, 1], "mirror image"),
        (lambda p: p * 1.02, "1.02.* times as large"),
        (lambda p: np.concatenate([np.roll(p[:4], 1, axis=0), p[4:]]), "90 degrees turned|turned"),
        (lambda p: np.concatenate([p[:4][::-1], p[4:]]), "wrong way round"),
        (lambda p: p + np.repeat([[0, 0, 0.03]] + [[0, 0, 0]] * 4, 4, axis=0), "tag36h11:0 lies"),
    ],
)
def test_wrong_survey_is_named(change, said):
    cameras, _, rig, _ = solved_rig()
    fixed = survey_of(cameras)
    survey = check_survey(rig.cameras, replace(fixed, points_base_m=change(fixed.points_base_m)))
    text = " ".join(survey.reasons)
    assert survey.reasons
    assert re.search(said, text), text


def test_views_alike_are_refused():
    cameras, points = rigs.rig(2), rigs.board()
    boards = rigs.poses(cameras, 12, tilt=0.02)
    rig, alone = solve(cameras, points, rigs.observe(cameras, boards, points, 0.1))
    verdict = judge(rig, check_truth(rig, edges_of(points)), None, alone)
    text = " ".join(verdict.reasons)
    assert not verdict.usable
    assert "cam0" in text
    assert "film it tilted" in text, text


def test_too_few_views_and_separate_cameras_are_named():
    cameras, points = rigs.rig(3), rigs.board()
    boards = rigs.poses(cameras, 12)
    views = rigs.observe(cameras, boards, points, 0.1)
    with pytest.raises(DataError, match=r"camera cam1: 2 usable views"):
        solve(cameras, points, views.select((views.camera != 1) | (views.moment < 2)))
    apart = (views.camera != 2) == (views.moment < 6)
    with pytest.raises(DataError, match="film the board where"):
        solve(cameras, points, views.select(apart))


def test_outlying_view_and_corner_are_dropped():
    cameras, points = rigs.rig(2), rigs.board()
    views = rigs.observe(cameras, rigs.poses(cameras, 15), points, 0.1)
    pixels = views.pixels.copy()
    pixels[3] += [8.0, 5.0] * (1 + np.arange(40) % 2)[:, None]
    pixels[7, 11] += 4.0
    rig, _ = solve(cameras, points, replace(views, pixels=pixels))
    assert [drop.label for drop in rig.dropped] == [views.label[3]]
    assert rig.n_trimmed == 1
    assert rig.adjustment.sigma_px.max() < 0.12


def test_held_unknowns_stay():
    cameras, points = rigs.rig(2), rigs.board()
    boards = rigs.poses(cameras, 6)
    views = rigs.observe(cameras, boards, points, 0.1)
    scene = Scene(cameras, boards, np.zeros(WARP), np.zeros((0, 3)))
    free = free_unknowns(cameras, held_pose=0, held_lenses=True)
    result = adjust(scene, Problem(points, views, None, free))
    np.testing.assert_array_equal(result.scene.cameras[0].T_camera_base, cameras[0].T_camera_base)
    np.testing.assert_array_equal(result.scene.cameras[1].params, cameras[1].params)
    assert not result.covariance[~free].any()


def test_homography_and_coverage():
    cameras, points = rigs.rig(1), rigs.board()
    views = rigs.observe(cameras, rigs.poses(cameras, 10), points, 0.0)
    H = homographies(points[:, :2], views.pixels)
    assert np.isfinite(H).all()
    coverage = coverage_of(cameras[0], 0, views, rigs.poses(cameras, 10))
    assert 0.2 < coverage.filled <= 1.0
    assert coverage.tilt_deg > 20
