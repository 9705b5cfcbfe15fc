"""Round bright markers: blobs, their sub-pixel centres, and where a ball's centre really is."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.camera import Camera

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

_MARGIN = 3  # px around a spot from which its background is read
_NEAR_PX = 24  # a swing leaves its prediction by a few pixels; other lamps are further
_LEAST_PIXELS = 4  # fewer have no centre to speak of
_MOST_SIDE_PX = 80  # larger than any marker at arm's length: a lamp or a window
_LEAST_CONTRAST = 30.0  # grey levels: above noise and texture of dim footage
_LEAST_FILL = 0.55  # of its box: a disc fills 0.79, a sickle of glare half
_LEAST_ASPECT = 0.5  # short over long side: a disc seen from 60 degrees
_EDGE_LEVEL = 0.35  # of the peak: weights start a third up the edge
_CENTRE_FLOOR_PX = 0.01  # no ball is rounder or more evenly lit


@dataclass(frozen=True, slots=True)
class Blob:
    """A bright spot: centre in pixels and undistorted, the ray's covariance (2, 2), its area."""

    centre_px: Array
    ray: Array
    covariance: Array
    area_px: float
    noise: float


def find_blobs(image: Image, camera: Camera, near_px: Array | None = None) -> list[Blob]:
    """Round bright spots in the image, or only within 24 pixels of the places given.

    The threshold lies halfway between the surroundings and the brightest pixels.
    """
    high = float(np.percentile(image[::2, ::2], 99.9))
    floor = float(np.median(image[::8, ::8]))
    top = max(high, float(image.max()))
    threshold = floor + 0.6 * (top - floor)
    if top - floor < _LEAST_CONTRAST:
        return []
    _, mask = cv2.threshold(image, threshold, 255, cv2.THRESH_BINARY)
    _, _, stats, centres = cv2.connectedComponentsWithStats(mask, connectivity=8)
    blobs = []
    for (left, top_row, width, height, area), centre in zip(stats[1:], centres[1:], strict=True):
        if area < _LEAST_PIXELS or max(width, height) > _MOST_SIDE_PX:
            continue
        if (
            min(width, height) < _LEAST_ASPECT * max(width, height)
            or area < _LEAST_FILL * width * height
        ):
            continue
        if near_px is not None and not _is_near(centre, near_px):
            continue
        blob = _centroid(image, camera, (int(left), int(top_row), int(width), int(height)))
        if blob is not None:
            blobs.append(blob)
    return blobs


def ball_shrink(direction: Array, angular_radius: float) -> float:
    """Factor that takes the centre of a ball's outline (x/z, y/z) to the ray of its centre.

    The outline is the cone of half angle alpha about the centre's ray at angle theta from the
    optical axis; on the plane z = 1 it is an ellipse from tan(theta - alpha) to
    tan(theta + alpha), whose middle is tan(theta) cos^2 theta / (cos^2 theta - sin^2 alpha).
    """
    cosine2 = 1.0 / (1.0 + float(direction @ direction))
    return 1.0 - np.sin(angular_radius) ** 2 / cosine2


def _is_near(centre: Array, near_px: Array) -> bool:
    return bool(len(near_px)) and bool(np.linalg.norm(near_px - centre, axis=1).min() < _NEAR_PX)


def _centroid(image: Image, camera: Camera, box: tuple[int, int, int, int]) -> Blob | None:
    """Light-weighted centre over the box and its margin, background from its outermost pixels."""
    left, top, width, height = box
    x0, y0 = left - _MARGIN, top - _MARGIN
    x1, y1 = left + width + _MARGIN, top + height + _MARGIN
    if x0 < 0 or y0 < 0 or x1 > image.shape[1] or y1 > image.shape[0]:
        return None
    part = image[y0:y1, x0:x1].astype(np.float64)
    rim = np.concatenate([part[0], part[-1], part[1:-1, 0], part[1:-1, -1]])
    background = float(np.median(rim))
    noise = max(1.4826 * float(np.median(np.abs(rim - background))), 0.5)
    peak = float(np.percentile(part, 100.0 * (1.0 - 0.2 * width * height / part.size)))
    # Weights start a third up the edge: what lies behind the ball has no say.
    light = np.maximum(part - background - _EDGE_LEVEL * (peak - background), 0.0)
    v, u = np.mgrid[y0:y1, x0:x1].astype(np.float64)
    reach = max(width, height) / 2 + 2
    light[np.hypot(u - (x0 + x1 - 1) / 2, v - (y0 + y1 - 1) / 2) > reach] = 0.0
    total = float(light.sum())
    if total <= 0.0:
        return None
    centre = np.array([(u * light).sum(), (v * light).sum()]) / total
    spread = np.stack([u - centre[0], v - centre[1]], axis=-1)[light > 0.0]
    covariance_px = noise**2 * spread.T @ spread / total**2 + _CENTRE_FLOOR_PX**2 * np.eye(2)
    rays = camera.normalise(np.stack([u, v], axis=-1))
    if not np.isfinite(rays).all():
        return None
    # An outline's middle is an area's centre on the plane z = 1, not in the bent image.
    across, down = np.gradient(rays, axis=1), np.gradient(rays, axis=0)
    weight = light * np.abs(across[..., 0] * down[..., 1] - across[..., 1] * down[..., 0])
    ray = (rays * weight[..., None]).sum(axis=(0, 1)) / weight.sum()
    slope = camera.project_jacobian(np.append(ray, 1.0))[1][:, :2]
    back = np.linalg.inv(slope)
    covariance = back @ covariance_px @ back.T
    area = float((light > 0.5 * light.max()).sum())
    return Blob(centre, ray, covariance, area, noise)
