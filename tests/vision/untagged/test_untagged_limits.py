"""Which matches and points of a platform without tags count: both sides of each limit."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.measured.target import Marker, Untagged
from freeswing.cdpr.rotation import transform
from freeswing.vision.untagged import named_points
from freeswing.vision.untagged import rest_model as room
from freeswing.vision.untagged.adjusted_points import PointSums, at_home
from freeswing.vision.untagged.aligned_patches import Aligned
from freeswing.vision.untagged.feature_matches import matched
from freeswing.vision.untagged.pose_by_matches import agreed_pose, sightings_of
from freeswing.vision.untagged.rest_patches import SeenAtRest
from freeswing.vision.untagged.still_pose import still_pose
from tests.vision.untagged import boxes

STATED = np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.3, 0.0], [0.1, 0.1, 0.2]])


def at_angles(*degrees: float) -> np.ndarray:
    turned = np.deg2rad(degrees)
    return np.stack([np.cos(turned), np.sin(turned), 0.0 * turned], axis=1).astype(np.float32)


@pytest.mark.parametrize(("ratio", "found"), [(0.77, 1), (0.83, 0)])
def test_the_nearest_is_clearly_nearer_than_the_next(ratio, found) -> None:
    """Descriptors 20 degrees apart, and the next at a distance so many times as large."""
    near = 2.0 * np.sin(np.deg2rad(10.0))
    far = 2.0 * np.rad2deg(np.arcsin(near / ratio / 2.0))
    first = np.concatenate([at_angles(0.0), [[0.0, 0.0, 1.0]]]).astype(np.float32)
    rows, _ = matched(first, at_angles(20.0, -far))
    assert np.count_nonzero(rows == 0) == found


@pytest.mark.parametrize(("likeness", "found"), [(0.72, 0), (0.78, 1)])
def test_a_patch_looks_like_itself(likeness, found) -> None:
    first = np.concatenate([at_angles(0.0), [[0.0, 0.0, 1.0]]]).astype(np.float32)
    rows, _ = matched(first, at_angles(np.rad2deg(np.arccos(likeness)), 180.0))
    assert np.count_nonzero(rows == 0) == found


def sights(count: int, off_px: float = 0.0):
    """Points and their rays in one camera, the last one off by so many pixels."""
    camera = boxes.cameras()[1]
    points = np.random.default_rng(5).uniform(-0.15, 0.15, (count, 3))
    T = camera.T_camera_base @ transform(np.eye(3), boxes.HOME_M)
    inside = points @ T[:3, :3].T + T[:3, 3]
    rays = inside[:, :2] / inside[:, 2:]
    rays[-1, 0] += off_px / float(camera.focal_px.mean())
    return points, rays, camera


@pytest.mark.parametrize(("count", "known"), [(11, False), (12, True)])
def test_a_dozen_matches_make_a_pose(count, known) -> None:
    assert (agreed_pose(*sights(count)) is not None) == known


@pytest.mark.parametrize(("off_px", "inside"), [(2.7, 40), (3.3, 39)])
def test_a_match_three_pixels_off_is_another_patch(off_px, inside) -> None:
    found = agreed_pose(*sights(40, off_px))
    assert found is not None
    assert len(found[1]) == inside


def test_a_deviation_in_pixels_becomes_one_of_rays() -> None:
    """Through a lens that distorts: by differences of its rays."""
    camera, pixels = boxes.cameras()[0], np.array([[60.0, 420.0], [330.0, 240.0]])
    found = Aligned(pixels, np.array([0.1, 0.02]))
    seen = sightings_of(np.array([5, 9]), found, camera)
    assert [one.thing for one in seen] == [5, 9]
    for one, pixel, std in zip(seen, pixels, found.std_px, strict=True):
        steps = [camera.normalise(pixel + e) - camera.normalise(pixel - e) for e in np.eye(2)]
        slope = np.stack(steps, axis=1) / 2.0
        np.testing.assert_allclose(one.rays[:2], camera.normalise(pixel), rtol=1e-12)
        wanted = std**2 * slope @ slope.T
        np.testing.assert_allclose(one.covariance[:2, :2], wanted, rtol=1e-4)


@pytest.mark.parametrize(("off_px", "counts"), [(2.8, True), (3.2, False)])
def test_a_sighting_three_pixels_off_is_none_of_the_point(off_px, counts) -> None:
    """By a lens of 1000 px."""
    sums = PointSums(np.zeros((1, 3)))
    sums.add(np.array([0]), transform(np.eye(3), np.array([0.0, 0.0, 2.0]))[None],
             np.array([[1e-3 * off_px, 0.0]]))  # fmt: skip
    assert bool(sums.normal.any()) == counts


@pytest.mark.parametrize(("grey", "changed"), [(11, False), (13, True)])
def test_noise_is_no_change(grey, changed) -> None:
    rest = np.full((60, 80), 100, np.uint8)
    rest[20:40, 30:50] += grey
    frames = [np.full((60, 80), 100, np.uint8)] * 4
    assert room.moving_part(rest, frames)[25:35, 35:45].all() == changed


@pytest.mark.parametrize(("frames", "hangs"), [(7, False), (8, True)])
def test_the_platform_hangs_where_two_fifths_of_the_frames_differ(frames, hangs) -> None:
    rest = np.full((60, 80), 100, np.uint8)
    rest[20:40, 30:50] = 180
    gone = np.full((60, 80), 100, np.uint8)
    swing = [gone] * frames + [rest] * (20 - frames)
    assert room.moving_part(rest, swing)[25:35, 35:45].all() == hangs


@pytest.mark.parametrize(("off_m", "refused"), [(0.009, False), (0.011, True)])
def test_a_named_point_a_centimetre_off_is_another_one(off_m, refused) -> None:
    """So far from where it should be beside the others, after the best rigid fit (scipy's)."""

    def left(push: float) -> tuple[np.ndarray, float]:
        places = STATED + np.array([[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, push]])
        a, b = STATED - STATED.mean(axis=0), places - places.mean(axis=0)
        turn = Rotation.align_vectors(b, a)[0]
        return places, float(np.linalg.norm(b - turn.apply(a), axis=1).max())

    push = off_m
    for _ in range(20):
        push *= off_m / left(push)[1]
    with pytest.raises(DataError, match="from where") if refused else nullcontext():
        named_points.rigid(STATED, left(push)[0], "clicks.csv", list("ABCD"))


def modelled(monkeypatch, count: int, off_px: float) -> room.RestModel:
    """A platform of so many points in two cameras; the first point is off in one of them."""
    cameras = boxes.cameras()[:2]
    points = boxes.HOME_M + np.random.default_rng(1).uniform(-0.1, 0.1, (count, 3))
    pixels = [camera.project(camera.to_camera(points)) for camera in cameras]
    pixels[0][0, 0] += off_px
    given = iter(pixels)

    class Finder:
        def look(self, _image):
            seen = next(given)
            return room.Features(seen, np.ones(count), np.zeros((count, 128), np.float32))

    both = np.arange(count)
    monkeypatch.setattr(room, "FeatureFinder", Finder)
    monkeypatch.setattr(room, "matched", lambda *_: (both, both))
    monkeypatch.setattr(room, "triangulate", lambda *_: points)
    monkeypatch.setattr(room, "patches_at_rest", lambda _c, _r, inside, *_: (inside, None, {}))
    monkeypatch.setattr(room, "named_frame", lambda *_: (np.eye(4), np.zeros(6)))
    rests = {camera.name: np.zeros((480, 640), np.uint8) for camera in cameras}
    untagged = Untagged(Path("rest"), Path("clicks.csv"), ())
    return room.rest_model(cameras, rests, {}, untagged)


@pytest.mark.parametrize(
    ("count", "off_px", "enough"),
    [(29, 0.0, False), (30, 0.0, True), (30, 1.8, True), (30, 2.2, False)],
)
def test_a_platform_has_thirty_points_on_which_cameras_agree(
    monkeypatch, count, off_px, enough
) -> None:
    with nullcontext() if enough else pytest.raises(DataError, match="need 30"):
        modelled(monkeypatch, count, off_px)


def test_a_click_is_good_to_half_a_pixel(tmp_path) -> None:
    path = tmp_path / "clicks.csv"
    path.write_text("camera,point,u_px,v_px\ncam0,A,1,2\n")
    found = named_points._clicks(Untagged(tmp_path, path, (Marker("A", np.zeros(3)),)), ["cam0"])
    assert found["cam0", "A"][2] == pytest.approx(0.5, rel=0.15)


def test_the_frame_at_rest_is_as_good_as_what_is_seen_there() -> None:
    """Patches of 0.3 px say 0.3 of what features of one pixel say of the frame."""
    cameras, rest = boxes.cameras(), transform(np.eye(3), boxes.HOME_M)
    points = np.random.default_rng(1).uniform(-0.1, 0.1, (50, 3))
    pixels = [camera.project(camera.to_camera(points + boxes.HOME_M)) for camera in cameras]
    every = np.arange(50)
    at_rest = {
        camera.name: SeenAtRest(every, one, np.full(50, 0.3))
        for camera, one in zip(cameras, pixels, strict=True)
    }
    model = SimpleNamespace(at_rest=at_rest, T_base_rest=rest)
    _, covariance = at_home(points, model, cameras)
    count = len(cameras)
    camera_of, every = np.repeat(np.arange(count), 50), np.tile(points, (count, 1))
    _, alone = still_pose(
        cameras, camera_of, every, np.concatenate(pixels), np.ones(50 * count), rest
    )
    assert np.sqrt(np.trace(covariance) / np.trace(alone)) == pytest.approx(0.3, rel=0.05)
