"""Rings of cameras that look inwards and share no view of the board: surveyed tags join them."""

from __future__ import annotations

import json
import os
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import read_cameras
from freeswing.calib.rig.solve_rig import solve_rig, start_cameras
from freeswing.calib.rig.tie_by_shared_boards import base_tie, board_groups
from freeswing.calib.rig.triangulation import triangulate
from freeswing.calib.rig.views import FixedPoints, Views, make_views
from freeswing.calib.verdict.halves_and_lengths import rigidly_fitted, volume_std_m
from freeswing.cdpr.files.documents import DataError, dump_toml
from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.cdpr.measured.pose_errors import read_pose_errors
from freeswing.cdpr.measured.target import Tag, Target, write_target
from freeswing.cdpr.rotation import exp_rotation, invert, log_rotation, transform
from freeswing.main import main
from freeswing.vision.render.patterns import charuco_patch, tag_patch
from freeswing.vision.render.record import record
from freeswing.vision.render.render_scene import Look, Scene
from tests.calib import rigs
from tests.calib.films import BOARD, FLIP
from tests.places import SAMPLES

STEP_RAD = {3: np.radians(100.0), 4: np.radians(90.0)}
TAG_M = 0.2
SURVEY_M, LAYOUT_M = 1e-4, 3e-4


def ring(count: int) -> tuple[Camera, ...]:
    return rigs.rig(count, 3, arc_rad=STEP_RAD[count] * (count - 1))


def tags_before(camera: Camera) -> list[np.ndarray]:
    """Corners of two tags that this camera sees, one nearer than the other, TL TR BR BL, (4, 3)."""
    forward, right = camera.T_camera_base[2, :3], camera.T_camera_base[0, :3]
    far, near = (camera.position_base_m + depth * forward for depth in (3.3, 1.9))
    corner = 0.5 * TAG_M * np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]])
    places = (far - 0.6 * right + [0, 0, 0.45], near + 0.65 * right - [0, 0, 0.35])
    up = -camera.T_camera_base[1, :3]
    return [place + corner[:, :1] * right + corner[:, 1:] * up for place in places]


def survey(cameras: tuple[Camera, ...], sigma_px: float, std_m: float) -> FixedPoints:
    """Each camera's own two tags, surveyed and seen with noise."""
    rng = np.random.default_rng(8)
    points, camera_of, point_of, pixels, names = [], [], [], [], []
    for index, camera in enumerate(cameras):
        for tag in tags_before(camera):
            seen = camera.project(camera.to_camera(tag)) + sigma_px * rng.normal(size=(4, 2))
            camera_of += [index] * 4
            point_of += range(len(points), len(points) + 4)
            names += [f"tag36h11:{len(points) // 4} {k}" for k in ("TL", "TR", "BR", "BL")]
            points += list(tag)
            pixels.append(seen)
    told = np.array(points) + std_m * rng.normal(size=(len(points), 3))
    return FixedPoints(
        tuple(names), told, np.full(len(points), std_m), np.array(camera_of), np.array(point_of),
        np.concatenate(pixels), np.ones(len(points)),
    )  # fmt: skip


def boards_apart(cameras: tuple[Camera, ...], count: int, sigma_px: float) -> Views:
    """A board shown to one camera after the other, never to two at once."""
    points, rows = rigs.board(), []
    for index, camera in enumerate(cameras):
        poses = rigs.poses((camera,), count, seed=20 + index)
        views = rigs.observe((camera,), poses, points, sigma_px, seed=index)
        moments = count * index + views.moment
        rows += [(index, m, p) for m, p in zip(moments, views.pixels, strict=True)]
    return make_views([r[0] for r in rows], [r[1] for r in rows], np.array([r[2] for r in rows]))


WAYS = (
    "film the board where one of",
    "record a swing in which each of these cameras sees two of the platform's tags",
    "survey base tags so that each of these cameras sees two, one a third nearer than the other",
    "six points that are marked in points.csv",
    "calibrate --scene",
)


def middle_points() -> np.ndarray:
    return np.random.default_rng(2).uniform(-0.3, 0.3, (60, 3))


