"""Rings of cameras that look inwards and share no view of the board: surveyed tags join them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import read_cameras
from freeswing.calib.rig.rig_start import base_tie, board_groups
from freeswing.calib.rig.solve_rig import solve_rig, start_cameras
from freeswing.calib.rig.triangulation import triangulate
from freeswing.calib.rig.views import FixedPoints, Views, make_views
from freeswing.calib.verdict.truth_checks import rigidly_fitted, volume_std_m
from freeswing.cdpr.files.documents import DataError, dump_toml
from freeswing.cdpr.measured.target import Tag, Target, write_target
from freeswing.cdpr.rotation import exp_rotation, invert, transform
from freeswing.main import main
from freeswing.vision.render.patterns import charuco_patch, tag_patch
from freeswing.vision.render.record import record
from freeswing.vision.render.render_scene import Look, Scene
from tests.calib import rigs
from tests.calib.films import BOARD, FLIP
from tests.places import SAMPLES

STEP_RAD = np.radians(100.0)
TAG_M = 0.2


def ring(count: int) -> tuple[Camera, ...]:
    return rigs.rig(count, 3, arc_rad=STEP_RAD * (count - 1))


def tags_before(camera: Camera) -> list[np.ndarray]:
    """Corners of two tags on the far side that this camera sees, TL TR BR BL, (4, 3) each."""
    forward, right = camera.T_camera_base[2, :3], camera.T_camera_base[0, :3]
    middle = camera.position_base_m + 3.3 * forward
    corner = 0.5 * TAG_M * np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]])
    places = (middle - 0.6 * right + [0, 0, 0.45], middle + 0.55 * right - [0, 0, 0.35])
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
    with pytest.raises(DataError, match="each of these cameras sees two"):
        solve_rig(rigs.board(), starts)
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
    assert error < 2.5 * claimed < 6e-3, f"{1e3 * error:.2f} mm, claimed {1e3 * claimed:.2f} mm"


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


@pytest.mark.slow
@pytest.mark.parametrize("count", [3, 4])
def test_a_rendered_ring_through_the_command_line(tmp_path, count) -> None:
    cameras = tuple(film_camera(camera) for camera in ring(count))
    motion, stamps = boards_before(cameras, 16)
    patches, tables, rng = [], [], np.random.default_rng(5)
    for camera in cameras:
        for corners in tags_before(camera):
            number = 100 + len(tables)
            patches.append(tag_patch("tag36h11", number, TAG_M, tag_pose(corners), "base"))
            told = corners + 1e-4 * rng.normal(size=(4, 3))
            tables.append({"family": "tag36h11", "id": number, "corners_base_m": told.tolist()})
    board = charuco_patch(
        tuple(BOARD["squares"]), BOARD["square_m"], BOARD["marker_m"], BOARD["dictionary"]
    )
    scene = Scene((*patches, board), motion)
    folder = tmp_path / "calibration"
    record(folder, cameras, scene, stamps, Look(), 4, images=True, stamps_file=False)
    write_session(tmp_path, tables)
    assert main(["calibrate", str(tmp_path), "--quiet"]) == 0
    found = read_cameras(tmp_path / "cameras.toml")
    error = volume_error_m(found, cameras)
    document = json.loads((tmp_path / "results" / "calibration.json").read_text())
    assert any("no board view joins" in text for text in document["verdict"]["warnings"])
    assert document["base_frame"]["reprojection_px"] < 0.1, document["base_frame"]
    claimed = document["checks"]["volume_std_m"]
    assert error < 2.5 * claimed, f"{1e3 * error:.2f} mm, claimed {1e3 * claimed:.2f} mm"


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
    """No base tag and no shared view of the board: one rigid body swings before all cameras."""
    step_rad = np.radians({3: 100.0, 4: 90.0}[count])
    around = rigs.rig(count, 3, arc_rad=step_rad * (count - 1))
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
    write_target(tmp_path / "target.toml", Target(tuple(tags)))
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
    for camera, one in zip(found, cameras, strict=True):
        late = camera.clock_offset_s - found[0].clock_offset_s
        wanted = one.clock_offset_s - cameras[0].clock_offset_s
        assert abs(late - wanted) < 2e-4, (camera.name, late, wanted)


def rms(off: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))


def film_camera(camera: Camera) -> Camera:
    scale = np.array([0.625] * 4 + [1.0] * 4)
    return replace(camera, size_px=(800, 640), params=camera.params * scale)


def tag_pose(corners: np.ndarray) -> np.ndarray:
    x, y = corners[1] - corners[0], corners[0] - corners[3]
    x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
    return transform(np.stack([x, y, np.cross(x, y)], axis=1), corners.mean(axis=0))


def write_session(folder: Path, tables: list[dict]) -> None:
    for name in ("robot.toml", "target.toml"):
        (folder / name).write_text((SAMPLES / "filmed" / name).read_text())
    session = {
        "format": "freeswing-session/1",
        "name": "ring",
        "robot": "robot.toml",
        "target": "target.toml",
        "cameras": "cameras.toml",
        "frame_rate_hz": 30.0,
        "calibration": {"recordings": "calibration", "board": BOARD, "base_tags": tables},
        "runs": [{"name": "swing", "role": "identify", "video": "runs/swing"}],
    }
    dump_toml(folder / "session.toml", session)
