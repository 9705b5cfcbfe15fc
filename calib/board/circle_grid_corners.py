"""Grids of circles: found by OpenCV, then each circle's middle of darkness in the grey picture.

A blob's outline is known to a pixel, its darkness weighs every pixel: 0.02 px where the blob
detector has 0.1. The middle of a circle's image is not the image of its middle; what perspective
and lens make of it follows from the diameter once the lens is known (`circle_bias`).
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from freeswing.calib.board.planar_pose import apply, homographies
from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import Array

Image = NDArray[np.uint8]

_LEAST_AREA_PX2 = 20.0  # a circle of 5 px: in smaller ones half-way grey is a pixel's accident
_REACH = 0.5  # of the distance to the nearest circle: as far as a pixel can belong to this one
_RIM_PX = 2  # what blur spreads around the half-way grey
_LEAST_CONTRAST = 12.0  # 3rd to 95th percentile: noise of three makes 10 of a flat patch
_OUTLINE = 32


def find_circles(
    image: Image, counts: tuple[int, int], plane: Array, *, asymmetric: bool
) -> Array | None:
    """Middles of all dark circles in the order of `plane`, (n, 2); None where not all are there.

    Args:
        image: grey.
        counts: circles across and down.
        plane: their middles on the board, row by row, (n, 2).
        asymmetric: every second row is shifted by half a step.

    Source:
        Heikkila 2000, Geometric camera calibration using circular control points, as OpenCV finds
        such grids.
    """
    parameters = cv2.SimpleBlobDetector.Params()
    parameters.minArea, parameters.maxArea = _LEAST_AREA_PX2, 0.05 * image.size
    parameters.minDistBetweenBlobs = 4.0
    blobs = cv2.SimpleBlobDetector.create(parameters)
    kind = cv2.CALIB_CB_ASYMMETRIC_GRID if asymmetric else cv2.CALIB_CB_SYMMETRIC_GRID
    for flags in (kind, kind + cv2.CALIB_CB_CLUSTERING):
        found, middles = cv2.findCirclesGrid(image, counts, flags=flags, blobDetector=blobs)
        if found and middles is not None:
            rough = np.reshape(middles, (-1, 2)).astype(np.float64)
            return _refined(image, _ordered(rough, counts, asymmetric=asymmetric), plane)
    return None


def _ordered(middles: Array, counts: tuple[int, int], *, asymmetric: bool) -> Array:
    """Counted so that the board is not mirrored; a symmetric one from the left of the picture."""
    grid = middles.reshape(*counts[::-1], 2)
    across, down = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    if across[0] * down[1] - across[1] * down[0] < 0.0:
        grid = grid[:, ::-1] if not asymmetric else grid[::-1]
    if not asymmetric:
        across = grid[0, -1] - grid[0, 0]
        if across[0] < 0.0:
            grid = grid[::-1, ::-1]
    return np.ascontiguousarray(grid.reshape(-1, 2))


def _refined(image: Image, rough: Array, plane: Array) -> Array | None:
    """Middles of darkness about rough ones, (n, 2)."""
    to_board = homographies(rough, plane[None])[0]
    gaps = np.linalg.norm(plane[:, None] - plane[None], axis=2)
    reach = _REACH * float(gaps[gaps > 0.0].min())
    result = np.empty_like(rough)
    for k, middle in enumerate(rough):
        near = np.sort(np.linalg.norm(rough - middle, axis=1))[min(4, len(rough) - 1)]
        low = np.maximum(np.floor(middle - near), 0).astype(int)
        high = np.minimum(np.ceil(middle + near).astype(int) + 1, image.shape[::-1])
        window = image[low[1] : high[1], low[0] : high[0]].astype(np.float64)
        if not window.size:
            return None
        rows, columns = np.indices(window.shape)
        at = np.stack([columns + low[0], rows + low[1]], axis=-1).astype(np.float64)
        places = apply(to_board[None], at.reshape(-1, 2))[0]
        mine = (np.linalg.norm(places - plane[k], axis=1) < reach).reshape(window.shape)
        found = _middle(window, at, mine)
        if found is None:
            return None
        result[k] = found
    return result


def _middle(window: Array, at: Array, mine: NDArray[np.bool_]) -> Array | None:
    """Middle of darkness among a circle's own pixels; None without contrast."""
    if mine.sum() < _LEAST_AREA_PX2:
        return None
    white, black = np.percentile(window[mine], [95.0, 3.0])
    if white - black < _LEAST_CONTRAST:
        return None
    dark = (mine & (window < 0.5 * (white + black))).astype(np.uint8)
    side = 2 * _RIM_PX + 1
    region = cv2.dilate(dark, np.ones((side, side), np.uint8)).astype(bool) & mine
    rim = mine & ~region
    level = float(np.median(window[rim])) if rim.sum() >= _RIM_PX else white
    weights = np.where(region, level - window, 0.0)
    total = float(weights.sum())
    if total <= 0.0:
        return None
    return np.asarray((weights[..., None] * at).sum(axis=(0, 1)) / total)


def circle_bias(camera: Camera, points_m: Array, diameter_m: float, poses: Array) -> Array:
    """Middles of the circles' images minus the images of their middles, px, (n, n_points, 2).

    Args:
        camera: the lens.
        points_m: circles' middles on the board, (n_points, 3).
        diameter_m: of a circle.
        poses: T_camera_board, (n, 4, 4).

    Source:
        Heikkilae 2000, Geometric camera calibration using circular control points, sec. 2.2; here
        the area's middle of the outline's image, so that the lens takes part.
    """
    angle = 2.0 * np.pi * np.arange(_OUTLINE) / _OUTLINE
    ring = 0.5 * diameter_m * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)
    outline = points_m[:, None] + ring
    bias = np.empty((len(poses), len(points_m), 2))
    for k, T in enumerate(poses):
        seen = camera.project(outline @ T[:3, :3].T + T[:3, 3])
        middle = camera.project(points_m @ T[:3, :3].T + T[:3, 3])
        arms = seen - middle[:, None]
        ahead = np.roll(arms, -1, axis=1)
        cross = arms[..., 0] * ahead[..., 1] - arms[..., 1] * ahead[..., 0]
        area = cross.sum(axis=1)[:, None]
        bias[k] = ((arms + ahead) * cross[..., None]).sum(axis=1) / (3.0 * area)
    return bias