def volume_error_m(found: tuple[Camera, ...], true: tuple[Camera, ...]) -> float:
    """Rms distance at which the found rig puts points that the true one sees, near the middle."""
    points = middle_points()
    pixels = np.stack([camera.project(camera.to_camera(points)) for camera in true])
    off = triangulate(found, pixels) - points
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))


@pytest.mark.parametrize("count", [3, pytest.param(4, marks=pytest.mark.slow)])
def test_two_surveyed_tags_each_join_a_ring(count) -> None:
    cameras = ring(count)
    views = boards_apart(cameras, 14, 0.05)
    assert board_groups(count, views).tolist() == list(range(count))
    names, sizes = tuple(c.name for c in cameras), tuple(c.size_px for c in cameras)
    starts = start_cameras(names, sizes, ("OPENCV",) * count, rigs.board(), views)
    with pytest.raises(DataError) as untied:
        solve_rig(rigs.board(), starts)
    for way in WAYS:
        assert way in str(untied.value), way
    fixed = survey(cameras, 0.02, 1e-4)
    tie = base_tie(tuple(start.camera for start in starts), fixed)
    rig = solve_rig(rigs.board(), starts, tie=tie)
    assert rig.adjustment.rank == rig.problem.free.sum()
    residual_px = float(np.sqrt(np.mean(rig.adjustment.fixed_residuals_px**2)))
    assert residual_px < 0.1, f"{residual_px} px"
    square, free = rigs.error_square_in_base(rig, cameras)
    assert square / free < 1.6, f"chi-square {square:.0f} of {free}"
    error = volume_error_m(rig.cameras, cameras)
    claimed = volume_std_m(rig.adjustment, middle_points())
    assert error < 2.5 * claimed < 1e-3, f"{1e3 * error:.2f} mm, claimed {1e3 * claimed:.2f} mm"


def boards_before(cameras, shown: int, *, hidden: bool = False):
    """A board shown to one camera after the other, `shown` times each: its motion by frames.

    Where it is to be `hidden` from the others its face is turned away from them.
    """
    each, many = shown * len(cameras), 12 * shown if hidden else shown
    tried = [rigs.poses((camera,), many, 40 + k, tilt=0.5) for k, camera in enumerate(cameras)]
    kept = [
        np.array([p for p in poses if not (hidden and seen_aside(p, cameras, k))])[:shown]
        for k, poses in enumerate(tried)
    ]
    assert [len(poses) for poses in kept] == [shown] * len(cameras)
    poses = np.concatenate(kept) @ FLIP

    def motion(times_s):
        index = np.clip(np.round(times_s).astype(int), 0, each - 1)
        return poses[index, :3, 3], poses[index, :3, :3]

    return motion, np.arange(float(each))


def seen_aside(pose: np.ndarray, cameras, own: int) -> bool:
    """Whether another camera than its own sees the board's face at more than a grazing angle."""
    arms = [camera.position_base_m - pose[:3, 3] for k, camera in enumerate(cameras) if k != own]
    return any(-pose[:3, 2] @ arm > 0.12 * np.linalg.norm(arm) for arm in arms)


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    """Gives a ring's recordings, boards hidden from all cameras but one, and its tags' corners."""
    made: dict[int, tuple] = {}

    def of(count: int) -> tuple:
        if count not in made:
            made[count] = film(tmp_path_factory.mktemp("ring") / "calibration", count)
        return made[count]

    return of


def film(folder: Path, count: int) -> tuple:
    cameras = tuple(film_camera(camera) for camera in ring(count))
    motion, stamps = boards_before(cameras, 12, hidden=True)
    tags = [tags_before(camera) for camera in cameras]
    patches = [
        tag_patch("tag36h11", 100 + k, TAG_M, tag_pose(corners), "base")
        for k, corners in enumerate(np.concatenate(tags))
    ]
    board = charuco_patch(
        tuple(BOARD["squares"]), BOARD["square_m"], BOARD["marker_m"], BOARD["dictionary"]
    )
    scene = Scene((*patches, board), motion)
    record(folder, cameras, scene, stamps, Look(), 4, images=True, stamps_file=False)
    return folder, cameras, tags


