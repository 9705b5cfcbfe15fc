"""From rendered videos of a moving board to clocks, and to errors as large as claimed."""

import numpy as np
import pytest
from scipy.stats import chi2

from freeswing.calib.board.board_corners import BoardDetector
from freeswing.calib.board.declared_board import board_from
from freeswing.calib.tags.tag_bend import fit_bias, pattern_edges
from freeswing.vision.render.render_scene import Look, Renderer, Scene, still
from tests.calib import films, rigs


def test_clocks_of_a_rendered_session(tmp_path):
    """Two cameras, one 6.8 ms off with a rolling shutter: offset to 0.1 ms, lines to 0.2 us."""
    cameras = films.free_running(films.small_rig(3))[::2]
    result = films.calibrate_moving(tmp_path, cameras, 30.0, 45, seed=0)
    found, true = result.cameras[1], cameras[1]
    error_ms = 1e3 * (found.clock_offset_s - true.clock_offset_s)
    assert abs(error_ms) < 0.1, f"clock off by {error_ms:.4f} ms"
    assert found.line_time_s == pytest.approx(true.line_time_s, abs=2e-7)
    assert result.cameras[0].line_time_s == 0.0
    entry = result.document["cameras"][1]
    z = (found.clock_offset_s - true.clock_offset_s) / entry["clock_offset_std_s"]
    assert abs(z) < 4.0, f"{z:.1f} claimed standard deviations"


def test_what_a_lens_does_to_a_tag():
    """Tags of 90 px before a strong lens: the predicted bias is the mean error of the fit."""
    camera = films.small_rig(1)[0]
    board = board_from(films.BOARD)
    predicted, errors = [], []
    for seed, pose in enumerate(rigs.poses((camera,), 6, seed=4, tilt=0.4)):
        near = pose.copy()
        near[:3, 3] = 0.4 * pose[:3, 3] + 0.45 * camera.position_base_m
        scene = Scene((films.patch().moved(near @ films.FLIP, "base"),), still())
        found = BoardDetector(board).detect(Renderer(camera, scene, Look(), seed).frame(0.0))
        assert found is not None
        true = camera.project(camera.to_camera(board.points_m @ near[:3, :3].T + near[:3, 3]))
        T_camera_board = (camera.T_camera_base @ near)[None]
        for tag in range(board.n_tags):
            own = slice(4 * tag, 4 * tag + 4)
            edges = pattern_edges(board.dictionary, tag, 1, False)
            corners = board.points_m[own]
            bias = fit_bias(camera, corners, T_camera_board, edges, np.zeros((1, 6)))
            predicted.append(bias[0])
            errors.append(found.pixels[own] - true[own])
    bias, error = np.array(predicted), np.array(errors)
    seen = np.isfinite(error)
    bias, error = bias[seen], error[seen]
    slope = float(error @ bias / (bias @ bias))
    left = float(np.std(error)) / np.linalg.norm(bias)
    assert np.std(bias) > 0.003, f"nothing to see: {np.std(bias)} px"
    assert abs(slope - 1.0) < 0.1 + 3.0 * left, f"{slope:.3f} of the predicted bias is there"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["still", "moving"])
def test_rendered_errors_are_as_large_as_claimed(kind, tmp_path):
    """Normalised error squared over four rigs within its 99.8 % chi-square band."""
    total, freedom = 0.0, 0
    for seed in range(4):
        cameras = films.small_rig(3, seed)
        folder = tmp_path / str(seed)
        if kind == "still":
            rig = films.calibrate_still(folder, cameras, 16, seed)
        else:
            cameras = films.free_running(cameras)
            rig = films.calibrate_moving(folder, cameras, 25.0, 60, seed).rig
        square, count = rigs.error_square(rig, cameras)
        total, freedom = total + square, freedom + count
    low, high = chi2.ppf([0.001, 0.999], freedom)
    assert low < total < high, f"{total:.0f} outside {low:.0f} to {high:.0f}"
