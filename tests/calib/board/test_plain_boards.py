"""Boards without tags: grids of circles, and chessboards of other counts than stated."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from freeswing.calib.board import chessboard_corners
from freeswing.calib.board.board_corners import BoardDetector
from freeswing.calib.board.chessboard_corners import ChessboardFinder
from freeswing.calib.board.circle_grid_corners import circle_bias
from freeswing.calib.board.declared_board import Board, board_from
from freeswing.calib.camera.cameras_file import read_cameras
from freeswing.calib.verdict.calibration_result import read_camera_covariance
from freeswing.cdpr.files.documents import InputError, dump_toml
from freeswing.main import main
from freeswing.vision.render.patterns import Patch, chessboard_patch, circles_patch
from freeswing.vision.render.record import record
from freeswing.vision.render.render_scene import Look, Renderer, Scene, still
from tests.calib import films, rigs
from tests.calib.films import FLIP
from tests.places import SAMPLES

CIRCLES = {
    "circles": {"kind": "circles", "squares": [7, 5], "square_m": 0.08, "diameter_m": 0.05},
    "asymmetric_circles": {
        "kind": "asymmetric_circles", "squares": [4, 9], "square_m": 0.06, "diameter_m": 0.05,
    },
}  # fmt: skip


def patch_of(board: Board) -> Patch:
    return circles_patch(board.points_m[:, :2], board.marker_m)


@pytest.mark.parametrize("kind", CIRCLES)
def test_middles_of_circles_have_no_bias(kind) -> None:
    board = board_from(CIRCLES[kind])
    camera = films.small_rig(1)[0]
    detector, errors, raw = BoardDetector(board), [], []
    for index, pose in enumerate(rigs.poses((camera,), 5, tilt=0.5)):
        near = pose.copy()
        near[:3, 3] = 0.3 * pose[:3, 3] + 0.3 * camera.position_base_m
        shown = patch_of(board).moved(near @ FLIP, "base")
        image = Renderer(camera, Scene((shown,), still()), Look(), index).frame(0.0)
        found = detector.detect(image if index else 255 - image)
        detector.is_negative = None
        assert found is not None, index
        points = board.points_m @ near[:3, :3].T + near[:3, 3]
        error = found.pixels - camera.project(camera.to_camera(points))
        bias = circle_bias(
            camera, board.points_m, board.marker_m, (camera.T_camera_base @ near)[None]
        )
        raw.append(error)
        errors.append(error - bias[0])
    error = np.concatenate(errors)
    rms, before = (float(np.sqrt(np.mean(np.concatenate(e) ** 2))) for e in (errors, raw))
    assert rms < 0.03, f"{rms:.4f} px"
    assert before > 2.0 * rms, f"{before:.4f} px"
    assert np.abs(error.mean(axis=0)).max() < 0.015, error.mean(axis=0)


def write_session(folder: Path, board: dict) -> None:
    for name in ("robot.toml", "target.toml"):
        (folder / name).write_text((SAMPLES / "filmed" / name).read_text())
    session = {
        "format": "freeswing-session/1",
        "name": "board",
        "robot": "robot.toml",
        "target": "target.toml",
        "cameras": "cameras.toml",
        "calibration": {"recordings": "calibration", "board": board},
        "runs": [{"name": "swing", "role": "identify", "video": "runs/swing"}],
    }
    dump_toml(folder / "session.toml", session)


def film(folder: Path, patch: Patch, count: int) -> tuple:
    """A board in `count` poses before two cameras; gives them."""
    cameras = films.small_rig(2)
    poses = rigs.poses(cameras, count, 52, tilt=0.5) @ FLIP

    def motion(times_s):
        index = np.clip(np.round(times_s).astype(int), 0, count - 1)
        return poses[index, :3, 3], poses[index, :3, :3]

    stamps = np.arange(float(count))
    scene = Scene((patch,), motion)
    record(folder, cameras, scene, stamps, Look(), 3, images=True, stamps_file=False)
    return cameras


@pytest.mark.slow
@pytest.mark.parametrize("kind", CIRCLES)
def test_a_grid_of_circles_through_the_command_line(tmp_path, kind) -> None:
    write_session(tmp_path, CIRCLES[kind])
    true = film(tmp_path / "calibration", patch_of(board_from(CIRCLES[kind])), 20)
    assert main(["calibrate", str(tmp_path), "--quiet"]) == 0
    found = read_cameras(tmp_path / "cameras.toml")
    covariance = read_camera_covariance(tmp_path / "results" / "calibration.json")
    for camera, one in zip(found, true, strict=True):
        off = (camera.params - one.params)[:4]
        std = np.sqrt(np.diag(covariance.lens(camera)))[:4]
        assert np.abs(off / std).max() < 4.5, (off, std)
        assert std.max() < 2.0, std
    first, second = (camera.position_base_m for camera in found)
    apart = np.linalg.norm(first - second) / np.linalg.norm(
        true[0].position_base_m - true[1].position_base_m
    )
    assert abs(apart - 1.0) < 2e-3, apart


def test_a_chessboard_of_other_counts_is_named(tmp_path, capsys) -> None:
    write_session(tmp_path, {"kind": "chessboard", "squares": [7, 6], "square_m": 0.09})
    film(tmp_path / "calibration", chessboard_patch((6, 5), 0.09), 6)
    assert main(["calibrate", str(tmp_path), "--quiet"]) == 1
    said = capsys.readouterr().err
    assert "chessboard of 6 x 5 inner corners, session.toml says 7 x 6" in said, said


def test_images_without_a_board_are_not_looked_at_hard_for_ever(monkeypatch) -> None:
    hard = []
    find = cv2.findChessboardCornersSB

    def counted(image, size, flags):
        hard.append(bool(flags & cv2.CALIB_CB_EXHAUSTIVE))
        return find(image, size, flags=flags)

    monkeypatch.setattr(cv2, "findChessboardCornersSB", counted)
    finder = ChessboardFinder(9, 6)
    blank = np.full((60, 80), 128, np.uint8)
    assert [finder.find(blank) for _ in range(7)] == [None] * 7
    assert sum(hard) == chessboard_corners.MOST_HARD == 3
    assert finder.other_counts is None


@pytest.mark.parametrize(("times", "said"), [(2, False), (3, True)])
def test_other_counts_are_said_once_they_are_sure(monkeypatch, times, said) -> None:
    monkeypatch.setattr(chessboard_corners, "_counts", lambda image: (8, 5))
    finder = ChessboardFinder(9, 6)
    for _ in range(times):
        finder.find(np.full((60, 80), 128, np.uint8))
    assert (finder.other_counts is not None) == said


def test_kalibrs_grid_of_circles_needs_its_diameter() -> None:
    table = {
        "target_type": "circlegrid", "targetCols": "4", "targetRows": "11",
        "spacingMeters": "0.02", "asymmetricGrid": "True",
    }  # fmt: skip
    with pytest.raises(InputError, match="diameter_m"):
        board_from(table)
    board = board_from({**table, "diameter_m": "0.012"})
    assert board.kind == "asymmetric_circles"
    np.testing.assert_allclose(np.ptp(board.points_m, axis=0), [0.14, 0.2, 0.0])
    with pytest.raises(InputError, match=r"diameter_m is 0\.03, must lie between 0 and the dist"):
        board_from({**table, "diameter_m": "0.03"})
