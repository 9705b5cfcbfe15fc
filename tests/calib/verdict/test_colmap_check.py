"""A rig beside COLMAP's own bundle adjustment of the same corners."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from freeswing.calib.rig.solve_rig import solve_rig, start_cameras
from freeswing.calib.verdict.colmap_check import Beside, beside_colmap, complaints
from tests.calib import rigs

pytest.importorskip("pycolmap")
SIGMA_PX = 0.1


@pytest.fixture(scope="module")
def solved():
    """Three cameras, 25 boards, and noise of a tenth of a pixel."""
    cameras, points = rigs.rig(3), rigs.board()
    views = rigs.observe(cameras, rigs.poses(cameras, 25), points, SIGMA_PX)
    names = tuple(camera.name for camera in cameras)
    sizes = tuple(camera.size_px for camera in cameras)
    starts = start_cameras(names, sizes, ("OPENCV",) * 3, points, views)
    return cameras, solve_rig(points, starts)


def test_colmap_comes_to_the_same_rig(solved) -> None:
    _, rig = solved
    found = beside_colmap(rig)
    assert [one.camera for one in found] == ["cam0", "cam1", "cam2"]
    for one in found:
        assert one.agrees, one
        assert abs(one.focal) < one.focal_std, one
        assert one.centre_px < 0.5, one
        assert one.place_mm < 1.0, one
        assert one.turn_mrad < 0.5, one
    assert complaints(found) == []


def test_colmap_disagrees_with_a_focal_length_that_was_tampered_with(solved) -> None:
    """It starts at ours and goes to where the corners are, so that a wrong one of ours is seen."""
    _, rig = solved
    scene = rig.adjustment.scene
    first, *others = scene.cameras
    longer = first.params * np.array([1.01, 1.01, 1, 1, 1, 1, 1, 1])
    wrong = replace(scene, cameras=(replace(first, params=longer), *others))
    found = beside_colmap(replace(rig, adjustment=replace(rig.adjustment, scene=wrong)))
    assert not found[0].agrees, found[0]
    assert found[0].focal == pytest.approx(-0.01 / 1.01, rel=0.1), found[0]
    assert "camera cam0: COLMAP's focal length is -" in complaints(found)[0]


@pytest.mark.parametrize(
    ("focal", "std", "agrees"),
    [(3.9e-3, 1e-3, True), (4.1e-3, 1e-3, False), (-0.9e-4, 1e-6, True), (-1.1e-4, 1e-6, False)],
)
def test_both_sides_of_what_is_let_pass(focal, std, agrees) -> None:
    assert Beside("a", focal, std, 0.0, 0.0, 0.0).agrees == agrees
