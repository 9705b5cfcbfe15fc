"""H-infinity norm by the Hamiltonian test (Boyd, Balakrishnan; Bruinsma, Steinbuch 1990)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from freeswing.servo.synthesis.state_space import Array, StateSpace


@dataclass(frozen=True, slots=True)
class Norm:
    """Largest gain over all rates, and the rate at which it is reached."""

    value: float
    rate_rad_s: float


def hinf_norm(system: StateSpace, tolerance: float = 1e-6) -> Norm:
    """Largest singular value of a stable continuous system over all rates.

    Args:
        system: without `period_s`.
        tolerance: relative; the value returned is reached and not exceeded by more than this.

    Raises:
        ValueError: when the system is not stable or is discrete.
    """
    if system.period_s is not None:
        raise ValueError("the norm of a discrete system is not taken here")
    if not system.is_stable():
        worst = system.poles().real.max()
        raise ValueError(f"the system has a pole at real part {worst:.3g}: it has no norm")
    system = _balanced(system)
    best = _first_guess(system)
    # Two iterations are the rule; 60 are beyond any that was met, so the loop cannot hang.
    for _ in range(60):
        level = best.value * (1.0 + 2.0 * tolerance)
        if level == 0.0:
            return best
        rates = crossings(system, level)
        if len(rates) == 0:
            return best
        middles = np.sqrt(rates[:-1] * rates[1:]) if len(rates) > 1 else rates
        better = _largest(system, np.r_[middles, rates])
        if better.value <= best.value:
            return best
        best = better
    raise ValueError("the norm did not converge in 60 steps")


def crossings(system: StateSpace, level: float) -> Array:
    """Positive rates where a singular value equals `level`; none: the norm is below it.

    They are the axis eigenvalues of the Hamiltonian matrix.

    Source:
        Boyd, Balakrishnan, Kabamba 1989, A Bisection Method for Computing the H-infinity
        Norm.
    """
    R = level**2 * np.eye(system.n_inputs) - system.D.T @ system.D
    if np.linalg.eigvalsh(R)[0] <= 0.0:
        return np.array([np.inf])[:0]
    K = np.linalg.solve(R, system.D.T @ system.C)
    F = system.A + system.B @ K
    G = system.B @ np.linalg.solve(R, system.B.T)
    Q = system.C.T @ (system.C + system.D @ K)
    whole = np.block([[F, G], [-Q, -F.T]])
    values = np.asarray(scipy.linalg.eigvals(whole), dtype=np.complex128)
    # Eigenvalues on the axis come back with real parts of about the square root of rounding.
    on_axis = np.abs(values.real) <= 1e-8 * np.maximum(np.abs(values), 1e-300)
    return np.unique(np.abs(values.imag[on_axis & (values.imag > 0.0)]))


def _first_guess(system: StateSpace) -> Norm:
    poles = system.poles()
    rates = np.unique(np.r_[0.0, np.abs(poles), np.abs(poles.imag)])
    best = _largest(system, rates)
    direct = float(np.linalg.norm(system.D, 2)) if system.D.size else 0.0
    return best if best.value >= direct else Norm(direct, np.inf)


def _largest(system: StateSpace, rates: Array) -> Norm:
    gains = np.linalg.norm(system.at(rates), 2, axis=(1, 2))
    i = int(np.argmax(gains))
    return Norm(float(gains[i]), float(rates[i]))


def _balanced(system: StateSpace) -> StateSpace:
    if system.order == 0:
        return system
    A, (scale, _) = scipy.linalg.matrix_balance(system.A, permute=False, separate=True)
    return StateSpace(A, system.B / scale[:, None], system.C * scale, system.D)
