"""Balanced truncation with its error bound (Moore 1981; Enns 1984, Glover 1984)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from freeswing.servo.synthesis.state_space import Array, StateSpace


@dataclass(frozen=True, slots=True)
class Reduction:
    """A system of lower order, its bound and all Hankel singular values.

    `bound` is twice the sum of the dropped ones: no gain differs by more at any rate.
    """

    system: StateSpace
    bound: float
    hankel: Array


def truncate(system: StateSpace, order: int) -> Reduction:
    """Keep the `order` states that matter most between input and output.

    Raises:
        ValueError: for an unstable or discrete system, or an order that it does not have.
    """
    if system.period_s is not None:
        raise ValueError("truncate the continuous system, then make it discrete")
    if not 0 <= order <= system.order:
        raise ValueError(f"order {order}: the system has {system.order} states")
    if not system.is_stable():
        raise ValueError("an unstable system has no Gramians: it is not reduced")
    L = _factor(scipy.linalg.solve_continuous_lyapunov(system.A, -system.B @ system.B.T))
    R = _factor(scipy.linalg.solve_continuous_lyapunov(system.A.T, -system.C.T @ system.C))
    U, hankel, Vt = np.linalg.svd(R.T @ L)
    kept = np.sqrt(np.maximum(hankel[:order], np.finfo(float).tiny))
    right, left = L @ Vt[:order].T / kept, R @ U[:, :order] / kept
    small = StateSpace(left.T @ system.A @ right, left.T @ system.B, system.C @ right, system.D)
    return Reduction(small, float(2.0 * hankel[order:].sum()), hankel)


def _factor(gramian: Array) -> Array:
    """L with L L' = gramian; eigenvalues that rounding made negative count as zero."""
    values, vectors = np.linalg.eigh((gramian + gramian.T) / 2)
    return vectors * np.sqrt(np.maximum(values, 0.0))
