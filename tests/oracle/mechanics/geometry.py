"""Compiled geometry: quaternions, a cable over its swivel pulley, a small Cholesky solver."""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True)
def rotation_of(q, out):
    """Rotation matrix of a unit quaternion w, x, y, z, written to `out` (3, 3)."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    out[0, 0] = 1.0 - 2.0 * (y * y + z * z)
    out[0, 1] = 2.0 * (x * y - w * z)
    out[0, 2] = 2.0 * (x * z + w * y)
    out[1, 0] = 2.0 * (x * y + w * z)
    out[1, 1] = 1.0 - 2.0 * (x * x + z * z)
    out[1, 2] = 2.0 * (y * z - w * x)
    out[2, 0] = 2.0 * (x * z - w * y)
    out[2, 1] = 2.0 * (y * z + w * x)
    out[2, 2] = 1.0 - 2.0 * (x * x + y * y)


@njit(cache=True)
def quaternion_rate(q, omega, out):
    """Derivative of the quaternion for an angular velocity in the base frame, to `out` (4,)."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    a, b, c = omega[0], omega[1], omega[2]
    out[0] = 0.5 * (-a * x - b * y - c * z)
    out[1] = 0.5 * (a * w + b * z - c * y)
    out[2] = 0.5 * (b * w + c * x - a * z)
    out[3] = 0.5 * (c * w + a * y - b * x)


@njit(cache=True)
def turn(q, angle_vector):
    """Quaternion q turned by a rotation vector (3,) given in the base frame; in place."""
    angle = math.sqrt(angle_vector[0] ** 2 + angle_vector[1] ** 2 + angle_vector[2] ** 2)
    half = 0.5 if angle < 1e-12 else math.sin(0.5 * angle) / angle
    c = math.cos(0.5 * angle)
    a, b, d = half * angle_vector[0], half * angle_vector[1], half * angle_vector[2]
    w, x, y, z = q[0], q[1], q[2], q[3]
    q[0] = c * w - a * x - b * y - d * z
    q[1] = c * x + a * w + b * z - d * y
    q[2] = c * y + b * w + d * x - a * z
    q[3] = c * z + d * w + a * y - b * x
    norm = math.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    for k in range(4):
        q[k] /= norm


@njit(cache=True)
def rotate(R, v):
    """R v as a tuple (no allocation; so are the next ones)."""
    return (
        R[0, 0] * v[0] + R[0, 1] * v[1] + R[0, 2] * v[2],
        R[1, 0] * v[0] + R[1, 1] * v[1] + R[1, 2] * v[2],
        R[2, 0] * v[0] + R[2, 1] * v[1] + R[2, 2] * v[2],
    )


@njit(cache=True)
def rotate_back(R, v):
    """R transposed v."""
    return (
        R[0, 0] * v[0] + R[1, 0] * v[1] + R[2, 0] * v[2],
        R[0, 1] * v[0] + R[1, 1] * v[1] + R[2, 1] * v[2],
        R[0, 2] * v[0] + R[1, 2] * v[1] + R[2, 2] * v[2],
    )


@njit(cache=True)
def cross(a, b):
    """The vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@njit(cache=True)
def add(a, b):
    """The sum."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@njit(cache=True)
def scaled(c, a):
    """The number c times a."""
    return (c * a[0], c * a[1], c * a[2])


@njit(cache=True)
def dot(a, b):
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def cable(entry, radius, swivel, point, t, n, w):
    """One cable from D over its pulley to `point`; fills t, n, w (3,) with unit vectors.

    t runs along the straight part to the platform, n from the pulley centre to the exit point, w
    is normal to the pulley plane. The pulley plane holds the swivel axis k and the point, so with
    s, h the point's coordinates along u and k from D, the exit point is where the tangent from
    the point touches the circle of centre (r, 0): (s - r, h) = r n + rho t.

    Returns:
        total length, straight length rho, wrap angle psi, lever s about the swivel axis.
    """
    dx, dy, dz = point[0] - entry[0], point[1] - entry[1], point[2] - entry[2]
    if radius == 0.0:
        rho = math.sqrt(dx * dx + dy * dy + dz * dz)
        t[0], t[1], t[2] = dx / rho, dy / rho, dz / rho
        n[:] = 0.0
        w[:] = 0.0
        return rho, rho, 0.0, 1.0
    kx, ky, kz = swivel[2, 0], swivel[2, 1], swivel[2, 2]
    h = dx * kx + dy * ky + dz * kz
    ux, uy, uz = dx - h * kx, dy - h * ky, dz - h * kz
    s = math.sqrt(ux * ux + uy * uy + uz * uz)
    ux, uy, uz = ux / s, uy / s, uz / s
    squared = (s - radius) ** 2 + h * h
    rho = math.sqrt(squared - radius * radius)
    cos_psi = (radius * (s - radius) - rho * h) / squared
    sin_psi = (radius * h + rho * (s - radius)) / squared
    psi = math.atan2(sin_psi, cos_psi)
    t[0], t[1], t[2] = (
        sin_psi * ux - cos_psi * kx,
        sin_psi * uy - cos_psi * ky,
        sin_psi * uz - cos_psi * kz,
    )
    n[0], n[1], n[2] = (
        cos_psi * ux + sin_psi * kx,
        cos_psi * uy + sin_psi * ky,
        cos_psi * uz + sin_psi * kz,
    )
    w[0], w[1], w[2] = ky * uz - kz * uy, kz * ux - kx * uz, kx * uy - ky * ux
    return rho + radius * (math.pi - psi), rho, psi, s


@njit(cache=True)
def length_acceleration(radius, t, n, w, rho, psi, s, velocity):
    """The part of the second derivative of the length that the point's velocity (3,) makes."""
    along = dot(t, velocity)
    if radius == 0.0:
        return (dot(velocity, velocity) - along * along) / rho
    return dot(n, velocity) ** 2 / rho + math.sin(psi) * dot(w, velocity) ** 2 / s


@njit(cache=True)
def factor(a):
    """Cholesky factor of a symmetric positive definite matrix, in place (lower triangle)."""
    size = a.shape[0]
    for j in range(size):
        for k in range(j):
            a[j, j] -= a[j, k] * a[j, k]
        a[j, j] = math.sqrt(a[j, j])
        for i in range(j + 1, size):
            for k in range(j):
                a[i, j] -= a[i, k] * a[j, k]
            a[i, j] /= a[j, j]


@njit(cache=True)
def solve_factored(a, b):
    """Solves with the factor of `factor`; b (size,) is overwritten by the solution."""
    size = a.shape[0]
    for i in range(size):
        for k in range(i):
            b[i] -= a[i, k] * b[k]
        b[i] /= a[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            b[i] -= a[k, i] * b[k]
        b[i] /= a[i, i]