def surveyed(tags: list, std_m: float) -> list[dict]:
    """The tags as session.toml states them."""
    rng, tables = np.random.default_rng(5), []
    for k, corners in enumerate(np.concatenate(tags)):
        told = corners + std_m * rng.normal(size=(4, 3))
        tables.append({"family": "tag36h11", "id": 100 + k, "corners_base_m": told.tolist()})
    return tables


def judged(folder: Path, cameras: tuple[Camera, ...]) -> tuple[float, float, dict]:
    """Error of points in the middle, what is claimed, and the document, once chi-square holds.

    Of 42 unknowns it is beyond 1.75 of their number once in 500.
    """
    found = read_cameras(folder / "cameras.toml")
    document = json.loads((folder / "results" / "calibration.json").read_text())
    names, matrix = document["covariance"]["names"], np.array(document["covariance"]["matrix"])
    parts = []
    for camera, true in zip(found, cameras, strict=True):
        turn = true.T_camera_base[:3, :3] @ camera.T_camera_base[:3, :3].T
        shift = true.T_camera_base[:3, 3] - camera.T_camera_base[:3, 3]
        parts += [true.params - camera.params, shift, log_rotation(turn)]
    own = [k for k, name in enumerate(names) if not name.endswith(("offset_s", "time_s"))]
    error = np.concatenate(parts)
    square = float(error @ np.linalg.solve(matrix[np.ix_(own, own)], error))
    assert square / len(error) < 1.75, f"chi-square {square:.0f} of {len(error)}"
    return volume_error_m(found, cameras), document["checks"]["volume_std_m"], document


def linked(folder: Path, recordings: Path) -> Path:
    shutil.copytree(recordings, folder / "calibration", copy_function=os.link)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("count", [3, 4])
def test_a_rendered_ring_is_tied_by_two_surveyed_tags_each(tmp_path, filmed, count) -> None:
    recordings, cameras, tags = filmed(count)
    write_session(linked(tmp_path, recordings), surveyed(tags, SURVEY_M))
    assert main(["calibrate", str(tmp_path), "--quiet"]) == 0
    error, claimed, document = judged(tmp_path, cameras)
    assert any("no board view joins" in text for text in document["verdict"]["warnings"])
    assert document["base_frame"]["reprojection_px"] < 0.1, document["base_frame"]
    assert error < min(2.5 * claimed, 2e-4), f"{1e3 * error:.3f} mm, claimed {1e3 * claimed:.3f}"


@pytest.mark.slow
def test_marked_points_tie_a_ring_that_nothing_else_ties(tmp_path, filmed, capsys) -> None:
    recordings, cameras, tags = filmed(3)
    folder, rng = linked(tmp_path, recordings), np.random.default_rng(6)
    write_session(folder, [])
    assert main(["calibrate", str(folder), "--quiet"]) == 1
    said = capsys.readouterr().err
    assert all(way in said for way in ("cam0", "cam1", "cam2", *WAYS)), said
    rows, points = ["camera,point,u_px,v_px,std_px"], []
    for camera, own in zip(cameras, tags, strict=True):
        for place in np.concatenate(own) + rng.uniform(-0.15, 0.15, (8, 3)):
            name = f"bolt {len(points)}"
            u, v = camera.project(camera.to_camera(place)) + 0.05 * rng.normal(size=2)
            rows.append(f"{camera.name},{name},{u:.3f},{v:.3f},0.05")
            told = place + SURVEY_M * rng.normal(size=3)
            points.append({"name": name, "position_base_m": told.tolist(), "std_m": SURVEY_M})
    (folder / "calibration" / "points.csv").write_text("\n".join(rows) + "\n")
    write_session(folder, [], surveyed=points)
    assert main(["calibrate", str(folder), "--quiet"]) == 0
    error, claimed, document = judged(folder, cameras)
    assert document["base_frame"]["source"] == "survey", document["base_frame"]
    assert error < 2.5 * claimed < 2e-3, f"{1e3 * error:.3f} mm, claimed {1e3 * claimed:.3f}"


def platform_tags() -> list[Tag]:
    """Tags on the faces of a box: whoever looks from aside sees two or three of them."""
    tags = []
    for number in range(6):
        angle = np.radians(60.0 * number)
        out, up = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([0.0, 0.0, 1.0])
        turn = np.stack([np.cross(up, out), up, out], axis=1)
        height = 0.06 * (-1.0) ** number
        tags.append(Tag("tag36h11", number, 0.16, transform(turn, 0.22 * out + height * up)))
    return tags


