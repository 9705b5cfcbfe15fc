"""What views, motions, files and surveys count: both sides of each limit."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.calib.board.coverage import coverage_of
from freeswing.calib.board.motion_cuts import smoothness
from freeswing.calib.board.searched_frames import in_bursts
from freeswing.calib.camera.camera import Camera
from freeswing.calib.exchange.impossible_cameras import refuse_impossible
from freeswing.calib.exchange.metres_or_millimetres import in_metres
from freeswing.calib.exchange.qualisys import _binning
from freeswing.calib.verdict import halves_and_lengths, survey_check
from freeswing.calib.verdict.plumb_line import _refuse_one_plane
from freeswing.calib.verdict.plumb_line_file import _numbers
from freeswing.cdpr.files.documents import DataError, InputError

CAMERA = Camera("cam0", (640, 480), "PINHOLE", np.array([500.0, 500, 319.5, 239.5]), np.eye(4))


def stub(**attributes: Any) -> Any:
    return SimpleNamespace(**attributes)


def test_an_image_is_filled_by_sixteenths() -> None:
    """Corners in the middle of four fields on the diagonal fill four of sixteen."""
    places = (np.arange(4)[:, None] + 0.5) / 4.0 * [640.0, 480.0]
    views = stub(camera=np.zeros(1, int), pixels=places[None], piece=np.zeros(1, int))
    assert coverage_of(CAMERA, 0, views, np.eye(4)[None]).filled == 0.25


def test_a_long_film_is_looked_at_in_bursts_of_five() -> None:
    wanted = np.array(sorted(in_bursts(100000)))
    lengths = np.diff(np.flatnonzero(np.r_[True, np.diff(wanted) > 1, True]))
    assert set(lengths.tolist()) == {5}


def smooth(corners: int, first_px: float, second_px: float) -> int:
    """What is said of a board that goes on by so much between three frames."""
    pixels = np.full((3, 8, 2), np.nan)
    pixels[:, :corners, 1] = np.arange(corners)
    pixels[:, :corners, 0] = np.array([0.0, first_px, first_px + second_px])[:, None]
    numbers = np.arange(3)
    return int(smoothness(pixels, 0.1 * numbers, numbers)[0][1])


@pytest.mark.parametrize(("corners", "told"), [(3, 0), (4, 1)])
def test_four_corners_tell_how_a_board_moves(corners, told) -> None:
    assert smooth(corners, 10.0, 10.0) == told


@pytest.mark.parametrize(("bend_px", "told"), [(34.0, 1), (38.0, -1)])
def test_a_motion_that_bends_by_a_third_goes_on(bend_px, told) -> None:
    """Of 100 px in two frames, and a pixel for what corners are wrong by."""
    assert smooth(8, 50.0 + 0.5 * bend_px, 50.0 - 0.5 * bend_px) == told


@pytest.mark.parametrize(("off", "refused"), [(0.95e-3, False), (1.05e-3, True)])
def test_a_rotation_of_a_file_is_one_to_a_thousandth(off, refused) -> None:
    pose = np.eye(4)
    pose[:3, :3] *= np.sqrt(1.0 + off)
    camera = stub(name="a", size_px=(640, 480), T_camera_base=pose)
    with pytest.raises(InputError, match="its rotation is none") if refused else nullcontext():
        refuse_impossible(Path("a.toml"), [camera])


@pytest.mark.parametrize(("far", "as_stated"), [(58.0, True), (62.0, False)])
def test_cameras_sixty_units_apart_are_told_in_millimetres(far, as_stated) -> None:
    pose = np.eye(4)
    pose[0, 3] = far
    camera = Camera("a", (640, 480), "PINHOLE", CAMERA.params, pose)
    said: list[str] = []
    (found,) = in_metres(Path("a.toml"), (camera,), said.append)
    assert (found.T_camera_base[0, 3] == far) == as_stated == (said == [])


@pytest.mark.parametrize(("share", "found"), [(0.215, True), (0.185, False)])
def test_a_lens_looks_through_the_middle_of_its_picture(share, found) -> None:
    size = np.array([1000.0, 800.0])
    with nullcontext() if found else pytest.raises(InputError, match="outside the middle"):
        assert _binning(share * size, np.zeros(2), size) == 1


@pytest.mark.parametrize(("std_rad", "refused"), [(0.048, False), (0.052, True)])
def test_a_vertical_is_told_to_three_degrees(std_rad, refused) -> None:
    with pytest.raises(DataError, match="nearly one") if refused else nullcontext():
        _refuse_one_plane(np.diag([std_rad**-2, 1e6]), [])


def test_a_click_is_good_to_half_a_pixel() -> None:
    assert _numbers({"u_px": "10", "v_px": "20"}, "line 2") == (10.0, 20.0, 0.5)


@pytest.mark.parametrize(("ratio", "told"), [(0.29, True), (0.31, False)])
def test_a_mirrored_survey_fits_three_times_better(monkeypatch, ratio, told) -> None:
    def fit(survey, seen, mirror):
        return np.full(seen.shape, 0.02 * (ratio if mirror else 1.0)), 1.0

    points = np.arange(12.0).reshape(4, 3)
    monkeypatch.setattr(survey_check, "triangulate", lambda *_: points)
    monkeypatch.setattr(survey_check, "_fit", fit)
    monkeypatch.setattr(survey_check, "_wrong_tags", lambda *_: [])
    assert ("mirror image" in " ".join(checked(points).reasons)) == told


@pytest.mark.parametrize(("corners", "checked_at_all"), [(3, False), (4, True)])
def test_a_survey_is_checked_by_four_corners(monkeypatch, corners, checked_at_all) -> None:
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.2]])
    seen = np.where(np.arange(4)[:, None] < corners, points, np.nan)
    monkeypatch.setattr(survey_check, "triangulate", lambda *_: seen)
    assert np.isfinite(checked(points).scale) == checked_at_all


def checked(points: np.ndarray) -> survey_check.SurveyCheck:
    fixed = stub(
        points_base_m=points, camera=np.zeros(4, int), point=np.arange(4),
        pixels=np.zeros((4, 2)), names=tuple(f"tag1 {k}" for k in range(4)),
    )  # fmt: skip
    return survey_check.check_survey((CAMERA,), fixed)


@pytest.mark.parametrize(("views", "enough"), [(3, False), (4, True)])
def test_half_of_a_calibration_has_four_views_of_each_camera(monkeypatch, views, enough) -> None:
    half = stub(camera=np.r_[np.zeros(9, int), np.ones(views, int)])
    chosen = stub(piece=np.zeros(1, int), select=lambda _: stub(compacted=lambda: (half, None)))
    monkeypatch.setattr(halves_and_lengths, "adjust", lambda *_, **__: "adjusted")
    monkeypatch.setattr(halves_and_lengths, "replace", lambda *_, **__: None)
    scene = stub(pieces=lambda _: None)
    rig = stub(
        problem=stub(views=chosen), cameras=(1, 2), adjustment=stub(scene=scene, sigma_px=None)
    )
    assert (halves_and_lengths._half(rig, 0) == "adjusted") == enough
