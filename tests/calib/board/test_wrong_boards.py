"""Boards that are not as session.toml states them: used where that is safe, named where not."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest

from freeswing.calib.board.board_corners import BoardDetector
from freeswing.calib.board.board_unlike_seen import (
    corners_in_a_mirror,
    marker_warning,
    settled_board,
)
from freeswing.calib.board.declared_board import Board, board_from
from freeswing.cdpr.files.documents import DataError, InputError
from freeswing.vision.render.patterns import charuco_patch
from freeswing.vision.render.render_scene import Look, Renderer, Scene
from tests.calib import rigs
from tests.calib.films import BOARD, FLIP, small_rig

STATED = board_from(BOARD)


@pytest.fixture(scope="module")
def image() -> np.ndarray:
    """One view of the stated board."""
    camera = small_rig(1)[0]
    pose = rigs.poses((camera,), 1, 3, tilt=0.3)[0] @ FLIP
    board = charuco_patch((6, 5), BOARD["square_m"], BOARD["marker_m"], BOARD["dictionary"])
    scene = Scene((board,), lambda times: (pose[None, :3, 3], pose[None, :3, :3]))
    return next(iter(Renderer(camera, scene, Look(), 1).frames(np.zeros(1))))


def seen(board: Board, count: int = 4) -> np.ndarray:
    """Pixels of a board's corners in some views of one camera, (n, n_points, 2)."""
    cameras = rigs.rig(1)
    return rigs.observe(cameras, rigs.poses(cameras, count), board.points_m, 0.05).pixels


def test_a_negative_board_is_simply_used(image) -> None:
    plain, negative = BoardDetector(STATED), BoardDetector(STATED)
    wanted, found = plain.detect(image), negative.detect(255 - image)
    assert (plain.is_negative, negative.is_negative) == (False, True)
    assert found is not None
    assert wanted is not None
    off = np.nanmax(np.abs(found.pixels - wanted.pixels))
    assert found.count == wanted.count
    assert off < 0.02, f"{off} px"


def test_a_mirrored_board_is_told_from_no_board(image) -> None:
    assert BoardDetector(STATED).detect(np.ascontiguousarray(image[:, ::-1])) is None
    assert corners_in_a_mirror(STATED, [np.ascontiguousarray(image[:, ::-1])]) > 40
    assert corners_in_a_mirror(STATED, [image, np.zeros_like(image)]) == 0


def test_the_other_layout_is_used_and_said() -> None:
    even = replace(STATED, rows=6, columns=7)  # with an even count of rows the layouts differ
    assert settled_board(even, seen(even)) == (even, None)
    legacy = replace(even, legacy=True)
    board, said = settled_board(even, seen(legacy))
    assert board == legacy
    assert "legacy = true" in str(said)
    board, said = settled_board(legacy, seen(even))
    assert board == even
    assert "the new one" in str(said)


def test_exchanged_counts_are_named() -> None:
    turned = replace(STATED, columns=STATED.rows, rows=STATED.columns)
    with pytest.raises(DataError, match="columns and rows are exchanged, 5 x 6"):
        settled_board(STATED, seen(turned))


def test_millimetres_and_marker_sizes_are_said() -> None:
    with pytest.raises(InputError, match=r"24 m: lengths are in metres, 0\.024"):
        board_from({**BOARD, "square_m": 24, "marker_m": 18})
    assert marker_warning(STATED, 0.0005) is None
    assert "90.00" in str(marker_warning(STATED, -0.003))
    assert "87.00 mm" in str(marker_warning(STATED, -0.003))


@pytest.mark.parametrize(("rows", "refused"), [(10, False), (11, True)])
def test_a_board_has_no_more_tags_than_its_dictionary(rows: int, refused: bool) -> None:
    table = {**BOARD, "dictionary": "DICT_4X4_50", "squares": [10, rows]}
    with pytest.raises(InputError, match="10 by 11 need 55 tags") if refused else nullcontext():
        board_from(table)
