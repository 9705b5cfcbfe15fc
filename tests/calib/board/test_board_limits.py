"""When a board is found, and which board it is: both sides of each limit, on made corners."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false

from __future__ import annotations

from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.calib.board import (
    board_corners,
    board_unlike_seen,
    chessboard_corners,
    circle_grid_corners,
)
from freeswing.calib.board.declared_board import Board
from freeswing.calib.board.platform_as_board import platform_tags
from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import read_cameras, write_cameras
from freeswing.calib.camera.impossible_lenses import question_lens
from freeswing.cdpr.files.documents import InputError

CHARUCO = Board("charuco", 5, 4, 0.04, marker_m=0.03, dictionary="DICT_4X4_50")


@pytest.mark.parametrize(
    ("views", "bent", "other"), [(3, 0.018, False), (3, 0.022, True), (2, 0.3, False)]
)
def test_corners_on_no_plane_are_of_another_layout(monkeypatch, views, bent, other) -> None:
    """Three views of the stated board so far off a plane, of any other one at none."""
    monkeypatch.setattr(
        board_unlike_seen, "_bent", lambda board, _: bent if board == CHARUCO else 0.0
    )
    found, said = board_unlike_seen.settled_board(CHARUCO, np.zeros((views, 12, 2)))
    assert (found != CHARUCO) == other
    assert (said is not None) == other


@pytest.mark.parametrize(("percent", "warned"), [(0.93, False), (1.07, True)])
def test_markers_of_another_size_are_named(percent, warned) -> None:
    assert (board_unlike_seen.marker_warning(CHARUCO, 1e-2 * percent * 0.03) is not None) == warned


@pytest.mark.parametrize(("square_m", "refused"), [(0.93, False), (1.07, True)])
def test_a_square_of_a_metre_is_a_unit_mistaken(square_m, refused) -> None:
    with pytest.raises(ValueError, match="metres") if refused else nullcontext():
        Board("chessboard", 5, 4, square_m)


def test_other_boards_are_looked_for_in_eight_images(monkeypatch) -> None:
    asked = []
    monkeypatch.setattr(chessboard_corners, "_counts", lambda image: asked.append(1))
    finder = chessboard_corners.ChessboardFinder(5, 4)
    for _ in range(12):
        finder.find(np.zeros((60, 80), np.uint8))
    assert len(asked) == 8


@pytest.mark.parametrize(("rows", "counts"), [(2, None), (3, (5, 3))])
def test_the_smallest_board_has_three_rows(monkeypatch, rows, counts) -> None:
    found = (True, None, np.zeros((rows, 5)))
    monkeypatch.setattr(chessboard_corners.cv2, "findChessboardCornersSBWithMeta", lambda *_: found)
    assert chessboard_corners._counts(np.zeros((60, 80), np.uint8)) == counts


@pytest.mark.parametrize(
    ("pixels", "contrast", "seen"),
    [(18, 100, False), (22, 100, True), (100, 11, False), (100, 13, True)],
)
def test_a_circle_has_twenty_pixels_and_a_contrast(pixels, contrast, seen) -> None:
    """A dark half of what belongs to it, in rows of ten."""
    window, mine = np.full((10, 10), 200.0), np.zeros((10, 10), dtype=bool)
    mine.ravel()[:pixels] = True
    window[:, ::2] -= contrast
    found = circle_grid_corners._middle(window, np.array([4.5, 4.5]), mine)
    assert (found is not None) == seen


@pytest.mark.parametrize(("corners", "found"), [(5, False), (6, True)])
def test_a_board_shows_six_corners(monkeypatch, corners, found) -> None:
    detector = board_corners.BoardDetector(CHARUCO)
    seen = detector.nothing()
    seen.pixels[:corners] = 1.0
    monkeypatch.setattr(board_corners.BoardDetector, "_tag_corners", lambda *_: seen)
    assert (detector._detect_tags(np.zeros((60, 80), np.uint8)) is not None) == found


@pytest.mark.parametrize(("explained", "kept"), [(0.77, False), (0.83, True)])
def test_a_tag_looks_like_its_pattern(monkeypatch, explained, kept) -> None:
    monkeypatch.setattr(board_corners, "fit_tag", lambda *_: SimpleNamespace(explained=explained))
    quad = np.array([[20.0, 20.0], [40.0, 20.0], [40.0, 40.0], [20.0, 40.0]])
    fit = board_corners.fitted_corners(np.zeros((60, 80), np.uint8), quad, np.zeros((6, 6)))
    assert (fit is not None) == kept


def test_no_corner_is_better_than_three_thousandths_of_a_pixel(monkeypatch) -> None:
    exact = SimpleNamespace(rays=np.zeros((4, 2)), rays_covariance=np.zeros((8, 8)))
    quad = np.zeros((1, 4, 2), np.float32)
    finder = SimpleNamespace(detectMarkers=lambda _: ([quad], np.array([[0]]), None))
    monkeypatch.setattr(board_corners, "fitted_corners", lambda *_: exact)
    detector = board_corners.BoardDetector(CHARUCO)
    found = detector._tag_corners(np.zeros((60, 80), np.uint8), 1, finder)
    assert np.sqrt(found.covariance_px2[0, 0, 0]) == pytest.approx(0.003, rel=0.15)


@pytest.mark.parametrize(("tags", "known"), [(1, False), (2, True)])
def test_one_tag_tells_no_pose(tags, known) -> None:
    tag = SimpleNamespace(family="tag36h11", id=1, corners_platform_m=np.zeros((4, 3)), std_m=None)
    target = SimpleNamespace(tags=(tag,) * tags)
    assert (platform_tags(target) is not None) == known


@pytest.mark.parametrize(("share", "refused"), [(0.33, False), (0.27, True)])
def test_no_lens_leaves_a_third_of_the_angle_half_way_to_the_corners(share, refused) -> None:
    """Half way to the corner of this image a pinhole sees 45 degrees: r (1 + k r^2) = 1 there."""
    size = np.array([801.0, 601.0])
    focal = float(np.hypot(200.0, 150.0))
    k = (1.0 / share - 1.0) / share**2
    said = []
    entry = SimpleNamespace(add=lambda key, text: said.append(text))
    params = np.array([focal, focal, 400.0, 300.0, k, 0.0, 0.0, 0.0])
    question_lens(entry, "OPENCV", size, params)
    assert bool(said) == refused, said


@pytest.mark.parametrize(("off", "refused"), [(0.9e-3, False), (1.1e-3, True)])
def test_a_camera_is_turned_by_a_unit_quaternion(tmp_path, off, refused) -> None:
    params = np.array([900.0, 900.0, 400.0, 300.0, 0.0, 0.0, 0.0, 0.0])
    write_cameras(tmp_path / "a.toml", (Camera("a", (801, 601), "OPENCV", params, np.eye(4)),))
    text = (tmp_path / "a.toml").read_text(encoding="utf-8")
    assert "q_camera_base = [1.0," in text
    (tmp_path / "a.toml").write_text(text.replace("base = [1.0,", f"base = [{1.0 + off!r},"))
    with pytest.raises(InputError, match="q_camera_base") if refused else nullcontext():
        read_cameras(tmp_path / "a.toml")


@pytest.mark.parametrize(
    ("share", "questioned"), [(0.095, True), (0.105, False), (95.0, False), (105.0, True)]
)
def test_focal_lengths_that_no_lens_has(share, questioned) -> None:
    """Over the larger side of the image."""
    said: list[str] = []
    entry = SimpleNamespace(add=lambda key, text: said.append(text))
    params = np.array([800.0 * share, 399.5, 299.5])
    question_lens(entry, "SIMPLE_PINHOLE", np.array([800.0, 600.0]), params)
    assert any("focal lengths" in text for text in said) == questioned, said
