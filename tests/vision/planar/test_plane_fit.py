"""The plane of a platform by one camera: from projected corners, made with the full lens."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.calib.camera.camera import Camera
from freeswing.vision.planar.film_faults import moved_text, size_text
from freeswing.vision.planar.fit_plane import fit_planes
from freeswing.vision.planar.plane import Items
from tests.vision.planar.benches_from_above import plate_tag
from tests.vision.scenes import look_at

NOISE_PX = 0.03
GUESS_PX = 800.0


def poses(n: int = 240) -> tuple[np.ndarray, np.ndarray]:
    """Times and x, y, chi of two sways and a fading yaw."""
    t = np.arange(n) / 30.0
    chi = 0.15 * np.exp(-0.02 * t) * np.cos(2.0 * np.pi * 0.61 * t + 0.4)
    x = 0.008 * np.cos(2.0 * np.pi * 0.455 * t) + 0.002
    y = 0.011 * np.sin(2.0 * np.pi * 0.457 * t + 1.0) - 0.001
    return t, np.column_stack([x, y, chi])


def items_of(poses_m: np.ndarray, tags, bend: float = 0.0, lean: float = 0.3) -> Items:
    """What a camera that leans sees of tags, as rays of a straight lens of another focal length."""
    above = look_at((0.05, -1.2 * np.sin(lean), 1.2 * np.cos(lean)), (0.0, 0.0, 0.0), up=(0, 1, 0))
    lens = np.array([820.0, 820.0, 0.0, 0.0, bend, 0.0, 0.0, 0.0])
    camera = Camera("above", (1280, 720), "OPENCV", lens, above)
    rng = np.random.default_rng(4)
    frames, points, rays = [], [], []
    for k, (x, y, chi) in enumerate(poses_m):
        turn = np.array([[np.cos(chi), -np.sin(chi), 0], [np.sin(chi), np.cos(chi), 0], [0, 0, 1]])
        for tag in tags:
            corners = tag.corners_platform_m
            pixels = camera.project(camera.to_camera(corners @ turn.T + [x, y, 0.0]))
            frames.append(k)
            points.append(corners)
            rays.append((pixels + rng.normal(0.0, NOISE_PX, (4, 2))) / GUESS_PX)
    white = np.tile(GUESS_PX / NOISE_PX * np.eye(8), (len(frames), 1, 1))
    return Items(np.array(frames), np.array(points), np.array(rays), white)


def back_by(angle_rad: float) -> np.ndarray:
    """Into axes that are turned by an angle about the vertical."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("bend", [0.0, -0.1])
@pytest.mark.parametrize("tags", [1, 3])
def test_an_unknown_lens_that_leans_gives_yaw_and_sway_within_their_deviations(
    tags: int, bend: float
) -> None:
    """Seventeen degrees of lean; the focal length is another than guessed."""
    true = poses()[1]
    places = [(0.1, 0.04, 0.02), (-0.12, 0.06, 0.02), (0.02, -0.15, 0.02)][:tags]
    plate = [plate_tag(k, 0.08, at) for k, at in enumerate(places)]
    fit = fit_planes([items_of(true, plate, bend)], [len(true)], 1.0, lens_known=False)
    run = fit.runs[0]
    rest, mean = run.poses.mean(axis=0), true.mean(axis=0)
    turn = back_by(rest[2])
    off = (run.poses - rest) @ turn.T - (true - mean) @ back_by(mean[2]).T
    stds = np.sqrt(np.diagonal(turn @ (run.covariances + run.systematic) @ turn.T, 0, 1, 2))
    z = off / stds
    assert np.sqrt(np.mean(z**2, axis=0)).max() < 1.5, np.sqrt(np.mean(z**2, axis=0))
    assert off[:, 2].std() < 6e-4, off[:, 2].std()
    gain = off[:, 2] @ true[:, 2] / (true[:, 2] @ true[:, 2])
    assert abs(gain) < 0.01, gain
    focal = GUESS_PX * np.exp(fit.lens[0])
    assert abs(focal - 820.0) < 4.0 * focal * fit.lens_std[0] + 8.0, (focal, fit.lens_std)


def test_deviations_grow_where_a_lens_is_not_known() -> None:
    """The same corners by a known lens say no less than by an unknown one."""
    true = poses()[1]
    seen = items_of(true, [plate_tag(0, 0.08)])
    known, unknown = (fit_planes([seen], [len(true)], 1.0, lens_known=k) for k in (True, False))
    assert known.lens_std.max() == 0.0
    assert unknown.lens_std.min() > 0.0
    spread = [float(np.trace(fit.runs[0].systematic.mean(axis=0))) for fit in (known, unknown)]
    assert spread[1] > spread[0], spread


@pytest.mark.parametrize(("factor", "named"), [(0.5, True), (1.3, False), (1.0, False), (2, True)])
def test_a_tag_of_another_size_is_named(factor: float, named: bool) -> None:
    """The platform turns about its middle; with a wrong size it seems to turn elsewhere."""
    true = poses()[1]
    at = np.array([0.12, 0.05])
    cos, sin = np.cos(true[:, 2]), np.sin(true[:, 2])
    arm = np.column_stack([cos * at[0] - sin * at[1], sin * at[0] + cos * at[1]])
    seen = np.column_stack([factor * (true[:, :2] + arm) - arm, true[:, 2]])
    said = size_text(seen, at, 0.1, "a")
    assert (said is not None) == named, said
    if said is not None:
        told = float(said.split("size_m ")[2].split(" times")[0].strip())
        assert told == pytest.approx(factor, rel=0.05), said


@pytest.mark.parametrize(("step_m", "named"), [(0.0, False), (0.0002, False), (0.002, True)])
def test_a_camera_that_moved_is_named_with_its_time(step_m: float, named: bool) -> None:
    """A step of x between two oscillating parts."""
    times, true = poses()
    seen = true + np.random.default_rng(0).normal(0.0, 5e-5, true.shape)
    seen[times > 4.2, 0] += step_m
    said = moved_text(times, seen, "a")
    assert (said is not None) == named, said
    if said is not None:
        assert "at 4.2" in said, said


@pytest.mark.parametrize("yaw_hz", [0.47, 0.51, 0.55])
def test_yaw_that_is_nearly_as_slow_as_sway_is_no_step(yaw_hz: float) -> None:
    """Two wires: yaw was taken for sway's oscillation, and what was left of it for a knock."""
    times, true = poses()
    true[:, 2] = 0.18 * np.cos(2.0 * np.pi * yaw_hz * times + 0.4)
    seen = true + np.random.default_rng(0).normal(0.0, [5e-5, 5e-5, 3e-4], true.shape)
    assert moved_text(times, seen, "a") is None
    seen[times > 4.2, 0] += 0.003
    said = moved_text(times, seen, "a")
    assert said is not None
    assert "at 4.2" in said, said
