"""Calibration from rendered images: corner bias, and the whole way from recordings to a rig."""

from dataclasses import dataclass

import numpy as np
import pytest

from freeswing.calib.board.board_corners import BoardDetector
from freeswing.calib.board.declared_board import Board, board_from, read_board
from freeswing.calib.calibrate import calibrate_session
from freeswing.calib.camera.cameras_file import read_cameras, write_cameras
from freeswing.calib.rig.triangulation import triangulate
from freeswing.calib.verdict.calibration_result import read_camera_covariance
from freeswing.cdpr.files.documents import InputError, write_json
from freeswing.cdpr.rotation import exp_rotation, transform
from freeswing.vision.render.patterns import (
    aprilgrid_patch,
    charuco_patch,
    chessboard_patch,
    tag_patch,
)
from freeswing.vision.render.record import record
from freeswing.vision.render.render_scene import Look, Renderer, Scene, still
from tests.calib import films, rigs

FLIP = np.diag([1.0, -1.0, -1.0, 1.0])
BOARDS = {
    "charuco": (
        Board("charuco", 7, 5, 0.08, 0.06, "DICT_5X5_100"),
        charuco_patch((7, 5), 0.08, 0.06, "DICT_5X5_100"),
        FLIP,
    ),
    "chessboard": (Board("chessboard", 6, 5, 0.08), chessboard_patch((6, 5), 0.08), FLIP),
    "aprilgrid": (
        Board("aprilgrid", 4, 3, 0.12, 0.036, "tag36h11"),
        aprilgrid_patch(4, 3, 0.12, 0.3),
        np.eye(4),
    ),
}


@pytest.mark.parametrize("kind", BOARDS)
def test_corners_have_no_bias(kind):
    board, patch, to_patch = BOARDS[kind]
    camera = films.small_rig(1)[0]
    detector = BoardDetector(board)
    errors = []
    for index, pose in enumerate(rigs.poses((camera,), 6, tilt=0.4)):
        near = pose.copy()
        near[:3, 3] = 0.3 * pose[:3, 3] + 0.3 * camera.position_base_m
        shown = patch.moved(near @ FLIP, "base")
        image = Renderer(camera, Scene((shown,), still()), Look(), index).frame(0.0)
        found = detector.detect(image)
        assert found is not None
        T = near @ FLIP @ np.linalg.inv(to_patch) if kind == "aprilgrid" else near
        points = board.points_m @ T[:3, :3].T + T[:3, 3]
        error = found.pixels - camera.project(camera.to_camera(points))
        errors.append(error[np.isfinite(error[:, 0])])
    error = np.concatenate(errors)
    bias, rms = error.mean(axis=0), float(np.sqrt(np.mean(error**2)))
    assert np.abs(bias).max() < 0.01, f"bias {bias} px over {len(error)} corners"
    assert rms < (0.05 if kind == "chessboard" else 0.02), f"{rms} px"


@dataclass
class Tag:
    family: str
    id: int
    corners_base_m: np.ndarray
    std_m: float | None = None


def film(folder, cameras, count, seed=3):
    """A charuco board held still in `count` poses, before five surveyed tags."""
    _, patch, _ = BOARDS["charuco"]
    boards = rigs.poses(cameras, count, seed) @ FLIP

    def motion(times_s):
        index = np.clip(np.round(times_s).astype(int), 0, count - 1)
        return boards[index, :3, 3], boards[index, :3, :3]

    rng = np.random.default_rng(seed)
    turn = rigs.facing(cameras) @ FLIP[:3, :3]
    patches, tags = [patch], []
    for k in range(5):
        x, y = -0.7 + 0.35 * k, 0.45 * (-1) ** k
        place = turn @ np.array([x, y, -0.7 + 0.2 * rng.uniform()])
        pose = transform(turn @ exp_rotation(rng.uniform(-0.3, 0.3, 3)), place)
        patches.append(tag_patch("tag36h11", 100 + k, 0.16, pose, "base"))
        square = 0.08 * np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])
        tags.append(Tag("tag36h11", 100 + k, square @ pose[:3, :3].T + place))
    scene = Scene(tuple(patches), motion)
    record(folder, cameras, scene, np.arange(float(count)), Look(), images=True, stamps_file=False)
    return tags


def test_from_images_to_the_base_frame(tmp_path):
    """Two cameras, 16 still poses: points on the platform to 0.1 mm; mirrored tags are refused."""
    cameras = films.small_rig(2)
    tags = film(tmp_path / "calibration", cameras, 16)
    table = {
        "kind": "charuco",
        "squares": [7, 5],
        "square_m": 0.08,
        "marker_m": 0.06,
        "dictionary": "DICT_5X5_100",
    }
    told = []
    result = calibrate_session(
        tmp_path / "calibration",
        table,
        tags,
        kept_boards=tmp_path / "kept",
        progress=lambda label, share: told.append((label, share)),
    )
    assert told[-1][1] == 1.0
    assert result.refused is None
    write_cameras(tmp_path / "cameras.toml", result.cameras)
    found = read_cameras(tmp_path / "cameras.toml")
    places = np.random.default_rng(4).uniform(-0.3, 0.3, (200, 3))
    pixels = np.stack([camera.project(camera.to_camera(places)) for camera in cameras])
    error = np.linalg.norm(triangulate(found, pixels) - places, axis=1)
    rms_mm = 1e3 * float(np.sqrt(np.mean(error**2)))
    assert rms_mm < 0.1, f"{rms_mm} mm"
    write_json(tmp_path / "results" / "calibration.json", result.document)
    covariance = read_camera_covariance(tmp_path / "results" / "calibration.json")
    std = np.sqrt(np.diag(covariance.pose("cam1")))
    np.testing.assert_allclose(std[:3], result.document["cameras"][1]["position_std_m"])
    assert result.document["verdict"]["usable"]
    mirrored = [Tag(t.family, t.id, t.corners_base_m * [1, -1, 1]) for t in tags]
    kept = tmp_path / "kept"  # the same images: their boards are not looked for again
    refused = calibrate_session(tmp_path / "calibration", table, mirrored, kept_boards=kept)
    assert "mirror image" in (refused.refused or ""), refused.refused


def test_boards_are_read_and_checked(tmp_path):
    path = tmp_path / "april.yaml"
    path.write_text(
        "target_type: 'aprilgrid' #gridtype\ntagCols: 6\ntagRows: 5 # rows\n"
        "tagSize: 0.088\ntagSpacing: 0.3\n"
    )
    board = read_board(path)
    assert (board.columns, board.rows, board.square_m) == (6, 5, 0.088)
    assert board.marker_m == pytest.approx(0.0264)
    np.testing.assert_allclose(np.ptp(board.points_m, axis=0)[:2], [0.66, 0.5456])
    with pytest.raises(InputError, match="tagCols"):
        board_from({"kind": "aprilgrid", "tagSize": 0.1, "tagSpacing": 0.3})
    with pytest.raises(InputError, match="marker_m"):
        board_from(
            {
                "kind": "charuco",
                "squares": [7, 5],
                "square_m": 0.05,
                "marker_m": 0.06,
                "dictionary": "DICT_5X5_100",
            }
        )


def test_empty_folders_are_named(tmp_path):
    table = {"kind": "chessboard", "squares": [6, 5], "square_m": 0.08}
    with pytest.raises(InputError, match="no such folder"):
        calibrate_session(tmp_path / "absent", table)
    with pytest.raises(InputError, match="no <camera>"):
        calibrate_session(tmp_path, table)
