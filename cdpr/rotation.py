"""Rotations and rigid transforms, batch axes first.

Orientation angles are Tait-Bryan `phi, theta, chi` with R = Rx(phi) Ry(theta) Rz(chi); quaternions
are w, x, y, z; rotation vectors are axis times angle in radians. NaN in gives NaN out, so that
missing samples stay missing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

SMALL_ANGLE_RAD = 1e-3
GIMBAL_COSINE = 1e-9


def skew(v: ArrayLike) -> Array:
    """Matrix S of the cross product, S @ w = v x w. (..., 3) -> (..., 3, 3).

    Source:
        Murray, Li, Sastry 1994, A Mathematical Introduction to Robotic Manipulation, ch. 2.
    """
    v = np.asarray(v, dtype=np.float64)
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    zero = np.zeros_like(x)
    return _matrix([[zero, -z, y], [z, zero, -x], [-y, x, zero]])


def matrix_from_angles(angles: ArrayLike) -> Array:
    """R = Rx(phi) Ry(theta) Rz(chi) from (phi, theta, chi) [rad]. (..., 3) -> (..., 3, 3).

    Source:
        Ida, Merlet, Carricato 2019, sec. 2.1: Tait-Bryan angles by the xyz convention.
    """
    angles = np.asarray(angles, dtype=np.float64)
    (cp, ct, cc), (sp, st, sc) = (np.moveaxis(f(angles), -1, 0) for f in (np.cos, np.sin))
    return _matrix(
        [
            [ct * cc, -ct * sc, st],
            [cp * sc + sp * st * cc, cp * cc - sp * st * sc, -sp * ct],
            [sp * sc - cp * st * cc, sp * cc + cp * st * sc, cp * ct],
        ]
    )


def angles_from_matrix(R: ArrayLike) -> Array:
    """(phi, theta, chi) [rad] with theta in [-pi/2, pi/2]. (..., 3, 3) -> (..., 3).

    At theta = +-pi/2 only phi +- chi is defined: chi = 0 is returned there.

    Source:
        Ida, Merlet, Carricato 2019, eq. (1) solved for its angles.
    """
    R = np.asarray(R, dtype=np.float64)
    cos_theta = np.hypot(R[..., 0, 0], R[..., 0, 1])
    locked = cos_theta < GIMBAL_COSINE
    phi = np.where(
        locked,
        np.arctan2(R[..., 2, 1], R[..., 1, 1]),
        np.arctan2(-R[..., 1, 2], R[..., 2, 2]),
    )
    theta = np.arctan2(R[..., 0, 2], cos_theta)
    chi = np.where(locked, 0.0, np.arctan2(-R[..., 0, 1], R[..., 0, 0]))
    return np.stack([phi, theta, chi], axis=-1)


def angle_rate_matrix(angles: ArrayLike) -> Array:
    """H with omega_base = H @ (phi', theta', chi') (FIDIM 2022, eq. 5). (..., 3) -> (..., 3, 3)."""
    angles = np.asarray(angles, dtype=np.float64)
    phi, theta = angles[..., 0], angles[..., 1]
    cp, sp, ct, st = np.cos(phi), np.sin(phi), np.cos(theta), np.sin(theta)
    zero, one = np.zeros_like(phi), np.ones_like(phi)
    return _matrix([[one, zero, st], [zero, cp, -sp * ct], [zero, sp, cp * ct]])


def matrix_from_quaternion(q_wxyz: ArrayLike) -> Array:
    """R of a quaternion of any non-zero length. (..., 4) -> (..., 3, 3); length 0 gives NaN.

    Source:
        Murray, Li, Sastry 1994, A Mathematical Introduction to Robotic Manipulation, ch. 2.
    """
    q = np.asarray(q_wxyz, dtype=np.float64)
    norm = np.linalg.norm(q, axis=-1, keepdims=True)
    w, x, y, z = np.moveaxis(q / np.where(norm > 0.0, norm, np.nan), -1, 0)
    return _matrix(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_from_matrix(R: ArrayLike) -> Array:
    """Unit quaternion (w, x, y, z), w >= 0. (..., 3, 3) -> (..., 4).

    Every row of the symmetric matrix 4 q q^T is q times one of its entries; the row with the
    largest diagonal entry is the accurate one (Shepperd 1978).
    """
    R = np.asarray(R, dtype=np.float64)
    xx, yy, zz = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    wx, wy, wz = (
        R[..., 2, 1] - R[..., 1, 2],
        R[..., 0, 2] - R[..., 2, 0],
        R[..., 1, 0] - R[..., 0, 1],
    )
    xy, xz, yz = (
        R[..., 1, 0] + R[..., 0, 1],
        R[..., 0, 2] + R[..., 2, 0],
        R[..., 2, 1] + R[..., 1, 2],
    )
    outer = _matrix(
        [
            [1 + xx + yy + zz, wx, wy, wz],
            [wx, 1 + xx - yy - zz, xy, xz],
            [wy, xy, 1 - xx + yy - zz, yz],
            [wz, xz, yz, 1 - xx - yy + zz],
        ]
    )
    best = np.argmax(np.diagonal(outer, axis1=-2, axis2=-1), axis=-1)
    q = np.take_along_axis(outer, best[..., None, None], axis=-2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.where(q[..., :1] < 0.0, -q, q)


def exp_rotation(rotvec: ArrayLike) -> Array:
    """R = exp(skew(rotvec)), Rodrigues' formula. (..., 3) [rad] -> (..., 3, 3).

    Source:
        Murray, Li, Sastry 1994, A Mathematical Introduction to Robotic Manipulation, eq. (2.14).
    """
    v = np.asarray(rotvec, dtype=np.float64)
    half = 0.5 * np.linalg.norm(v, axis=-1, keepdims=True)
    # numpy's sinc is sin(pi x)/(pi x): exact at 0, so that no series branch is needed.
    q = np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * v], axis=-1)
    return matrix_from_quaternion(q)


def log_rotation(R: ArrayLike) -> Array:
    """Rotation vector of length in [0, pi]. (..., 3, 3) -> (..., 3) [rad].

    Source:
        Murray, Li, Sastry 1994, A Mathematical Introduction to Robotic Manipulation, prop. 2.9.
    """
    q = quaternion_from_matrix(R)
    return _rotvec(q[..., :1], q[..., 1:])


def _rotvec(w: Array, vector: Array) -> Array:
    """Rotation vector of unit quaternions, w (..., 1) >= 0 and the rest (..., 3)."""
    sine = np.sqrt(np.sum(vector * vector, axis=-1, keepdims=True))
    small = sine < SMALL_ANGLE_RAD
    # angle / sin(angle / 2) = 2 (1 + s^2/6 + 3 s^4/40 + ...) with s = sin(angle / 2).
    series = 2.0 + sine**2 / 3.0 + 3.0 * sine**4 / 20.0
    safe = np.where(small, 1.0, sine)
    return vector * np.where(small, series, 2.0 * np.arctan2(safe, w) / safe)


def pose_differences(zetas: ArrayLike, from_zetas: ArrayLike) -> Array:
    """How far poses x y z phi theta chi are from others. (..., 6), (..., 6) -> (..., 6).

    The last three are the rotation vector, base frame, that takes the others' orientation to
    theirs: no choice of axes changes its length, as it changes differences of angles.

    Source:
        Sola, Deray, Atchuthan 2018, A micro Lie theory for state estimation in robotics, eq. (28).
    """
    zetas, from_zetas = (np.asarray(one, dtype=np.float64) for one in (zetas, from_zetas))
    (w, x, y, z), (a, b, c, d) = _quaternion(zetas[..., 3:]), _quaternion(from_zetas[..., 3:])
    # The product with the other's conjugate.
    turn = np.stack(
        [
            x * a - w * b + z * c - y * d,
            y * a - w * c + x * d - z * b,
            z * a - w * d + y * b - x * c,
        ],
        axis=-1,
    )
    cosine = (w * a + x * b + y * c + z * d)[..., None]
    turned = _rotvec(np.abs(cosine), np.where(cosine < 0.0, -turn, turn))
    return np.concatenate([zetas[..., :3] - from_zetas[..., :3], turned], axis=-1)


def _quaternion(angles: Array) -> tuple[Array, Array, Array, Array]:
    """Unit quaternion w, x, y, z of angles phi, theta, chi (..., 3)."""
    (cp, ct, cc), (sp, st, sc) = (np.moveaxis(f(0.5 * angles), -1, 0) for f in (np.cos, np.sin))
    return (
        cp * ct * cc - sp * st * sc,
        sp * ct * cc + cp * st * sc,
        cp * st * cc - sp * ct * sc,
        cp * ct * sc + sp * st * cc,
    )


def log_slope(rotvec: ArrayLike) -> Array:
    """J with log(exp(w) exp(v)) = v + J @ w to first order in w. (..., 3) [rad] -> (..., 3, 3).

    Source:
        Sola, Deray, Atchuthan 2018, A micro Lie theory for state estimation in robotics, eq. (146).
    """
    v = np.asarray(rotvec, dtype=np.float64)
    squared = np.sum(v * v, axis=-1)[..., None, None]
    half = 0.5 * np.sqrt(squared)
    small = half < SMALL_ANGLE_RAD
    safe = np.where(small, 1.0, half)
    # (1 - h cot h) / (4 h^2) with h half the angle.
    curved = (1.0 - safe / np.tan(safe)) / (4.0 * safe * safe)
    factor = np.where(small, 1.0 / 12.0 + squared / 720.0, curved)
    S = skew(v)
    return np.eye(3) - 0.5 * S + factor * (S @ S)


def transform(R: ArrayLike, t: ArrayLike) -> Array:
    """Homogeneous T with x_a = T x_b. (..., 3, 3), (..., 3) -> (..., 4, 4).

    Source:
        Murray, Li, Sastry 1994, A Mathematical Introduction to Robotic Manipulation, ch. 2.
    """
    R, t = np.asarray(R, dtype=np.float64), np.asarray(t, dtype=np.float64)
    batch = np.broadcast_shapes(R.shape[:-2], t.shape[:-1])
    T = np.zeros((*batch, 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = R, t, 1.0
    return T


def invert(T: ArrayLike) -> Array:
    """Inverse of rigid transforms. (..., 4, 4) -> (..., 4, 4).

    Source:
        Murray, Li, Sastry 1994, A Mathematical Introduction to Robotic Manipulation, ch. 2.
    """
    T = np.asarray(T, dtype=np.float64)
    R_transposed = np.swapaxes(T[..., :3, :3], -1, -2)
    return transform(R_transposed, -np.einsum("...ij,...j->...i", R_transposed, T[..., :3, 3]))


def _matrix(rows: list[list[Array]]) -> Array:
    """Stack scalar fields (...) into matrices (..., len(rows), len(rows[0]))."""
    filled = np.empty((*rows[0][0].shape, len(rows), len(rows[0])))
    for i, row in enumerate(rows):
        for j, entry in enumerate(row):
            filled[..., i, j] = entry
    return filled


def nearest_rotation(matrices: Array) -> Array:
    """The rotation R that maximises trace(R' M) for each matrix M, (..., 3, 3).

    Of points `a` and `b` about their middles, M = b' a gives the R that turns a onto b best; where
    a mirror image would do better, the least certain direction turns round.

    Source:
        Kabsch 1976, A solution for the best rotation to relate two sets of vectors.
    """
    left, _, right = np.linalg.svd(matrices)
    turns = left @ right
    mirrored = np.linalg.det(turns) < 0.0
    if mirrored.any():
        left[mirrored, :, 2] *= -1.0
        turns = left @ right
    return np.asarray(turns, dtype=np.float64)
