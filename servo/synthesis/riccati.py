"""H-infinity output feedback by two Riccati equations, with a direct term D11.

Glover and Doyle 1988, in the form of Zhou, Doyle and Glover, "Robust and Optimal Control",
section 17.1. A standard problem is a plant whose inputs are [w, u] and whose outputs are [z, y].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from freeswing.servo.synthesis.state_space import Array, StateSpace


@dataclass(frozen=True, slots=True)
class StandardProblem:
    """A plant (inputs [w, u], outputs [z, y]) and how many of them belong to the controller."""

    plant: StateSpace
    n_measured: int
    n_controls: int

    def __post_init__(self) -> None:
        if not 0 < self.n_measured < self.plant.n_outputs:
            raise ValueError(
                f"{self.n_measured} measurements of {self.plant.n_outputs} outputs: at least one "
                "output must be measured and one be judged"
            )
        if not 0 < self.n_controls < self.plant.n_inputs:
            raise ValueError(
                f"{self.n_controls} controls of {self.plant.n_inputs} inputs: at least one input "
                "must be a control and one a disturbance"
            )


@dataclass(frozen=True, slots=True)
class Normalised:
    """The same problem with D12 = [0; I], D21 = [0 I], D22 = 0, and the way back."""

    A: Array
    B1: Array
    B2: Array
    C1: Array
    C2: Array
    D11: Array
    control_back: Array  # u = control_back @ u_normalised
    measured_in: Array  # y_normalised = measured_in @ y
    D22: Array
    state_scale: Array  # x = state_scale * x_normalised
    least: float  # no controller does better: the part of D11 that it cannot reach

    @property
    def n_controls(self) -> int:
        """Number of controls."""
        return self.B2.shape[1]

    @property
    def n_measured(self) -> int:
        """Number of measurements."""
        return self.C2.shape[0]


def normalise(problem: StandardProblem) -> Normalised:
    """Orthogonal changes of z and w and scalings of u and y that bring D12 and D21 to [0; I].

    Raises:
        ValueError: where D12 has not full column rank or D21 not full row rank.
    """
    plant, n_u, n_y = problem.plant, problem.n_controls, problem.n_measured
    n_w, n_z = plant.n_inputs - n_u, plant.n_outputs - n_y
    scale = _balancing_scale(plant)
    A = plant.A * (scale[None, :] / scale[:, None])
    B, C = plant.B / scale[:, None], plant.C * scale
    D11, D12 = plant.D[:n_z, :n_w], plant.D[:n_z, n_w:]
    D21, D22 = plant.D[n_z:, :n_w], plant.D[n_z:, n_w:]
    U, control_back = _to_lower_identity(D12, "D12", "a control")
    V, measured_back = _to_lower_identity(D21.T, "D21", "a measurement")
    measured_in = measured_back.T
    direct = U.T @ D11 @ V
    reachable = direct.shape[0] - n_u, direct.shape[1] - n_y
    return Normalised(
        A=A,
        B1=B[:, :n_w] @ V,
        B2=B[:, n_w:] @ control_back,
        C1=U.T @ C[:n_z],
        C2=measured_in @ C[n_z:],
        D11=direct,
        control_back=control_back,
        measured_in=measured_in,
        D22=D22,
        state_scale=scale,
        least=max(_norm(direct[: reachable[0]]), _norm(direct[:, : reachable[1]])),
    )


def _balancing_scale(plant: StateSpace) -> Array:
    """Powers of two that even out rows and columns of [A B; C 0]; exact, as MATLAB's ssbal."""
    n = plant.order
    if n == 0:
        return np.ones(0)
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n] = plant.A
    whole[:n, n] = np.linalg.norm(plant.B, axis=1)
    whole[n, :n] = np.linalg.norm(plant.C, axis=0)
    _, (scale, _) = scipy.linalg.matrix_balance(whole, permute=False, separate=True)
    return scale[:n] / scale[n]


def _to_lower_identity(D: Array, name: str, what: str) -> tuple[Array, Array]:
    """U orthogonal and S such that U' D S = [0; I]."""
    rows, columns = D.shape
    U, sigma, Vt = np.linalg.svd(D)
    # Below 1e-10 of the largest the normalised problem would be scaled by 1e10 and its Riccati
    # solutions lose what double precision has to give.
    if rows < columns or sigma[-1] <= 1e-10 * max(sigma[0], np.finfo(float).tiny):
        raise ValueError(
            f"{name} has rank below {columns}: {what} costs or disturbs nothing at high rates; "
            "give the weight on it a gain there"
        )
    order = np.r_[columns:rows, 0:columns]
    return U[:, order], Vt.T / sigma


