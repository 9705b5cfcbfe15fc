"""Small scenes that the vision tests share."""

from __future__ import annotations

import numpy as np

from calib.camera import Camera
from vision.patterns import Patch, tag_patch

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


def tag(tag_id=0, size_m=0.13, parent="platform", family="tag36h11", **where) -> Patch:
    """A tag that faces the camera."""
    return tag_patch(family, tag_id, size_m, facing(**where), parent)
