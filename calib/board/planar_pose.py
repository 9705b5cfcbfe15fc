"""Homographies of a planar board, and board poses from them, for many views at once."""

from __future__ import annotations

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import Array
from freeswing.cdpr.rotation import transform

_LEAST_POINTS = 4


def homographies(plane_points: Array, images: Array) -> Array:
    """Maps board (x, y, 1) to image points, normalised linear fit, (n, 3, 3).

    Args:
        plane_points: board coordinates, (n_points, 2).
        images: image points of every view, NaN where unseen, (n, n_points, 2).

    Returns:
        NaN for views with fewer than four points.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, algorithm 4.2.
    """
    seen = np.isfinite(images[..., 0])
    board, to_board = _centred(np.broadcast_to(plane_points, images.shape), seen)
    image, to_image = _centred(images, seen)
    x, y = board[..., 0], board[..., 1]
    u, v = image[..., 0], image[..., 1]
    one, zero = seen.astype(float), np.zeros_like(x)
    first = np.stack([x, y, one, zero, zero, zero, -u * x, -u * y, -u], axis=-1)
    second = np.stack([zero, zero, zero, x, y, one, -v * x, -v * y, -v], axis=-1)
    rows = np.concatenate([first, second], axis=1)
    _, vectors = np.linalg.eigh(np.swapaxes(rows, 1, 2) @ rows)
    normalised = vectors[..., 0].reshape(-1, 3, 3)
    result = np.linalg.inv(to_image) @ normalised @ to_board
    result /= np.linalg.norm(result, axis=(1, 2), keepdims=True)
    result[seen.sum(axis=1) < _LEAST_POINTS] = np.nan
    return result


def _centred(points: Array, seen: np.ndarray) -> tuple[Array, Array]:
    """Points with mean 0 and mean square 2 (zero where unseen), and the map that does it."""
    filled = np.where(seen[..., None], points, 0.0)
    count = np.maximum(seen.sum(axis=1), 1)[:, None]
    mean = filled.sum(axis=1) / count
    centred = np.where(seen[..., None], filled - mean[:, None], 0.0)
    square = (centred**2).sum(axis=(1, 2)) / count[:, 0]
    scale = np.sqrt(2.0 / np.maximum(square, 1e-300))
    matrix = np.zeros((len(points), 3, 3))
    matrix[:, 0, 0] = matrix[:, 1, 1] = scale
    matrix[:, :2, 2] = -scale[:, None] * mean
    matrix[:, 2, 2] = 1.0
    return centred * scale[:, None, None], matrix


def apply(matrices: Array, plane_points: Array) -> Array:
    """Images (n, n_points, 2) of board points (n_points, 2) under homographies (n, 3, 3).

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, sec. 2.3.
    """
    lifted = np.column_stack([plane_points, np.ones(len(plane_points))])
    mapped = lifted @ np.swapaxes(matrices, 1, 2)
    return mapped[..., :2] / mapped[..., 2:]


def flatness_errors(plane_points: Array, images: Array) -> Array:
    """Rms distance of each view from its best homography, relative to the board's extent, (n,).

    A lens bends a true board by a few per cent at most; a false detection is no plane at all.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, sec. 4.2:
        transfer error of a homography.
    """
    error = images - apply(homographies(plane_points, images), plane_points)
    extent = np.linalg.norm(np.nanmax(images, axis=1) - np.nanmin(images, axis=1), axis=-1)
    return np.sqrt(np.nanmean(np.sum(error**2, axis=-1), axis=1)) / extent


def focal_guess(matrices: Array, centre_px: Array) -> float:
    """Focal length from homographies with square pixels and a known centre; NaN without tilt.

    Zhang 2000, eq. 3 and 4, with the absolute conic reduced to one unknown 1/f^2; the square of
    every homography's own size weighs it.
    """
    shift = np.eye(3)
    shift[:2, 2] = -centre_px
    moved = shift @ matrices
    moved = moved / np.linalg.norm(moved[..., :2], axis=(1, 2), keepdims=True)
    a, b = moved[..., 0], moved[..., 1]
    planar = np.stack(
        [a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1], np.sum(a[:, :2] ** 2 - b[:, :2] ** 2, axis=1)]
    ).ravel()
    depth = np.stack([a[:, 2] * b[:, 2], a[:, 2] ** 2 - b[:, 2] ** 2]).ravel()
    inverse_square = -float(depth @ planar) / max(float(planar @ planar), 1e-300)
    return 1.0 / np.sqrt(inverse_square) if inverse_square > 0.0 else float("nan")


def board_poses(camera: Camera, plane_points: Array, images: Array) -> Array:
    """T_camera_board of every view through its homography, (n, 4, 4); NaN where impossible.

    Source:
        Zhang 2000, A flexible new technique for camera calibration, sec. 3.1.
    """
    rays = camera.normalise(images)
    matrices = homographies(plane_points, rays)
    good = np.isfinite(matrices[:, 0, 0])
    matrices = np.where(good[:, None, None], matrices, np.eye(3))
    size = np.sqrt(
        np.linalg.norm(matrices[..., 0], axis=1) * np.linalg.norm(matrices[..., 1], axis=1)
    )
    matrices = matrices / (size * np.where(matrices[:, 2, 2] < 0.0, -1.0, 1.0))[:, None, None]
    first, second = matrices[..., 0], matrices[..., 1]
    rough = np.stack([first, second, np.cross(first, second)], axis=-1)
    left, _, right = np.linalg.svd(rough)
    turn = np.linalg.det(left @ right)
    left[..., 2] *= turn[:, None]
    poses = transform(left @ right, matrices[..., 2])
    poses[~good] = np.nan
    return poses


def flipped(poses: Array) -> Array:
    """The other pose that a planar board may have: tilted the other way about the line of sight.

    With weak perspective both project almost alike (Collins and Bartoli 2014). The board's normal
    is mirrored about the line of sight by half a turn of the board's tilt axis.
    """
    sight = poses[:, :3, 3] / np.linalg.norm(poses[:, :3, 3], axis=1, keepdims=True)
    normal = poses[:, :3, 2]
    sine = np.cross(normal, sight)
    cosine = np.sum(normal * sight, axis=1)
    side = np.where(cosine < 0.0, -1.0, 1.0)
    length = np.linalg.norm(sine, axis=1)
    angle = 2.0 * np.arctan2(length, np.abs(cosine))
    axis = sine / np.maximum(length, 1e-12)[:, None]
    from freeswing.cdpr.rotation import exp_rotation

    turned = np.array(poses)
    turned[:, :3, :3] = exp_rotation(axis * (angle * side)[:, None]) @ poses[:, :3, :3]
    return turned