def moved_tag(tag: Tag, rng: np.random.Generator) -> Tag:
    """The tag shifted, and turned by what moves its corners as far."""
    T = tag.T_platform_tag.copy()
    T[:3, 3] += LAYOUT_M * rng.normal(size=3)
    reach = tag.size_m / np.sqrt(2.0)
    T[:3, :3] = exp_rotation(LAYOUT_M / reach * rng.normal(size=3)) @ T[:3, :3]
    return replace(tag, T_platform_tag=T)


def swing(times_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A platform that swings by some centimetres and turns by some degrees."""
    t = np.asarray(times_s)
    rates, sizes = np.array([0.71, 0.53, 1.3]), np.array([0.08, 0.06, 0.01])
    turns, angles = np.array([0.9, 1.1, 0.37]), np.array([0.08, 0.1, 0.3])
    phase = 2.0 * np.pi * t[:, None]
    return sizes * np.sin(rates * phase + [0.0, 1.0, 2.0]), exp_rotation(
        angles * np.sin(turns * phase + [1.0, 0.0, 0.5])
    )


@pytest.mark.slow
@pytest.mark.parametrize("count", [3, 4])
def test_the_swings_tie_a_ring(tmp_path, count) -> None:
    """No base tag and no shared view of the board: one rigid body swings before all cameras.

    target.toml has its tags where they were measured, 0.3 mm off.
    """
    around = ring(count)
    clocks = (0.0, 0.0031, -0.0024, 0.0012)
    cameras = tuple(
        replace(film_camera(camera), clock_offset_s=clock)
        for camera, clock in zip(around, clocks, strict=False)
    )
    motion, stamps = boards_before(cameras, 12, hidden=True)
    board = charuco_patch(
        tuple(BOARD["squares"]), BOARD["square_m"], BOARD["marker_m"], BOARD["dictionary"]
    )
    still = tuple(replace(camera, clock_offset_s=0.0) for camera in cameras)
    folder = tmp_path / "calibration"
    record(
        folder, still, Scene((board,), motion), stamps, Look(), 4, images=True, stamps_file=False
    )
    write_session(tmp_path, [])
    tags = platform_tags()
    measured = tuple(moved_tag(tag, np.random.default_rng(tag.id)) for tag in tags)
    write_target(tmp_path / "target.toml", Target(measured))
    patches = tuple(tag_patch(t.family, t.id, t.size_m, t.T_platform_tag) for t in tags)
    record(
        tmp_path / "runs" / "swing", cameras, Scene(patches, swing), np.arange(60) / 30.0, Look(), 5
    )
    assert main(["calibrate", str(tmp_path), "--quiet"]) == 0
    found = read_cameras(tmp_path / "cameras.toml")
    document = json.loads((tmp_path / "results" / "calibration.json").read_text())
    warned = document["verdict"]["warnings"]
    apart = " | ".join(camera.name for camera in cameras)
    assert any(f"{apart}. The platform's tags in the swings do" in text for text in warned), warned
    reference = next(k for k, c in enumerate(found) if np.allclose(c.T_camera_base, np.eye(4)))
    T = cameras[reference].T_camera_base
    true = tuple(replace(c, T_camera_base=c.T_camera_base @ invert(T)) for c in cameras)
    points = middle_points() @ T[:3, :3].T + T[:3, 3]
    pixels = np.stack([camera.project(camera.to_camera(points)) for camera in true])
    seen = triangulate(found, pixels)
    error = rms(seen - points)
    claimed = document["checks"]["volume_std_m"]
    assert error < 2.5 * claimed < 2e-3, f"{1e3 * error:.3f} mm, claimed {1e3 * claimed:.3f} mm"
    # without base tags the frame is a camera's, and goes with its lens: what is left is the rig's
    error = rms(seen - rigidly_fitted(points, seen))
    assert error < 2e-4, f"{1e3 * error:.3f} mm"
    assert document["layout"]["worst_mismatch_mm"] > 0.2, document["layout"]
    check_track(tmp_path, T)
    for camera, one in zip(found, cameras, strict=True):
        late = camera.clock_offset_s - found[0].clock_offset_s
        wanted = one.clock_offset_s - cameras[0].clock_offset_s
        assert abs(late - wanted) < 2e-4, (camera.name, late, wanted)


def check_track(folder: Path, T_first: np.ndarray) -> None:
    """Tracked by the cameras and tags of one fit: nothing is off, and claims of poses hold.

    Both frames are free, 12 numbers: the base is a camera's, and what all tags do together is none
    of theirs. With target.toml's own places cameras were 0.37 mm apart and two of them moved.
    """
    assert main(["track", str(folder), "--quiet"]) == 0
    told = json.loads((folder / "results" / "tracking.json").read_text())
    assert told["runs"][0]["problems"] == []
    assert told["effects"] == []
    assert told["layout"]["worst_mismatch_mm"] > 0.2, told["layout"]
    track = read_trajectory(folder / "results" / "tracks" / "swing.csv")
    deviations = track.standard_deviations()
    assert deviations is not None
    places, turns = swing(track.times_s)
    first = log_rotation(track.rotations()[0] @ turns[0].T)
    start = np.concatenate([first, track.positions()[0] - exp_rotation(first) @ places[0]])

    def off(frames: np.ndarray) -> np.ndarray:
        base, inner = exp_rotation(frames[:3]), exp_rotation(frames[6:9])
        at = (places + turns @ frames[9:]) @ base.T + frames[3:6]
        turned = track.rotations() @ np.swapaxes(base @ turns @ inner, 1, 2)
        errors = np.concatenate([track.positions() - at, log_rotation(turned)], axis=1)
        return (errors / deviations).ravel()

    z = least_squares(off, np.concatenate([start, np.zeros(6)]), x_scale="jac").fun
    assert np.sqrt(np.mean(z**2)) < 1.5, np.sqrt(np.mean(z.reshape(-1, 6) ** 2, axis=0))
    check_shared(folder, track, told["runs"][0]["calibration_errors"], T_first)


def check_shared(folder: Path, track, told: dict, T_first: np.ndarray) -> None:
    """The mean error of the poses, no frame freed, by what all poses share: chi-square of six.

    Beyond 20 it is three times in a thousand. By the cameras alone it is 2700 and 2800.
    """
    places, turns = swing(track.times_s)
    places, turns = places @ T_first[:3, :3].T + T_first[:3, 3], T_first[:3, :3] @ turns
    rates = np.concatenate([np.gradient(places, track.times_s, axis=0), np.zeros_like(places)], 1)
    turned = log_rotation(track.rotations() @ np.swapaxes(turns, 1, 2))
    error = np.concatenate([track.positions() - places, turned], axis=1)
    modes = read_pose_errors(told).at(track.positions(), track.rotations(), rates).mean(axis=0)
    square = float(error.mean(0) @ np.linalg.solve(modes @ modes.T, error.mean(0)))
    assert square < 20.0, (square, error.mean(axis=0), np.sqrt(np.sum(modes**2, axis=1)))


def rms(off: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))


def film_camera(camera: Camera) -> Camera:
    scale = np.array([0.625] * 4 + [1.0] * 4)
    return replace(camera, size_px=(800, 640), params=camera.params * scale)


def tag_pose(corners: np.ndarray) -> np.ndarray:
    x, y = corners[1] - corners[0], corners[0] - corners[3]
    x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
    return transform(np.stack([x, y, np.cross(x, y)], axis=1), corners.mean(axis=0))


def write_session(folder: Path, tables: list[dict], **more: object) -> None:
    for name in ("robot.toml", "target.toml"):
        (folder / name).write_text((SAMPLES / "filmed" / name).read_text())
    session = {
        "format": "freeswing-session/1",
        "name": "ring",
        "robot": "robot.toml",
        "target": "target.toml",
        "cameras": "cameras.toml",
        "frame_rate_hz": 30.0,
        "calibration": {"recordings": "calibration", "board": BOARD, "base_tags": tables, **more},
        "runs": [{"name": "swing", "role": "identify", "video": "runs/swing"}],
    }
    dump_toml(folder / "session.toml", session)