@dataclass(frozen=True, slots=True)
class Solution:
    """What the two equations give at one gamma.

    Attributes:
        gamma: where.
        X: of the control equation, empty where there is none.
        Y: of the filter equation.
        why: what fails, None where nothing does.
        coupling: spectral radius of X Y over gamma squared, infinite where one of them is missing.
    """

    gamma: float
    X: Array
    Y: Array
    why: str | None
    coupling: float = np.inf


def solve_at(n: Normalised, gamma: float) -> Solution:
    """Solve both equations at one gamma and test (i) to (iv) of the theorem."""
    empty = np.zeros((0, 0))
    if gamma <= n.least:
        return Solution(gamma, empty, empty, "gamma is below the norm of the direct part")
    B = np.hstack([n.B1, n.B2])
    D1 = np.hstack(
        [
            n.D11,
            np.vstack(
                [np.zeros((n.D11.shape[0] - n.n_controls, n.n_controls)), np.eye(n.n_controls)]
            ),
        ]
    )
    X = _stabilising(n.A, B, n.C1, D1, gamma, n.B1.shape[1])
    if isinstance(X, str):
        return Solution(gamma, empty, empty, f"control equation: {X}")
    C = np.vstack([n.C1, n.C2])
    Dt = np.hstack(
        [
            n.D11.T,
            np.vstack(
                [np.zeros((n.D11.shape[1] - n.n_measured, n.n_measured)), np.eye(n.n_measured)]
            ),
        ]
    )
    Y = _stabilising(n.A.T, C.T, n.B1.T, Dt, gamma, n.C1.shape[0])
    if isinstance(Y, str):
        return Solution(gamma, X, empty, f"filter equation: {Y}")
    coupling = float(np.abs(np.linalg.eigvals(X @ Y)).max(initial=0.0))
    why = None if coupling < gamma**2 else "the spectral radius of X Y is not below gamma squared"
    return Solution(gamma, X, Y, why, coupling / gamma**2)


def _stabilising(A: Array, B: Array, C: Array, D: Array, gamma: float, n_w: int) -> Array | str:
    """Semidefinite stabilising solution of the equation of [A B; C D] at gamma, or why not."""
    R = D.T @ D
    R[:n_w, :n_w] -= gamma**2 * np.eye(n_w)
    S = C.T @ D
    both = np.linalg.solve(R, np.hstack([S.T, B.T]))
    RinvS, RinvB = both[:, : len(A)], both[:, len(A) :]
    F = A - B @ RinvS
    G = B @ RinvB
    Q = C.T @ C - S @ RinvS
    X = _solve_hamiltonian(F, (G + G.T) / 2, (Q + Q.T) / 2)
    if X is None:
        return "eigenvalues on the imaginary axis"
    values = np.linalg.eigvalsh(X)
    # Rounding leaves a singular X with eigenvalues of about 1e-12 of the largest; 1e-9 leaves
    # room for ill-conditioned weights, and the norm recomputed at the end has the last word.
    if values[0] < -1e-9 * max(abs(values[-1]), 1.0):
        return f"the solution is not semidefinite ({values[0]:.3g})"
    return X


def _solve_hamiltonian(F: Array, G: Array, Q: Array) -> Array | None:
    """X with F'X + X F - X G X + Q = 0 and F - G X stable, by an ordered real Schur form."""
    size = F.shape[0]
    # X scaled so that both off-diagonal blocks are of one size (a symplectic scaling).
    small = 1e-12 * max(np.abs(F).max(initial=0.0), 1e-150)
    ratio = np.sqrt(max(np.abs(Q).max(initial=0.0), small) / max(np.abs(G).max(initial=0.0), small))
    basis = _stable_subspace(np.block([[F, -G * ratio], [-Q / ratio, -F.T]]))
    if basis is None:
        return None
    try:
        X = np.linalg.solve(basis[:size].T, basis[size:].T).T * ratio
    except np.linalg.LinAlgError:
        return None
    return (X + X.T) / 2


