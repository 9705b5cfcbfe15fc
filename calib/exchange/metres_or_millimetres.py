"""Files that state no unit: whether a rig's lengths are metres or millimetres."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.rotation import transform

FARTHEST_M = 60.0
"""Laboratories are smaller; in millimetres it would be 6 cm, and no rig is that small."""


def in_metres(
    path: Path, cameras: tuple[Camera, ...], tell: Callable[[str], None]
) -> tuple[Camera, ...]:
    """The cameras in metres: those of a rig that would be hundreds of metres across were not.

    Args:
        path: the file, for what is told.
        cameras: as stated.
        tell: told when they are taken for millimetres.
    """
    farthest = max(float(np.linalg.norm(camera.position_base_m)) for camera in cameras)
    if farthest < FARTHEST_M:
        return cameras
    tell(
        f"{path}: cameras up to {farthest:.4g} units from the origin: taken for millimetres "
        f"({1e-3 * farthest:.3g} m)"
    )
    poses = [transform(c.T_camera_base[:3, :3], 1e-3 * c.T_camera_base[:3, 3]) for c in cameras]
    return tuple(replace(c, T_camera_base=T) for c, T in zip(cameras, poses, strict=True))
