"""Linear systems as matrices, and the few ways of joining them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class StateSpace:
    """x' = A x + B u, y = C x + D u; with `period_s` x' is the next state instead.

    Raises:
        ValueError: where the shapes do not fit or an entry is not finite.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    period_s: float | None = None

    def __post_init__(self) -> None:
        for name in "ABCD":
            matrix = np.array(getattr(self, name), dtype=np.float64, ndmin=2)
            if not np.isfinite(matrix).all():
                raise ValueError(f"{name} has entries that are not finite")
            matrix.flags.writeable = False
            object.__setattr__(self, name, matrix)
        n = self.A.shape[0]
        shapes = (self.A.shape, self.B.shape, self.C.shape)
        if shapes != ((n, n), (n, self.D.shape[1]), (self.D.shape[0], n)):
            raise ValueError(f"A, B, C, D of shapes {shapes}, {self.D.shape} do not fit together")

    @property
    def order(self) -> int:
        """Number of states."""
        return self.A.shape[0]

    @property
    def n_inputs(self) -> int:
        """Number of inputs."""
        return self.D.shape[1]

    @property
    def n_outputs(self) -> int:
        """Number of outputs."""
        return self.D.shape[0]

    def poles(self) -> Complex:
        """Eigenvalues of A."""
        return np.asarray(np.linalg.eigvals(self.A), dtype=np.complex128)

    def is_stable(self) -> bool:
        """Every pole strictly left of the axis, or inside the circle of a discrete system."""
        poles = self.poles()
        if self.period_s is None:
            return bool((poles.real < 0.0).all())
        return bool((np.abs(poles) < 1.0).all())

    def at(self, rates_rad_s: Array) -> Complex:
        """Response at the given rates, (n_rates, n_outputs, n_inputs)."""
        s = 1j * np.atleast_1d(rates_rad_s)
        point = s if self.period_s is None else np.exp(s * self.period_s)
        point = np.asarray(point, dtype=np.complex128)
        # One Hessenberg form serves all rates: n^2 instead of n^3 work at each.
        return _response(self.A, self.B, self.C, self.D, point)


def _response(A: Array, B: Array, C: Array, D: Array, points: Complex) -> Complex:
    if A.shape[0] == 0:
        return np.broadcast_to(D, (len(points), *D.shape)).astype(np.complex128)
    pencil = points[:, None, None] * np.eye(A.shape[0]) - A
    return C @ np.linalg.solve(pencil, np.broadcast_to(B, (len(points), *B.shape))) + D


def gain(matrix: Array) -> StateSpace:
    """A system without states."""
    D = np.atleast_2d(matrix)
    return StateSpace(np.zeros((0, 0)), np.zeros((0, D.shape[1])), np.zeros((D.shape[0], 0)), D)


def append(*systems: StateSpace) -> StateSpace:
    """Side by side: block-diagonal, each with inputs and outputs of its own."""
    A, D = (
        np.asarray(scipy.linalg.block_diag(*[getattr(s, name) for s in systems])) for name in "AD"
    )
    order, outputs, inputs = (
        sum(s.order for s in systems),
        sum(s.n_outputs for s in systems),
        sum(s.n_inputs for s in systems),
    )
    B, C = np.zeros((order, inputs)), np.zeros((outputs, order))
    i = j = k = 0
    for s in systems:
        B[i : i + s.order, j : j + s.n_inputs] = s.B
        C[k : k + s.n_outputs, i : i + s.order] = s.C
        i, j, k = i + s.order, j + s.n_inputs, k + s.n_outputs
    return StateSpace(A.reshape(order, order), B, C, D, systems[0].period_s)


def series(first: StateSpace, second: StateSpace) -> StateSpace:
    """`second` after `first`: y = second(first(u))."""
    A = np.block(
        [
            [first.A, np.zeros((first.order, second.order))],
            [second.B @ first.C, second.A],
        ]
    )
    B = np.vstack([first.B, second.B @ first.D])
    C = np.hstack([second.D @ first.C, second.C])
    return StateSpace(A, B, C, second.D @ first.D, first.period_s)


def close(plant: StateSpace, controller: StateSpace) -> StateSpace:
    """Lower linear fractional transformation.

    The last outputs of `plant` feed the controller, whose outputs are its last inputs.

    Raises:
        ValueError: where the loop is not well posed (I - D22 Dk singular to working precision).
    """
    n_u, n_y = controller.n_outputs, controller.n_inputs
    n_w, n_z = plant.n_inputs - n_u, plant.n_outputs - n_y
    B1, B2 = plant.B[:, :n_w], plant.B[:, n_w:]
    C1, C2 = plant.C[:n_z], plant.C[n_z:]
    D11, D12 = plant.D[:n_z, :n_w], plant.D[:n_z, n_w:]
    D21, D22 = plant.D[n_z:, :n_w], plant.D[n_z:, n_w:]
    loop = np.eye(n_y) - D22 @ controller.D
    if np.linalg.cond(loop) > 1.0 / np.finfo(float).eps:
        raise ValueError("the loop is not well posed: direct terms of plant and controller cancel")
    R = np.linalg.inv(loop)
    DkR = controller.D @ R
    A = np.block(
        [
            [plant.A + B2 @ DkR @ C2, B2 @ (controller.C + DkR @ D22 @ controller.C)],
            [controller.B @ R @ C2, controller.A + controller.B @ R @ D22 @ controller.C],
        ]
    )
    B = np.vstack([B1 + B2 @ DkR @ D21, controller.B @ R @ D21])
    C = np.hstack([C1 + D12 @ DkR @ C2, D12 @ (controller.C + DkR @ D22 @ controller.C)])
    return StateSpace(A, B, C, D11 + D12 @ DkR @ D21, plant.period_s)