def _stable_subspace(H: Array) -> Array | None:
    """A basis (2n, n) of what belongs to the n eigenvalues left of the axis, if so many are."""
    size = len(H) // 2
    try:
        T, Z, n_stable = _sorted_schur(H, "real")
    except np.linalg.LinAlgError:
        # Real pairs of nearly equal eigenvalues sometimes cannot be swapped; single complex ones
        # always can, at about three times the cost.
        T, Z, n_stable = _sorted_schur(H, "complex")
    if n_stable != size:
        return None
    # Pairs stand in blocks of two whose diagonal is their real part twice (LAPACK's form). Closer
    # to the axis than this, rounding cannot tell a rate from one on it.
    if -float(np.real(np.diag(T)[:size]).max()) <= 1e-13 * np.abs(T).max():
        return None
    if not np.iscomplexobj(Z):
        return Z[:, :size]
    basis = np.asarray(Z[:, :size], dtype=np.complex128)
    parts = np.hstack([basis.real, basis.imag])
    return np.asarray(scipy.linalg.qr(parts, pivoting=True)[0])[:, :size]


def _sorted_schur(H: Array, output: str) -> tuple[NDArray[Any], NDArray[Any], int]:
    """T and Z of H = Z T Z^H, eigenvalues left of the axis first, and how many those are."""
    return cast(
        "tuple[NDArray[Any], NDArray[Any], int]", scipy.linalg.schur(H, output=output, sort="lhp")
    )


def central_controller(n: Normalised, solution: Solution) -> StateSpace:
    """The central controller of a feasible solution, in the problem's own u and y."""
    gamma, X, Y = solution.gamma, solution.X, solution.Y
    n_u, n_y = n.n_controls, n.n_measured
    rows, columns = n.D11.shape[0] - n_u, n.D11.shape[1] - n_y
    D1111, D1112 = n.D11[:rows, :columns], n.D11[:rows, columns:]
    D1121, D1122 = n.D11[rows:, :columns], n.D11[rows:, columns:]
    B, C = np.hstack([n.B1, n.B2]), np.vstack([n.C1, n.C2])
    D1 = np.hstack([n.D11, np.vstack([np.zeros((rows, n_u)), np.eye(n_u)])])
    D2 = np.vstack([n.D11, np.hstack([np.zeros((n_y, columns)), np.eye(n_y)])])
    R = D1.T @ D1
    R[: n.D11.shape[1], : n.D11.shape[1]] -= gamma**2 * np.eye(n.D11.shape[1])
    Rt = D2 @ D2.T
    Rt[: n.D11.shape[0], : n.D11.shape[0]] -= gamma**2 * np.eye(n.D11.shape[0])
    F = -np.linalg.solve(R, D1.T @ n.C1 + B.T @ X)
    L = -np.linalg.solve(Rt.T, (n.B1 @ D2.T + Y @ C.T).T).T
    F12, F2 = F[columns : columns + n_y], F[columns + n_y :]
    L12, L2 = L[:, rows : rows + n_u], L[:, rows + n_u :]
    left = gamma**2 * np.eye(rows) - D1111 @ D1111.T
    D = -D1121 @ D1111.T @ np.linalg.solve(left, D1112) - D1122
    # Only products of the factors D12 and D21 of the theorem with their inverses are needed here.
    Z_right = np.linalg.inv(np.eye(X.shape[0]) - Y @ X / gamma**2)
    B1 = -Z_right @ L2 + Z_right @ (n.B2 + L12) @ D
    C2 = -(n.C2 + F12)
    C1 = F2 + D @ C2
    A = n.A + B @ F + B1 @ C2
    return _shifted(
        StateSpace(A, B1 @ n.measured_in, n.control_back @ C1, n.control_back @ D @ n.measured_in),
        n.D22,
    )


def _shifted(controller: StateSpace, D22: Array) -> StateSpace:
    """The controller for y with the plant's direct term from u, which the formulae leave out."""
    if not D22.any():
        return controller
    k = controller
    R = np.linalg.inv(np.eye(k.n_outputs) + k.D @ D22)
    return StateSpace(
        k.A - k.B @ D22 @ R @ k.C,
        k.B - k.B @ D22 @ R @ k.D,
        R @ k.C,
        R @ k.D,
    )


def _norm(matrix: Array) -> float:
    return float(np.linalg.norm(matrix, 2)) if matrix.size else 0.0
