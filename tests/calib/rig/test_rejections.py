"""Which views, corners, clocks and shapes a rig rejects: both sides of each limit."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.calib.board.declared_board import Board
from freeswing.calib.camera.camera import Camera
from freeswing.calib.rig import (
    board_sag_and_growth,
    coarse_clocks,
    line_times,
    outliers,
    survey_noise,
)
from freeswing.calib.rig.bundle_adjustment import MEDIAN_OF_RAYLEIGH
from freeswing.calib.rig.coarse_clocks import Lag, _best_lag, _speeds, board_moves
from freeswing.calib.rig.triangulation import triangulate
from freeswing.calib.rig.views import make_views
from freeswing.cdpr.rotation import exp_rotation

CAMERA = Camera("cam0", (640, 480), "PINHOLE", np.array([500.0, 500, 319.5, 239.5]), np.eye(4))


def result_of(errors_px, sigma_px: float):
    """An adjustment of one camera whose corners in each view miss alike, and its problem."""
    lengths = np.asarray(errors_px) * MEDIAN_OF_RAYLEIGH
    residuals = np.zeros((len(lengths), 12, 2))
    residuals[..., 0] = lengths[:, None]
    views = make_views(np.zeros(len(lengths)), np.arange(len(lengths)), residuals)
    result = SimpleNamespace(
        residuals_px=residuals, sigma_px=np.array([sigma_px]),
        scene=SimpleNamespace(cameras=(CAMERA,)),
    )  # fmt: skip
    return result, SimpleNamespace(views=views)


@pytest.mark.parametrize(
    ("usual_px", "error_px", "kept"),
    [(0.2, 0.93, True), (0.2, 1.07, False), (0.02, 0.47, True), (0.02, 0.53, False)],
)
def test_views_that_miss_more_than_their_camera_usually_does(usual_px, error_px, kept) -> None:
    found, _, _ = outliers.views_kept(*result_of([usual_px] * 9 + [error_px], usual_px))
    assert found.tolist() == [True] * 9 + [kept]


@pytest.mark.parametrize(("sigmas", "left"), [(5.7, 12), (6.3, 11)])
def test_a_corner_far_from_where_it_should_be(sigmas, left) -> None:
    result, problem = result_of([0.1], 0.1)
    result.residuals_px[0, 3] = [0.1 * sigmas, 0.0]
    assert outliers.without_far_corners(result, problem).seen.sum() == left


@pytest.mark.parametrize(
    ("line_time_s", "std_s", "stands_out"),
    [
        (1.4e-5, 3.0e-6, False),
        (1.4e-5, 2.6e-6, True),
        (-0.95e-6, 1e-9, False),
        (-1.15e-6, 1e-9, True),
    ],
)
def test_line_times_that_stand_out(line_time_s, std_s, stands_out) -> None:
    """Five deviations, and half a millisecond over 480 rows."""
    assert line_times.reads_in_lines(line_time_s, std_s, 480) == stands_out


def test_boards_are_flat_to_some_thousandths_before_anything_was_seen() -> None:
    """Card on wood over half a metre bends by a millimetre, markers grow by some per cent."""
    board = Board("charuco", 7, 5, 0.08, 0.06, "DICT_5X5_100")
    along, across, growth = board_sag_and_growth.shape_std_m(board.points_m)
    assert 0.9e-3 < along < 1.2e-3
    assert 0.6e-3 < across < 0.85e-3
    assert 1.0e-3 < growth < 1.4e-3
    assert np.isinf(board_sag_and_growth.shape_std_m(Board("chessboard", 6, 4, 0.08).points_m)[2])


def survey_std(given_m: float, correction_m: float, known: bool) -> float:
    """Survey noise of four points from corrections that are all alike."""
    surveyed = np.zeros((4, 3))
    result = SimpleNamespace(
        scene=SimpleNamespace(base_points_m=surveyed + correction_m),
        covariance=np.eye(12) * (0.0 if known else given_m**2),
    )
    fixed = SimpleNamespace(points_base_m=surveyed, std_m=np.full(4, given_m))
    return survey_noise.survey_std(result, fixed, np.ones(4, dtype=bool))


@pytest.mark.parametrize(
    ("given_m", "correction_m", "known", "expected_m"),
    [
        (2.2e-5, 0.0, False, 2.2e-5),
        (1.8e-5, 0.0, False, 2.0e-5),
        (1e-3, 0.0, True, 1e-3 * np.sqrt(2 / 14)),
        (1e-3, 2e-3, True, 1e-3 * np.sqrt((12 * 4 + 2) / 14)),
    ],
)
def test_a_survey_is_worth_what_cameras_find(given_m, correction_m, known, expected_m) -> None:
    """What is given counts as two corrections; nobody surveys better than 0.02 mm."""
    found = survey_std(given_m, correction_m, known)
    assert found == pytest.approx(expected_m, rel=0.02)


@pytest.mark.parametrize(
    ("speed_px_s", "views", "moves"), [(21.0, 8, True), (19.0, 8, False), (21.0, 7, False)]
)
def test_a_board_that_moves_enough_to_tell_time(speed_px_s, views, moves) -> None:
    speeds = np.full(views, speed_px_s)
    assert board_moves(speeds, np.zeros(views, int), 1) == moves


@pytest.mark.parametrize(("correlation", "placed"), [(0.78, False), (0.82, True)])
def test_tracks_that_are_alike_enough(monkeypatch, correlation, placed) -> None:
    monkeypatch.setattr(coarse_clocks, "_speeds", lambda *_: None)
    monkeypatch.setattr(coarse_clocks, "_best_lag", lambda *_: Lag(1.5, correlation, 9.0, 9.0))
    found = coarse_clocks.coarse_clocks((None, None), (None, None))
    assert found.offsets_s.tolist() == [0.0, 1.5 * placed]
    assert found.unknown == (() if placed else (1,))


@pytest.mark.parametrize(
    ("sigmas", "clear", "believed"), [(5.4, 3.3, True), (4.6, 3.3, False), (5.4, 2.7, False)]
)
def test_a_lag_is_believed_above_chance_and_above_others(sigmas, clear, believed) -> None:
    assert Lag(1.5, 0.95, sigmas, clear).is_believed == believed


def hand(times_s: np.ndarray, seed: int) -> np.ndarray:
    """Speeds of a hand: a few tones between 0.3 and 1.5 Hz, never the same twice."""
    rng = np.random.default_rng(seed)
    hertz, phase = rng.uniform(0.3, 1.5, 6), rng.uniform(0.0, 2.0 * np.pi, 6)
    return 3.0 + np.sin(2.0 * np.pi * hertz * times_s[:, None] + phase).sum(axis=1)


@pytest.mark.parametrize("seed", range(6))
def test_cameras_that_seldom_see_the_board_together_are_left_as_stamped(seed) -> None:
    """They share 1 s of 10: a false lag fits by chance where the true one cannot be looked at."""
    rng = np.random.default_rng(seed)
    known, new = np.arange(0.0, 10.0, 0.05), np.arange(9.0, 19.0, 0.05)
    noisy = [hand(t, seed) + 0.02 * rng.normal(size=len(t)) for t in (known, new)]
    lag = _best_lag((known, noisy[0]), (new, noisy[1]))
    assert not lag.is_believed, lag


@pytest.mark.parametrize("seed", range(6))
def test_cameras_that_see_the_board_together_are_placed(seed) -> None:
    rng = np.random.default_rng(seed)
    known, new = np.arange(0.0, 14.0, 0.05), np.arange(2.0, 16.0, 0.05)
    noisy = [hand(known, seed), hand(new + 1.7, seed)]
    noisy = [one + 0.02 * rng.normal(size=len(one)) for one in noisy]
    lag = _best_lag((known, noisy[0]), (new, noisy[1]))
    assert lag.is_believed, lag
    assert abs(lag.lag_s - 1.7) < 0.03, lag


def test_a_board_waved_to_a_beat_tells_no_clock() -> None:
    known, new = np.arange(0.0, 14.0, 0.05), np.arange(0.0, 14.0, 0.05)
    beat = 3.0 + np.sin(2.0 * np.pi * known)
    lag = _best_lag((known, beat), (new, beat))
    assert lag.clear < 1.0, lag
    assert lag.as_stamped > 0.99


def speeds_of(times_s: np.ndarray) -> np.ndarray:
    return 1.0 + np.sin(3.0 * times_s) + 0.5 * np.sin(7.3 * times_s + 1.0)


@pytest.mark.parametrize(("lag_s", "found"), [(4.6, True), (5.6, False)])
def test_clocks_that_are_further_apart_are_not_looked_for(lag_s, found) -> None:
    known, new = np.arange(0.0, 20.0, 0.1), np.arange(6.0, 12.0, 0.1)
    best = _best_lag((known, speeds_of(known)), (new, speeds_of(new + lag_s))).lag_s
    assert (abs(best - lag_s) < 0.06) == found, best


@pytest.mark.parametrize(("samples", "known"), [(20, True), (19, False)])
def test_tracks_of_too_few_samples(samples, known) -> None:
    times = 0.1 * np.arange(samples)
    whole = np.arange(-1.0, 9.0, 0.1)
    found = _best_lag((whole, speeds_of(whole)), (times, speeds_of(times))).correlation
    assert (found > 0.9) == known


@pytest.mark.parametrize(("gap", "kept"), [(2.3, 29), (2.7, 28)])
def test_speeds_over_a_gap_are_none(gap, kept) -> None:
    stamps = 0.1 * np.arange(30.0)
    stamps[15:] += 0.1 * (gap - 1.0)
    boards = np.tile(np.eye(4), (30, 1, 1))
    boards[:, :3, :3] = exp_rotation(np.outer(stamps, [0.1, 0.0, 0.0]))
    assert len(_speeds(SimpleNamespace(T_camera_boards=boards), stamps)[0]) == kept


@pytest.mark.parametrize(("angle_rad", "known"), [(0.0135, False), (0.0148, True)])
def test_rays_that_are_too_nearly_parallel(angle_rad, known) -> None:
    """Two rays have a curvature of half their angle's square."""
    pose = np.eye(4)
    pose[0, 3] = -2.0 * np.tan(angle_rad)
    other = Camera("cam1", CAMERA.size_px, "PINHOLE", CAMERA.params, pose)
    point = np.array([[0.0, 0.0, 2.0]])
    pixels = np.stack([one.project(one.to_camera(point)) for one in (CAMERA, other)])
    assert np.isfinite(triangulate((CAMERA, other), pixels)).all() == known
