"""Round markers: sub-pixel centres, a ball's true centre, names by geometry, one point alone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.cdpr.measured.target import Marker, Target
from freeswing.cdpr.rotation import exp_rotation, log_rotation
from freeswing.vision.look.marker_blobs import ball_shrink, find_blobs
from freeswing.vision.look.marker_pose import pose_from_one_view
from freeswing.vision.render.patterns import Sphere
from freeswing.vision.render.record import record
from freeswing.vision.render.render_scene import Look, Renderer, Scene, still
from tests.vision.films import tracked
from tests.vision.scenes import OPENCV_PARAMS, arc_of_cameras, camera, swing

PLACES = np.array(
    [
        [0.0, -0.1, 0.0],
        [0.22, -0.05, 0.05],
        [-0.18, -0.12, 0.12],
        [0.05, -0.2, -0.2],
        [-0.1, 0, -0.1],
    ]
)
NAMES = ("A", "B", "C", "D", "E")


@dataclass
class FilmedRun:
    name: str
    video: Path


def track(tmp_path, markers, count=40, chosen=slice(None)):
    half = [v / 2 for v in OPENCV_PARAMS[:4]] + OPENCV_PARAMS[4:]
    cameras = arc_of_cameras(3, 1.9, size_px=(360, 288), params=half)[chosen]
    balls = tuple(Sphere(m.position_m, m.diameter_m) for m in markers)
    scene = Scene((), swing, balls)
    record(tmp_path / "run", cameras, scene, np.arange(count) / 50.0, Look(background=50.0))
    document = tracked(
        [FilmedRun("run", tmp_path / "run")],
        cameras,
        Target((), tuple(markers)),
        results=tmp_path / "results",
        workers=1,
    )
    return document, read_trajectory(tmp_path / "results" / "tracks" / "run.csv")


def test_ball_centre_is_the_ray_of_its_centre() -> None:
    """A big ball near the image corner: its outline's middle is off, the corrected ray is not."""
    view = camera()
    centre = np.array([0.75, 0.0, 0.65])
    ball = Sphere(centre, 0.08)
    look = Look(noise=0.5, texture=0.0)
    image = Renderer(view, Scene((), still(), (ball,)), look).frame(0.0)
    blobs = find_blobs(image, view)
    assert len(blobs) == 1, f"{len(blobs)} blobs"
    place = view.to_camera(centre)
    truth = place[:2] / place[2]
    alpha = np.arcsin(0.04 / np.linalg.norm(place))
    raw = np.linalg.norm(blobs[0].ray - truth) * 900
    corrected = np.linalg.norm(blobs[0].ray * ball_shrink(blobs[0].ray, alpha) - truth) * 900
    assert corrected < 0.03, f"{corrected:.4f} px"
    assert corrected < 0.5 * raw, f"raw {raw:.4f} px, corrected {corrected:.4f} px"


@pytest.mark.slow
def test_markers_without_names_give_the_pose(tmp_path) -> None:
    markers = [Marker(n, p, 0.03) for n, p in zip(NAMES, PLACES, strict=True)]
    _, trajectory = track(tmp_path, markers)
    positions, rotations = swing(trajectory.times_s)
    known = trajectory.is_known
    error = (trajectory.positions() - positions)[known]
    turn = log_rotation((trajectory.rotations() @ np.swapaxes(rotations, 1, 2))[known])
    assert known.mean() > 0.95, f"{known.mean():.2f} of the samples known"
    assert 1e3 * np.abs(error).max() < 0.6, f"{1e3 * np.abs(error).max():.3f} mm"
    assert 1e3 * np.abs(turn).max() < 4.0, f"{1e3 * np.abs(turn).max():.2f} mrad"


def test_one_camera_starts_from_markers_alone(tmp_path) -> None:
    markers = [Marker(n, p, 0.03) for n, p in zip(NAMES, PLACES, strict=True)]
    _, trajectory = track(tmp_path, markers, chosen=slice(1, 2))
    positions, rotations = swing(trajectory.times_s)
    known = trajectory.is_known
    turn = log_rotation(trajectory.rotations() @ np.swapaxes(rotations, 1, 2))
    error = np.concatenate([trajectory.positions() - positions, turn], axis=1)[known]
    claimed = trajectory.standard_deviations()
    assert claimed is not None
    claimed = claimed[known]
    ratio = np.sqrt(np.median((error / claimed) ** 2) / 0.455)
    assert known.mean() > 0.95, f"{known.mean():.2f} of the samples known"
    assert 1e3 * np.abs(error[:, :3]).max() < 8.0, f"{1e3 * np.abs(error[:, :3]).max():.3f} mm"
    assert 0.4 < ratio < 2.0, f"errors are {ratio:.2f} times what is claimed"


def seen_by_one(layout: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A pose 1.8 m before a camera, and the spots in random order with 0.05 px of noise."""
    random = np.random.default_rng(seed)
    turn = exp_rotation(random.normal(0.0, 0.4, 3)) @ np.diag([1.0, -1.0, -1.0])
    shift = np.array([0.1, -0.05, 1.8]) + random.normal(0.0, 0.05, 3)
    places = layout @ turn.T + shift
    spots = places[:, :2] / places[:, 2:] + random.normal(0.0, 0.05 / 900, (len(layout), 2))
    return turn, shift, random.permutation(spots)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("count", [4, 5])
def test_names_and_pose_come_from_one_view(seed, count) -> None:
    turn, shift, spots = seen_by_one(PLACES[:count], seed)
    pose = pose_from_one_view(PLACES[:count], spots)
    assert pose is not None, "not found"
    off = np.linalg.norm(log_rotation(pose[0] @ turn.T)), np.linalg.norm(pose[1] - shift)
    assert off[0] < 0.01, f"{1e3 * off[0]:.2f} mrad"
    assert off[1] < 0.01, f"{1e3 * off[1]:.2f} mm"


def test_a_layout_that_looks_the_same_twice_is_not_guessed_at() -> None:
    square = 0.1 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    *_, spots = seen_by_one(square, 3)
    assert pose_from_one_view(square, spots) is None


def test_one_marker_gives_the_reference_point(tmp_path) -> None:
    _, trajectory = track(tmp_path, [Marker("P", np.zeros(3), 0.03)])
    positions, _ = swing(trajectory.times_s)
    error = trajectory.values - positions
    claimed = trajectory.standard_deviations()
    assert claimed is not None
    assert trajectory.coordinates == ("x", "y", "z"), trajectory.coordinates
    assert 1e3 * np.abs(error).max() < 0.6, f"{1e3 * np.abs(error).max():.3f} mm"
    ratio = np.sqrt(np.mean((error / claimed) ** 2))
    assert 0.3 < ratio < 2.0, f"errors are {ratio:.2f} times what is claimed"


@pytest.mark.parametrize("angle", [0.01, 0.05])
def test_ball_shrink_is_exact_on_the_cone(angle) -> None:
    theta = 0.6
    edges = np.tan(theta + angle), np.tan(theta - angle)
    middle = np.array([sum(edges) / 2, 0.0])
    truth = np.tan(theta)
    found = middle[0] * ball_shrink(middle, angle)
    assert abs(found - truth) < 3e-5, f"{found} for {truth}"
