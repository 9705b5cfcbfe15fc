"""Regressors of the internal dynamics along measured motions (FIDIM 2022, sec. 3.1)."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.cdpr.rotation import skew


def body_regressor(
    rotations: Array, accelerations: Array, omegas: Array, alphas: Array, gravity_m_s2: Array
) -> Array:
    """W_EE with W_EE [m; m s'; I_P] = -Xi^T tau (eqs. 18, 19).

    Args:
        rotations: R, (..., 3, 3).
        accelerations: of P in the base frame, (..., 3).
        omegas: angular velocities in the base frame, (..., 3).
        alphas: angular accelerations in the base frame, (..., 3).
        gravity_m_s2: (3,).

    Returns:
        (..., 6, 10); inertia columns are xx yy zz xy xz yz.
    """
    weight = accelerations - gravity_m_s2
    spin = skew(omegas)
    regressor = np.zeros((*omegas.shape[:-1], 6, 10))
    regressor[..., :3, 0] = weight
    regressor[..., :3, 1:4] = (skew(alphas) + spin @ spin) @ rotations
    regressor[..., 3:, 1:4] = -skew(weight) @ rotations
    back = np.swapaxes(rotations, -1, -2)
    alpha_body = (back @ alphas[..., None])[..., 0]
    omega_body = (back @ omegas[..., None])[..., 0]
    inertia = rotations @ _bar(alpha_body) + spin @ rotations @ _bar(omega_body)
    regressor[..., 3:, 4:] = inertia
    return regressor


def _bar(vectors: Array) -> Array:
    """The 3 x 6 matrix with S v = bar(v) S-entries (eq. 16)."""
    x, y, z = (vectors[..., i] for i in range(3))
    bar = np.zeros((*vectors.shape[:-1], 3, 6))
    bar[..., 0, 0], bar[..., 0, 3], bar[..., 0, 4] = x, y, z
    bar[..., 1, 1], bar[..., 1, 3], bar[..., 1, 5] = y, x, z
    bar[..., 2, 2], bar[..., 2, 4], bar[..., 2, 5] = z, x, y
    return bar


def internal_regressor(regressor: Array, xi_perp: Array) -> Array:
    """W'_EE = Xi-perp^T W_EE, free of tensions (eqs. 20-22), (..., 6 - n, 10)."""
    return np.swapaxes(xi_perp, -1, -2) @ regressor


def twist_of(
    turn: Array, turn_rate: Array, rates: Array, second_rates: Array
) -> tuple[Array, Array]:
    """Twist v = D zeta_dot and its derivative (eq. 2), (..., 6) each."""
    twist = (turn @ rates[..., None])[..., 0]
    twist_rate = (turn @ second_rates[..., None] + turn_rate @ rates[..., None])[..., 0]
    return twist, twist_rate
