"""The platform's points at rest as patches, and where every camera sees each of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.camera import Camera
from freeswing.calib.rig.triangulation import triangulate
from freeswing.vision.untagged.aligned_patches import (
    Patches,
    SmoothImage,
    align_seen,
    cut,
    normals_of,
    tangents_of,
)
from freeswing.vision.untagged.feature_matches import Features

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Image = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class SeenAtRest:
    """Points in one camera's image of the platform at rest.

    Attributes:
        which: numbers of the points, (n,).
        pixels: (n, 2).
        std_px: deviation of each, (n,).
    """

    which: Ints
    pixels: Array
    std_px: Array


def patches_at_rest(
    cameras: Sequence[Camera],
    rests: Mapping[str, Image],
    points_m: Array,
    T_base_rest: Array,
    seen: Mapping[str, tuple[Ints, Features]],
) -> tuple[Array, Patches, dict[str, SeenAtRest]]:
    """Points placed by patches (n, 3), the patches, and where each camera sees them.

    A point's patch comes from the camera that looks at it from the middle of those that see it.

    Args:
        cameras: those with an image.
        rests: their images.
        points_m: platform frame, as their features place them, (n, 3).
        T_base_rest: platform to base.
        seen: features by camera name.

    Source:
        Sutton, Orteu, Schreier 2009, Image Correlation for Shape, Motion and Deformation
        Measurements, ch. 6: matching a subset across cameras, then intersecting its rays.
    """
    count = len(points_m)
    images = [SmoothImage.of(rests[camera.name]) for camera in cameras]
    poses = [camera.T_camera_base @ T_base_rest for camera in cameras]
    pixels = np.full((len(cameras), count, 2), np.nan)
    for row, camera in enumerate(cameras):
        which, features = seen[camera.name]
        pixels[row, which] = features.pixels
    sights = np.stack([_sights(pose, points_m) for pose in poses])
    there = np.isfinite(pixels[..., 0])
    middle = np.where(there[..., None], sights, 0.0).sum(axis=0)
    home = np.where(there, np.einsum("cni,ni->cn", sights, middle), -np.inf).argmax(axis=0)
    rig = _Rest(cameras, images, poses, home, pixels[home, np.arange(count)])
    points_m, _, _ = rig.laid(points_m, middle)
    return rig.laid(points_m, middle)  # planes through points that patches placed


@dataclass(frozen=True, slots=True)
class _Rest:
    """Cameras, their images and poses to the platform; each point's home and pixel there (n, 2)."""

    cameras: Sequence[Camera]
    images: Sequence[SmoothImage]
    poses: Sequence[Array]
    home: Ints
    marks: Array

    def laid(self, points_m: Array, towards: Array) -> tuple[Array, Patches, dict[str, SeenAtRest]]:
        """`patches_at_rest` once, on planes through these points that face `towards`, (n, 3)."""
        every = np.arange(len(points_m))
        patches = self.cut_on(points_m, normals_of(points_m, towards))
        pixels = np.full((len(self.cameras), len(points_m), 2), np.nan)
        std = np.full(pixels.shape[:2], np.nan)
        for row, camera in enumerate(self.cameras):
            rows, found = align_seen(patches, self.images[row], camera, self.poses[row], points_m)
            pixels[row, rows], std[row, rows] = found.pixels, found.std_px
        pixels[self.home, every], std[self.home, every] = self.marks, np.nan
        others = np.isfinite(std).sum(axis=0)
        pixels[:, others == 0] = np.nan  # no other camera saw it again
        # where a patch was cut out it finds itself without an error: as good as elsewhere
        std[self.home, every] = np.nansum(std, axis=0) / np.maximum(others, 1)
        placed = triangulate(self.cameras, pixels)
        T = np.linalg.inv(self.poses[0]) @ self.cameras[0].T_camera_base  # platform of base
        placed = placed @ T[:3, :3].T + T[:3, 3]
        at_rest = {}
        for row, camera in enumerate(self.cameras):
            kept = np.flatnonzero(np.isfinite(pixels[row, :, 0]))
            at_rest[camera.name] = SeenAtRest(kept, pixels[row, kept], std[row, kept])
        return np.where(np.isfinite(placed), placed, points_m), patches, at_rest

    def cut_on(self, points_m: Array, normals: Array) -> Patches:
        """Patches out of the image of the camera that is each point's home."""
        found = Patches.empty(normals)
        for row, camera in enumerate(self.cameras):
            mine = self.home == row
            found.greys[mine], found.gain[mine] = cut(self.images[row], self.marks[mine])
            found.tangents[mine] = tangents_of(
                camera, self.poses[row], points_m[mine], normals[mine]
            )
        return found


def _sights(T_camera_platform: Array, points_m: Array) -> Array:
    """Directions from the points to the camera, platform frame, (n, 3)."""
    eye = -T_camera_platform[:3, :3].T @ T_camera_platform[:3, 3]
    towards = eye - points_m
    return towards / np.linalg.norm(towards, axis=1, keepdims=True)
