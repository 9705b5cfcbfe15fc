"""A rendered laboratory with known truth: textured walls, surveyed tags, a rig and a walk."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.rig.triangulation import triangulate
from freeswing.session.base_tag import BaseTag
from freeswing.vision.render.patterns import Patch, tag_patch
from freeswing.vision.render.render_scene import Look, Renderer, Scene, still
from freeswing.vision.render.textured import textured_room

SIZE_PX = (960, 720)
PHONE_PX = (640, 480)
ROOM_M = (4.0, 4.0, 2.6)
TAG_M = 0.3
LENS = np.array([750.0, 751.5, 488.5, 353.5, -0.08, 0.02, 0.0005, -0.0003])
PHONE = np.array([460.0, 460.0, 316.5, 244.5, 0.03, -0.02, 0.0, 0.0])
EYES = ((1.7, 1.6, 2.1), (-1.7, 1.6, 2.0), (-1.6, -1.7, 2.2), (1.6, -1.7, 2.1))
LOOK = Look(subpixels=2)


def looking(place: Sequence[float], at: Sequence[float], roll: float = 0.0) -> np.ndarray:
    """T_camera_base of a camera at `place` that looks at a point."""
    forward = np.array(at) - np.array(place)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    turn = np.stack([right, np.cross(forward, right), forward])
    c, s = np.cos(roll), np.sin(roll)
    T = np.eye(4)
    T[:3, :3] = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ turn
    T[:3, 3] = -T[:3, :3] @ np.array(place)
    return T


def rig(count: int = 4) -> tuple[Camera, ...]:
    """Cameras in the corners that look across: no two see one side of a board."""
    cameras = []
    for k, eye in enumerate(EYES[:count]):
        lens = LENS + np.array([5.0 * k, 5.0 * k, k, -k, 0, 0, 0, 0])
        at = (-0.55 * eye[0], -0.5 * eye[1], 0.3)
        cameras.append(Camera(f"cam{k}", SIZE_PX, "OPENCV", lens, looking(eye, at)))
    return tuple(cameras)


def walk(count: int = 18) -> tuple[Camera, ...]:
    """A camera carried round, each image of it a camera."""
    cameras = []
    for k in range(count):
        t = 2.0 * np.pi * k / count
        place = (1.2 * np.cos(t), 1.2 * np.sin(t), 1.3 + 0.25 * np.sin(3 * t))
        bearing = t + 0.25 * np.sin(2 * t)
        at = (-1.8 * np.cos(bearing), -1.8 * np.sin(bearing), 0.5 + 0.4 * np.cos(2 * t))
        pose = looking(place, at, 0.2 * np.sin(2 * t))
        cameras.append(Camera(f"walk{k:03d}", PHONE_PX, "OPENCV", PHONE, pose))
    return tuple(cameras)


def surveyed_tags() -> tuple[tuple[Patch, BaseTag], ...]:
    """A tag on every wall, off its middle, so that no mirror image fits, and one on the floor."""
    found = []
    for k, (aside, up) in enumerate([(0.3, 0.9), (-0.2, 1.1), (0.1, 0.8), (-0.4, 1.0)]):
        c, s = np.cos(k * np.pi / 2.0), np.sin(k * np.pi / 2.0)
        inward, above = np.array([-c, -s, 0.0]), np.array([0.0, 0.0, 1.0])
        right = np.cross(above, inward)
        place = -1.999 * inward + aside * right + up * above
        found.append(_tag(100 + k, np.stack([right, above, inward], axis=1), place))
    return (*found, _tag(104, np.eye(3), np.array([0.15, -0.1, 0.001])))


def _tag(number: int, turn: np.ndarray, place: np.ndarray) -> tuple[Patch, BaseTag]:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = turn, place
    half = TAG_M / 2.0
    corners = np.array([[-half, half], [half, half], [half, -half], [-half, -half]])
    tag = BaseTag("tag36h11", number, corners @ turn[:, :2].T + place)
    return tag_patch("tag36h11", number, TAG_M, T, "base"), tag


def room(seed: int = 1, *, tags: bool = True) -> Scene:
    """The laboratory."""
    walls = textured_room(ROOM_M, 0.01, seed)
    return Scene(walls + tuple(patch for patch, _ in surveyed_tags() if tags), still())


def film(folder: Path, cameras: Sequence[Camera], scene: Scene, *, walk: bool) -> None:
    """One image of each camera: `<camera>/0.png` of a rig, `<image>.png` of a walk."""
    for camera in cameras:
        image = Renderer(camera, scene, LOOK).frame(0.0)
        path = folder / f"{camera.name}.png" if walk else folder / camera.name / "0.png"
        path.parent.mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(path), image)


def session(folder: Path, tags: Sequence[BaseTag], scene: str = "") -> Path:
    """A session.toml whose cameras are tied by scene/rig and scene/walk."""
    rows = [
        'format = "freeswing-session/1"', 'name = "room"', 'robot = "robot.toml"',
        "frame_rate_hz = 20.0", "[calibration]",
    ]  # fmt: skip
    for tag in tags:
        corners = [[round(float(x), 9) for x in point] for point in tag.corners_base_m]
        rows += [
            "[[calibration.base_tags]]", f'family = "{tag.family}"', f"id = {tag.id}",
            f"corners_base_m = {corners}",
        ]  # fmt: skip
    rows += ["[calibration.scene]", 'frames = "scene/rig"', 'walk = "scene/walk"', scene]
    rows += ["[[runs]]", 'name = "a"', 'role = "identify"', 'video = "runs/a"']
    path = folder / "session.toml"
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def volume_errors_m(found: Sequence[Camera], true: Sequence[Camera]) -> np.ndarray:
    """Distances of points of the working volume that true cameras see, and found ones place."""
    side = np.linspace(-0.5, 0.5, 5)
    points = np.stack(np.meshgrid(side, side, side + 1.0), axis=-1).reshape(-1, 3)
    pixels = []
    for camera in true:
        inside = camera.to_camera(points)
        seen = camera.sees(inside)[:, None]
        pixels.append(np.where(seen, camera.project(inside), np.nan))
    again = triangulate(found, np.stack(pixels))
    return np.linalg.norm(again - points, axis=1)[np.isfinite(again[:, 0])]
