"""A survey against the rig on both sides of each limit."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.calib.rig.views import FixedPoints
from freeswing.calib.verdict.plumb_line import Vertical, vertical_entry
from freeswing.calib.verdict.plumb_line_file import read_plumb_line
from freeswing.calib.verdict.survey_check import check_survey
from freeswing.cdpr.files.documents import InputError
from tests.calib.rigs import rig

PLACES = np.array([[0.0, 0.0, 0.0], [0.5, 0.1, 0.1], [0.1, 0.4, -0.1], [-0.3, -0.4, 0.2]])
CORNERS = 0.1 * np.array([[0, 0, 0], [1, 0, 0], [1, -1, 0], [0, -1, 0]])


def survey(told, tags=4):
    """What is said where the cameras see the true tags and the survey tells `told(true)`."""
    cameras = rig(3)
    true = (PLACES[:tags, None] + CORNERS).reshape(-1, 3)
    names = tuple(f"tag{k} {corner}" for k in range(tags) for corner in "0123")
    points, count = told(true), len(true)
    camera = np.repeat(np.arange(len(cameras)), count)
    point = np.tile(np.arange(count), len(cameras))
    pixels = np.concatenate([one.project(one.to_camera(true)) for one in cameras])
    survey_std, noise = np.full(count, 2e-4), np.ones(len(pixels))
    fixed = FixedPoints(names, points, survey_std, camera, point, pixels, noise)
    return " ".join(check_survey(cameras, fixed).reasons)


def moved(metres):
    """The survey has the first tag elsewhere."""

    def told(true):
        points = true.copy()
        points[:4, 2] += metres
        return points

    return told


def test_a_right_survey_is_not_commented_on() -> None:
    assert survey(lambda true: true) == ""


@pytest.mark.parametrize(("scale", "told"), [(1.0045, False), (1.0055, True), (0.9945, True)])
def test_scale(scale, told) -> None:
    assert ("times as large as the board says" in survey(lambda true: scale * true)) == told


@pytest.mark.parametrize(("metres", "told"), [(0.0048, False), (0.0052, True)])
def test_a_tag_elsewhere(metres, told) -> None:
    """Of two tags, each lies as far from where the other says."""
    assert ("mm from its survey" in survey(moved(metres), tags=2)) == told


def test_a_mirror_image() -> None:
    assert "mirror image" in survey(lambda true: true * [1.0, 1.0, -1.0])


@pytest.mark.parametrize(
    ("angle", "scatter", "verdict"),
    [
        (2.9e-3, 1.0, "agrees"),
        (3.1e-3, 1.0, "differs"),
        (2.9e-3, 1.9, "agrees"),
        (2.9e-3, 2.1, "inconsistent"),
    ],
)
def test_gravity_against_a_plumb_line(angle, scatter, verdict) -> None:
    down = np.array([np.sin(angle), 0.0, -np.cos(angle)])
    vertical = Vertical(down, 1e-6 * np.eye(3), scatter, 10, ())
    entry = vertical_entry(vertical, (), np.array([0.0, 0.0, -9.81]))
    assert entry["verdict"] == verdict, entry["sentence"]


@pytest.mark.parametrize(("length_px", "usable"), [(10.1, True), (9.9, False)])
def test_a_string_must_be_long(tmp_path, length_px, usable) -> None:
    """Clicks are good to half a pixel: twenty of them are ten."""
    rows = [f"{camera},100,{y}" for camera in "ab" for y in (50.0, 50.0 + length_px)]
    path = tmp_path / "plumb_line.csv"
    path.write_text("\n".join(["camera,u_px,v_px", *rows, ""]), encoding="utf-8")
    if usable:
        assert len(read_plumb_line(path, ("a", "b"))) == 2
    else:
        with pytest.raises(InputError, match="less than 10"):
            read_plumb_line(path, ("a", "b"))
