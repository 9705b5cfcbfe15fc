"""Cameras of other programs' files that no camera is: refused with the file's name."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.files.documents import InputError

RIGID = 1e-3  # files with four digits are off by 1e-4, a matrix of another kind by 0.1 and more


def refuse_impossible(path: Path, cameras: Sequence[Camera]) -> None:
    """Names that stand twice, images without pixels, poses that are no motion of a rigid body."""
    names = [camera.name for camera in cameras]
    for camera in cameras:
        rotation = camera.T_camera_base[:3, :3]
        with np.errstate(over="ignore", invalid="ignore"):
            off = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
        if not off < RIGID or np.linalg.det(rotation) < 0.0:
            raise InputError(f"{path}: camera {camera.name}: its rotation is none ({off:.3g} off)")
        if min(camera.size_px) < 1:
            raise InputError(f"{path}: camera {camera.name}: an image of {camera.size_px} pixels")
        if names.count(camera.name) > 1:
            raise InputError(f"{path}: two cameras are named {camera.name!r}")
