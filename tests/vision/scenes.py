"""Small scenes that the vision tests share."""

from __future__ import annotations

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.measured.target import Tag
from freeswing.cdpr.rotation import exp_rotation
from freeswing.vision.render.patterns import Parent, Patch, tag_patch
from freeswing.vision.render.render_scene import Scene

OPENCV_PARAMS = [900.0, 905.0, 359.5, 287.5, -0.12, 0.05, 0.001, -0.0005]


def look_at(position, target, up=(0.0, 0.0, 1.0)) -> np.ndarray:
    """T_camera_base of a camera at `position` that looks at `target`."""
    position = np.asarray(position, float)
    z = np.asarray(target, float) - position
    z /= np.linalg.norm(z)
    x = np.cross(z, up)
    x /= np.linalg.norm(x)
    rotation = np.stack([x, np.cross(z, x), z])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, -rotation @ position
    return pose


def camera(name="cam0", position=(0.0, -2.3, 0.5), target=(0.0, 0.0, 0.0), **changes) -> Camera:
    """A 720 x 576 camera with a distorting lens."""
    values = {
        "size_px": (720, 576),
        "model": "OPENCV",
        "params": OPENCV_PARAMS,
        "T_camera_base": look_at(position, target),
    }
    return Camera(name, **(values | changes))


def facing(position=(0.0, 0.0, 0.0), yaw=0.0, roll=0.0) -> np.ndarray:
    """T_parent_tag of a tag that stands upright and faces -y, turned about z and in its plane."""
    c, s = np.cos(yaw), np.sin(yaw)
    pose = np.eye(4)
    pose[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array(
        [[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]
    )
    c, s = np.cos(roll), np.sin(roll)
    pose[:3, :3] = pose[:3, :3] @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    pose[:3, 3] = position
    return pose


def tag(tag_id=0, size_m=0.13, parent: Parent = "platform", family="tag36h11", **where) -> Patch:
    """A tag that faces the camera."""
    return tag_patch(family, tag_id, size_m, facing(**where), parent)


def swing(times_s, amplitude_m=0.12, turn_rad=0.15):
    """A swing about the origin in all six coordinates: positions (n, 3), rotations (n, 3, 3)."""
    t = np.asarray(times_s, float)
    frequencies = np.array([0.8, 0.71, 1.3])
    phases = np.array([0.0, 0.9, 2.0])
    way = np.sin(2 * np.pi * frequencies * t[:, None] + phases)
    turn = np.sin(2 * np.pi * np.array([0.9, 1.1, 0.6]) * t[:, None] + phases[::-1])
    return amplitude_m * np.array([1.0, 0.6, 0.3]) * way, exp_rotation(turn_rad * turn)


def platform_tags(size_m=0.13) -> tuple[Tag, ...]:
    """Six tags on three faces of a prism that looks towards -y."""
    tags = []
    for column, yaw in enumerate((-0.7, 0.0, 0.7)):
        for row, z in enumerate((0.1, -0.1)):
            place = (0.22 * np.sin(yaw), -0.22 * np.cos(yaw), z)
            pose = facing(place, yaw)
            tags.append(Tag("tag36h11", 2 * column + row, size_m, pose))
    return tuple(tags)


def standing_tags(size_m=0.2) -> tuple[Tag, ...]:
    """Surveyed tags behind the platform."""
    places = ((-0.55, 0.9, 0.35), (0.55, 0.9, 0.4), (-0.5, 0.8, -0.4), (0.6, 0.85, -0.45))
    return tuple(Tag("tag36h11", 100 + k, size_m, facing(p)) for k, p in enumerate(places))


def arc_of_cameras(count=4, distance_m=2.3, **changes) -> tuple[Camera, ...]:
    """Cameras on an arc in front of the platform."""
    cameras = []
    for k, azimuth in enumerate(np.linspace(-0.6, 0.6, count)):
        height = 0.35 if k % 2 else -0.15
        place = (distance_m * np.sin(azimuth), -distance_m * np.cos(azimuth), height)
        cameras.append(camera(f"cam{k}", place, **changes))
    return tuple(cameras)


def scene_of(tags, base_tags=(), motion=swing, extra=(), spheres=()) -> Scene:
    """What is filmed: the platform's tags, standing tags and what else there is."""
    patches = [tag_patch(t.family, t.id, t.size_m, t.T_platform_tag) for t in tags]
    patches += [tag_patch(t.family, t.id, t.size_m, t.T_platform_tag, "base") for t in base_tags]
    return Scene((*patches, *extra), motion, spheres)


class SurveyedTag:
    """A base tag as sessions state it: four corners in the base frame."""

    def __init__(self, tag: Tag) -> None:
        self.family, self.id, self.corners_base_m = tag.family, tag.id, tag.corners_platform_m
        self.std_m: float | None = None
