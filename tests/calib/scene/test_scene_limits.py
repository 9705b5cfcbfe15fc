"""What a map of the laboratory keeps, and what is taken for granted: both sides of each limit."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.calib.scene import stills
from freeswing.calib.scene.blob_sizes import feature_variance, small_blobs
from freeswing.calib.scene.chosen_points import agreeing, chosen_points
from freeswing.calib.scene.clicked_points import read_clicks
from freeswing.calib.scene.frame_by_survey import similarity
from freeswing.calib.scene.scale_by_distances import scale_of
from freeswing.calib.scene.tape_measured import Distance
from freeswing.cdpr.files.documents import DataError, InputError


@pytest.mark.parametrize(("breadth", "refused"), [(0.045, True), (0.055, False)])
def test_a_survey_is_no_line(breadth, refused) -> None:
    """Four points on a cross, one arm so much shorter than the other."""
    cross = np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, breadth, 0], [0, -breadth, 0]])
    with pytest.raises(DataError, match="not on one line") if refused else nullcontext():
        similarity(cross, cross)


@pytest.mark.parametrize(("sigmas", "refused"), [(3.7, False), (4.3, True)])
def test_two_distances_agree_within_four_deviations(sigmas, refused) -> None:
    factors = np.array([2.0 * (1.0 + sigmas * 0.001), 2.0])
    std, names = np.array([0.001, 1e-5]), ["A to B", "B to C"]
    with pytest.raises(DataError, match="distance A to B") if refused else nullcontext():
        scale_of(factors, np.zeros((2, 3)), np.eye(3), std, names)


@pytest.mark.parametrize(("sigmas", "kept"), [(3.7, 4), (4.3, 3)])
def test_a_sighting_four_deviations_off_is_another_patch(sigmas, kept) -> None:
    """Of one point, seen four times."""
    off = np.zeros((4, 1, 2))
    off[0, 0, 0] = 0.2 * sigmas
    scene = SimpleNamespace(T_base_boards=np.zeros((1, 4, 4)))
    result = SimpleNamespace(residuals_px=off, sigma_px=np.array([0.2]), scene=scene)
    views = SimpleNamespace(camera=np.zeros(4, int), piece=np.zeros(4, int))
    assert agreeing(result, SimpleNamespace(views=views)).sum() == kept


@pytest.mark.parametrize(("sightings", "chosen"), [(2, 0), (3, 1)])
def test_a_point_that_three_images_see_tests_itself(sightings, chosen) -> None:
    camera = np.arange(sightings)
    found = chosen_points(camera, np.zeros(sightings, int), np.zeros(sightings, bool))
    assert len(found) == chosen


def test_a_blob_of_a_pixel_has_twice_the_variance_of_a_point() -> None:
    """Noise of the pixels and of the blob's own size are equal there."""
    point, blob = feature_variance(np.array([0.0, 1.0]))
    assert blob / point == pytest.approx(2.0, rel=0.15)


def test_a_tape_gives_a_millimetre() -> None:
    assert Distance(("A", "B"), 2.0).std_m == pytest.approx(1e-3, rel=0.15)


def test_a_mark_by_hand_is_good_to_half_a_pixel(tmp_path) -> None:
    path = tmp_path / "clicks.csv"
    path.write_text("image,point,u_px,v_px\ncam0,A,1,2\n")
    (click,) = read_clicks(path, ["cam0"], ["A"])
    assert click.std_px == pytest.approx(0.5, rel=0.15)


@pytest.mark.parametrize(("moved", "refused"), [(11, False), (13, True)])
def test_nothing_moves_in_a_still(monkeypatch, moved, refused) -> None:
    frames = [(k, "", np.full((8, 8), 100 + (moved if k else 0), np.uint8)) for k in range(3)]
    recording = SimpleNamespace(path=Path("a.mp4"), name="a")
    monkeypatch.setattr(stills, "find_recordings", lambda _: [recording])
    monkeypatch.setattr(stills, "read_frames", lambda _: iter(frames))
    with pytest.raises(InputError, match="nothing moving") if refused else nullcontext():
        stills.rig_stills(Path())


@pytest.mark.parametrize(("images", "refused"), [(2, True), (3, False)])
def test_a_walk_has_three_images(monkeypatch, images, refused) -> None:
    shares = [(k, f"{k}.png", np.zeros((8, 8), np.uint8)) for k in range(images)]
    monkeypatch.setattr(stills, "_walk", lambda _: SimpleNamespace(images=shares))
    monkeypatch.setattr(stills, "_shares", lambda _: shares)
    with pytest.raises(InputError, match="need 3") if refused else nullcontext():
        stills.walk_stills(Path("walk"))


@pytest.mark.parametrize(("apart_px", "kept"), [(0.0115, True), (0.0125, False)])
def test_large_blobs_are_left_out_by_what_a_slanted_view_does_to_them(apart_px, kept) -> None:
    """size^2 / f on both sides of the limit, in an image that has enough of small ones."""
    image = np.zeros(121, dtype=int)
    sizes = np.full(121, 1.0)
    sizes[-1] = np.sqrt(apart_px * 600.0)
    assert small_blobs(image, sizes, np.array([600.0]))[-1] == kept
    few = small_blobs(image[-1:], sizes[-1:], np.array([600.0]))
    assert few.tolist() == [True]
