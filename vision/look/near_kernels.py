"""What a follower computes in each frame about all tags at once: where to look, and the pose."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.lens_kernels import lens_pixels
from freeswing.cdpr.compiled.kernels import kernel
from freeswing.cdpr.elimination import inverse_factors
from freeswing.vision.fuse.pose_kernels import BelievedPose, Seen, solve_instant
from freeswing.vision.fuse.small_rotation import small_rotation

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@kernel
def _one_to_one(is_fisheye: bool, point: Array, limit: float) -> bool:
    """Whether the lens still means something at a point of the camera's frame."""
    radius = math.hypot(point[0], point[1])
    if is_fisheye:
        return math.atan2(radius, point[2]) < limit
    return point[2] > 0.0 and radius < limit * point[2]


@kernel
def expected_tags(
    corners_m: Array,
    rotation: Array,
    position: Array,
    is_fisheye: bool,
    lens: Array,
    view: Array,
    facing: float,
) -> tuple[Mask, Array]:
    """Tags that a camera should see whole at a pose, (n,), with rays and pixels, (n, 2, 4, 2).

    Args:
        corners_m: TL TR BR BL in the platform's frame, (n, 4, 3).
        rotation: R_camera_platform, (3, 3).
        position: of the platform's origin in the camera's frame, (3,).
        is_fisheye: the lens's kind.
        lens: its full parameters, (12,).
        view: radius to which the lens is one to one, width and height in px, (3,).
        facing: least cosine between a tag's face and the way to the camera.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, sec. 6.1: the camera.
    """
    n = len(corners_m)
    seen, guesses = np.zeros(n, dtype=np.bool_), np.zeros((n, 2, 4, 2))
    placed = np.empty((4, 3))
    middle_u, middle_v = (view[1] - 1.0) / 2.0, (view[2] - 1.0) / 2.0
    for i in range(n):
        for k in range(4):
            for a in range(3):
                placed[k, a] = position[a]
                for b in range(3):
                    placed[k, a] += rotation[a, b] * corners_m[i, k, b]
        right, up = placed[1] - placed[0], placed[0] - placed[3]
        normal = np.array(
            [
                right[1] * up[2] - right[2] * up[1],
                right[2] * up[0] - right[0] * up[2],
                right[0] * up[1] - right[1] * up[0],
            ]
        )
        centre = (placed[0] + placed[1] + placed[2] + placed[3]) / 4.0
        lengths = math.sqrt((normal**2).sum() * (centre**2).sum())
        whole = (normal * centre).sum() < -facing * lengths
        pixels = lens_pixels(is_fisheye, lens, placed)
        for k in range(4):
            whole = whole and _one_to_one(is_fisheye, placed[k], view[0])
            whole = whole and abs(pixels[k, 0] - middle_u) <= view[1] / 2.0
            whole = whole and abs(pixels[k, 1] - middle_v) <= view[2] / 2.0
        seen[i] = whole
        if whole:
            guesses[i, 0] = placed[:, :2] / placed[:, 2:]
            guesses[i, 1] = pixels
    return seen, guesses


@kernel
def refined_pose(
    points: Array,
    rays: Array,
    covariances: Array,
    rotation: Array,
    position: Array,
    limit: float,
    passes: int,
) -> tuple[bool, Array, Array]:
    """Robust least squares over tags of one image: whether there is a pose, R (3, 3), t (3,).

    Args:
        points: platform frame, (n, 4, 3).
        rays: (n, 8).
        covariances: (n, 8, 8).
        rotation: a start, (3, 3).
        position: likewise, (3,).
        limit: mean squared whitened residual beyond which a tag is weighed down.
        passes: at the most.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, sec. A6.2; Golub, Van
        Loan 2013, Matrix Computations, sec. 4.2: whitening by the Cholesky factor.
    """
    n = len(points)
    whitening = inverse_factors(covariances)
    starts = np.zeros(2, dtype=np.int64)
    starts[1] = n
    home = np.zeros((1, 4, 4))
    for k in range(4):
        home[0, k, k] = 1.0
    seen = Seen(
        starts,
        home,
        np.zeros(n, dtype=np.int64),
        points,
        rays,
        np.zeros((n, 4)),
        np.full(n, 4, dtype=np.int64),
        np.zeros((n, 6)),
        np.zeros((n, 12)),
    )
    pose = BelievedPose(rotation, position)
    first, free = np.int64(0), np.int64(6)  # plain ones would be types of their own
    found = solve_instant(seen, whitening, first, pose, free, limit, passes)
    known = found.condition != 0.0 and bool(np.isfinite(found.position).all())
    return known, found.rotation, found.position


@kernel
def carried_on(
    times_s: Array, rotations: Array, positions: Array, time_s: float
) -> tuple[Array, Array]:
    """Rotation (3, 3) and position (3,) at a time, by the polynomial through poses (n, ...).

    Source:
        Press et al. 2007, Numerical Recipes, sec. 3.2: Lagrange's polynomial, in rotation
        vectors.
    """
    n = len(times_s)
    ahead, turn = np.zeros(6), np.empty((3, 3))
    for k in range(n - 1):
        weight = 1.0
        for j in range(n):
            if j != k:
                weight *= (time_s - times_s[j]) / (times_s[k] - times_s[j])
        turn = rotations[k] @ rotations[n - 1].T
        x, y, z = turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]
        sine = 0.5 * math.sqrt(x * x + y * y + z * z)
        cosine = 0.5 * (turn[0, 0] + turn[1, 1] + turn[2, 2] - 1.0)
        factor = 0.5 if sine < 1e-9 else 0.5 * math.atan2(sine, cosine) / sine
        for a in range(3):
            ahead[a] += weight * (positions[k, a] - positions[n - 1, a])
        ahead[3] += weight * factor * x
        ahead[4] += weight * factor * y
        ahead[5] += weight * factor * z
    small_rotation(ahead[3:], turn)
    return turn @ rotations[n - 1], positions[n - 1] + ahead[:3]
