"""What ties cameras, and what a corner, a view or a swing may say: both sides of each limit."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false

from __future__ import annotations

from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.calib.rig import bundle_adjustment, solve_rig, tie_by_shared_boards, tie_by_swings


class Reached(Exception):
    """What comes after the limit was called."""


def reached(*_: Any, **__: Any) -> Any:
    raise Reached


def stub(**attributes: Any) -> Any:
    return SimpleNamespace(**attributes)


@pytest.mark.parametrize(("second", "groups"), [(1, [0, 0]), (2, [0, 1])])
def test_one_moment_seen_by_both_ties_cameras(second, groups) -> None:
    views = stub(camera=np.array([0, 0, 1]), moment=np.array([0, 1, second]))
    assert tie_by_shared_boards.board_groups(2, views).tolist() == groups


@pytest.mark.parametrize(("off_px", "counted"), [(19.5, 19.5), (60.0, 20.0)])
def test_a_view_says_no_more_than_twenty_pixels_against_a_pose(off_px, counted) -> None:
    """So that one moment whose own pose is turned over does not decide."""
    camera = stub(project=lambda points: points[..., :2])
    pixels = np.zeros((1, 4, 2))
    pixels[..., 0] = off_px
    found = tie_by_shared_boards._capped(camera, np.zeros((4, 3)), np.eye(4)[None], pixels)
    assert found == pytest.approx(counted)


def noise(monkeypatch, lengths, camera_of, last, unknowns=0.0) -> np.ndarray:
    """Of two cameras whose corners miss by so much, each axis."""
    middle = bundle_adjustment.length_with_share(0.5, 2)
    residuals = np.zeros((len(lengths), 1, 2))
    residuals[:, 0, 0] = np.asarray(lengths) * middle
    views = stub(whitened=lambda given: given, camera=np.asarray(camera_of))
    monkeypatch.setattr(bundle_adjustment, "_unknowns_per_residual", lambda *_: unknowns)
    scene = stub(cameras=(1, 2))
    return bundle_adjustment._noise(scene, stub(views=views), residuals, last)


def test_a_camera_of_few_corners_has_the_noise_of_all(monkeypatch) -> None:
    """Fifteen corners are thirty numbers, as many as the mean of all counts."""
    lengths, camera_of = np.ones(100015), np.zeros(100015, int)
    lengths[-15:], camera_of[-15:] = 3.0, 1
    found = noise(monkeypatch, lengths, camera_of, None)
    assert found[1] == pytest.approx(np.sqrt((9.0 + 1.0) / 2.0), rel=0.005)


def test_unknowns_take_nine_tenths_of_a_cameras_numbers_at_most(monkeypatch) -> None:
    lengths, camera_of = np.ones(1000), np.zeros(1000, int)
    half, most = (
        noise(monkeypatch, lengths, camera_of, np.ones(2), taken)[0] for taken in (0.5, 0.99)
    )
    assert (most / half) ** 2 == pytest.approx(0.5 / 0.1, rel=0.01)


@pytest.mark.parametrize(("corners", "dropped"), [(3, True), (4, False)])
def test_a_view_keeps_four_corners(monkeypatch, corners, dropped) -> None:
    seen = (np.arange(6) < corners)[None]
    views = stub(seen=seen, label=(("cam0", 0),), select=lambda _: views)
    monkeypatch.setattr(solve_rig, "adjust", lambda *_, **__: stub(scene=None))
    monkeypatch.setattr(
        solve_rig, "views_kept", lambda *_: (np.ones(1, bool), np.ones(1), np.zeros(1))
    )
    monkeypatch.setattr(solve_rig, "without_far_corners", lambda *_: views)
    monkeypatch.setattr(solve_rig, "determined_pieces", reached)
    with pytest.raises(Reached) if dropped else nullcontext():
        assert solve_rig.refine(stub(), stub(views=views), 0, roughly=True).dropped == ()


@pytest.mark.parametrize(("miss_px", "fits"), [(2.9, True), (3.1, False)])
def test_a_platform_that_misses_by_three_pixels_is_another_one(monkeypatch, miss_px, fits) -> None:
    monkeypatch.setattr(tie_by_swings, "pose_from_points", lambda *_: np.eye(4))
    camera = stub(project=lambda points: points[..., :2])
    pixels = np.full((1, 4, 2), miss_px)
    _, good = tie_by_swings._poses(camera, stub(points_m=np.zeros((4, 3))), pixels)
    assert good.tolist() == [fits]


def test_two_runs_tie_cameras(monkeypatch) -> None:
    monkeypatch.setattr(tie_by_swings, "find_recordings", lambda _: ())
    monkeypatch.setattr(tie_by_swings, "see_platform", lambda *_: ())
    films = tie_by_swings.SwingFilms(stub(), (("a", "a"), ("b", "b"), ("c", "c")))
    assert [swing.name for swing in films.seen((), None)] == ["a", "b"]
