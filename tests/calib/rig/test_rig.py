"""Bundle adjustment of synthetic rigs: truth recovered, covariance honest, nonsense refused."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from freeswing.calib.board.coverage import coverage_of
from freeswing.calib.board.planar_pose import homographies
from freeswing.calib.rig.bundle_adjustment import adjust
from freeswing.calib.rig.normal_equations import Problem
from freeswing.calib.rig.reprojection import (
    Scene,
    board_residuals,
    camera_slices,
    kernel_estimate,
    kernel_views,
    moved,
)
from freeswing.calib.rig.reprojection_kernels import WARP, local_rows
from freeswing.calib.rig.solve_rig import free_unknowns, solve_rig, start_cameras, tie_to_base
from freeswing.calib.rig.triangulation import triangulate
from freeswing.calib.rig.views import FixedPoints
from freeswing.calib.verdict.halves_and_lengths import check_truth
from freeswing.calib.verdict.survey_check import check_survey
from freeswing.calib.verdict.verdict import judge
from freeswing.cdpr.files.documents import DataError
from tests.calib import rigs

MODEL = ("OPENCV",)


def solve(cameras, points, views, **options):
    names, sizes = tuple(c.name for c in cameras), tuple(c.size_px for c in cameras)
    starts = start_cameras(names, sizes, MODEL * len(cameras), points, views)
    return solve_rig(points, starts, **options), np.array([s.rms_px for s in starts])


def edges_of(points):
    gap = np.linalg.norm(points[:, None] - points[None], axis=-1)
    return np.argwhere(np.triu(np.abs(gap - gap[gap > 0].min()) < 1e-9))


def rows_of(scene, points, views, index):
    """Derivatives of the projection in one view by its local unknowns, (2 n_points, n)."""
    return local_rows(kernel_views(views), kernel_estimate(scene, points), index)


@pytest.mark.parametrize("degree", [0, 3])
def test_jacobians_match_differences(degree):
    """A camera with clock and line time before a board that moves along a polynomial."""
    rng = np.random.default_rng(0)
    points = rigs.board()
    cameras = tuple(
        replace(c, clock_offset_s=0.004 * k, line_time_s=1e-5 * k)
        for k, c in enumerate(rigs.rig(2))
    )
    boards = rigs.poses(cameras, 3)
    lags = rng.uniform(-0.02, 0.02, 6)
    views = replace(rigs.observe(cameras, boards, points, 0.0), lag_s=lags)
    motion = 0.2 * rng.normal(size=(3, degree, 6))
    warp = np.array([1e-3, -2e-3, 0.0])
    scene = Scene(cameras, boards, warp, np.zeros((0, 3)), motion, 0.03)
    view = int(np.flatnonzero(views.camera == 1)[1])
    own = camera_slices(cameras)[1]
    shared, size = own.stop + WARP, own.stop - own.start + WARP
    rows, line_time = rows_of(scene, points, views, view), own.stop - own.start - 1

    def difference(at, column, step=1e-6):
        steps = [np.zeros(shared), np.zeros((3, scene.board_unknowns))]
        if at:
            steps[1][views.piece[view], column] = step
        else:
            steps[0][column] = step
        sides = [
            board_residuals(moved(scene, sign * steps[0], sign * steps[1]), points, views)[view]
            for sign in (1, -1)
        ]
        return (sides[1] - sides[0]).ravel() / (2 * step)

    for local in range(size):
        expected = difference(0, own.start + local, 1e-9 if local == line_time else 1e-6)
        size_of = np.abs(expected).max() + 1.0
        np.testing.assert_allclose(rows[:, local], expected, rtol=1e-5, atol=1e-5 * size_of)
    for column in range(scene.board_unknowns):
        expected = difference(1, column)
        np.testing.assert_allclose(rows[:, size + column], expected, rtol=1e-5, atol=1e-3)


def test_covariance_is_that_of_the_errors():
    """Normalised error squared over twelve rigs stays in its 99.8 % chi-square band."""
    total, freedom = 0.0, 0
    points = rigs.board()
    for seed in range(12):
        cameras = rigs.rig(3, seed)
        views = rigs.observe(cameras, rigs.poses(cameras, 14, seed + 50), points, 0.1, seed + 90)
        rig, _ = solve(cameras, points, views)
        square, count = rigs.error_square(rig, cameras)
        total, freedom = total + square, freedom + count
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


def test_a_sagging_board_is_found_and_a_flat_one_is_flat():
    cameras, points = rigs.rig(3), rigs.board()
    boards = rigs.poses(cameras, 20)
    flat, _ = solve(cameras, points, rigs.observe(cameras, boards, points, 0.1))
    end = camera_slices(cameras)[-1].stop
    std = np.sqrt(np.diag(flat.adjustment.covariance)[end : end + 2])
    assert np.all(np.abs(flat.adjustment.scene.warp_m[:2]) < 3.0 * std), (flat, std)
    assert np.all(std < 1e-4), std
    u = points[:, 0] / np.ptp(points[:, 0]) * 2
    bent = points + np.outer(1 - u**2, [0, 0, 0.002])
    rig, _ = solve(cameras, points, rigs.observe(cameras, boards, bent, 0.1))
    sag = rig.adjustment.scene.warp_m
    assert sag[0] == pytest.approx(0.002, abs=1e-4), sag


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
