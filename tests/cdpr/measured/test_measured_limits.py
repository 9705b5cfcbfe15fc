"""What a target's numbers and surveyed points may be: both sides of each limit."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.measured.held_doubled_wild import _steps
from freeswing.cdpr.measured.recording_to_base_frame import frame_from_points
from freeswing.cdpr.measured.rigid_fit import is_planar_or_better
from freeswing.cdpr.measured.target import read_target

TAG = """[[tags]]
family = "tag36h11"
id = 1
size_m = {size!r}
q_platform_tag = [{w!r}, 0.0, 0.0, 0.0]
t_platform_tag_m = [0.0, 0.0, 0.0]
"""
MARKERS = "\n".join(
    f'[[markers]]\nname = "{k}"\nposition_m = [0.{k}, 0.{k * k}, 0.0]\ndiameter_m = {{size!r}}'
    for k in range(3)
)


def refused(folder: Path, text: str) -> bool:
    (folder / "target.toml").write_text(f'format = "freeswing-target/1"\n{text}')
    try:
        read_target(folder / "target.toml")
    except InputError:
        return True
    return False


@pytest.mark.parametrize(
    ("size", "wrong"), [(0.9e-4, True), (1.1e-4, False), (2.7, False), (3.3, True)]
)
def test_a_tag_is_neither_a_pixel_nor_a_wall(tmp_path, size, wrong) -> None:
    assert refused(tmp_path, TAG.format(size=size, w=1.0)) == wrong


@pytest.mark.parametrize(("size", "wrong"), [(0.45, False), (0.55, True)])
def test_a_marker_is_no_ball_of_half_a_metre(tmp_path, size, wrong) -> None:
    assert refused(tmp_path, MARKERS.format(size=size)) == wrong


@pytest.mark.parametrize(("off", "wrong"), [(0.9e-3, False), (1.1e-3, True)])
def test_a_tags_quaternion_has_three_decimals(tmp_path, off, wrong) -> None:
    assert refused(tmp_path, TAG.format(size=0.1, w=1.0 + off)) == wrong


@pytest.mark.parametrize(("breadth", "wrong"), [(0.09, True), (0.11, False)])
def test_named_points_are_no_line(tmp_path, breadth, wrong) -> None:
    """A cross of points, one arm so much shorter than the other."""
    rows = ["[untagged]", 'rest = "rest"', 'clicks = "clicks.csv"']
    for k, place in enumerate(([1, 0], [-1, 0], [0, breadth], [0, -breadth])):
        rows += [
            "[[untagged.points]]",
            f'name = "{k}"',
            f"position_m = {[*map(float, place), 0.0]}",
        ]
    assert refused(tmp_path, "\n".join(rows)) == wrong


@pytest.mark.parametrize(("breadth", "fixes"), [(0.018, False), (0.022, True)])
def test_a_body_whose_points_are_nearly_on_a_line_has_no_orientation(breadth, fixes) -> None:
    cross = np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, breadth, 0], [0, -breadth, 0]])
    assert is_planar_or_better(cross) == fixes


@pytest.mark.parametrize(("off_m", "wrong"), [(0.018, False), (0.022, True)])
def test_points_by_tape_fit_to_two_centimetres(off_m, wrong) -> None:
    """The worst of four points is so far from where the best fit (scipy's) puts it."""
    base = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [1.0, 1.0, 2.0]])

    def left(push: float) -> tuple[np.ndarray, float]:
        recorded = base + np.array([[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, push]])
        a, b = base - base.mean(axis=0), recorded - recorded.mean(axis=0)
        turn = Rotation.align_vectors(a, b)[0]
        return recorded, float(np.linalg.norm(a - turn.apply(b), axis=1).max())

    push = off_m
    for _ in range(30):
        push *= off_m / left(push)[1]
    with pytest.raises(InputError, match="check its numbers") if wrong else nullcontext():
        frame_from_points(left(push)[0], base)


@pytest.mark.parametrize(
    ("name", "size", "wild"),
    [("x", 0.0028, False), ("x", 0.0032, True), ("phi", 0.014, False), ("phi", 0.016, True)],
)
def test_steps_that_no_platform_makes(name, size, wild) -> None:
    """However quiet the samples are."""
    values = 1e-6 * np.resize([1.0, -1.0, 0.5], (60, 1))
    values[30:] += size
    assert _steps(values, np.arange(60.0), (name,)).any() == wild
