"""What a standard problem must fulfil before its Riccati equations mean anything.

Zhou, Doyle and Glover, section 17.1, (A1) to (A4), each tested by itself and each failure a
sentence that names the weight or the mode.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freeswing.servo.synthesis.riccati import StandardProblem
from freeswing.servo.synthesis.state_space import Array, Complex

# A mode within this share of the largest rate of the axis counts as on it: closer, and the
# solution of the Riccati equation has no digits left.
NEAR_AXIS = 1e-10
# A pencil whose least singular value is this small, relative, has lost rank: rounding of the
# problem's own matrices moves it by about 1e-14.
RANK = 1e-11


def failures(problem: StandardProblem, names: Sequence[str] | None = None) -> list[str]:
    """Every assumption that fails, as a sentence; an empty list when the problem is sound.

    Args:
        problem: inputs [w, u], outputs [z, y].
        names: one name for each state, for the sentences.
    """
    plant, n_u, n_y = problem.plant, problem.n_controls, problem.n_measured
    names = names or [f"state {i + 1}" for i in range(plant.order)]
    n_w, n_z = plant.n_inputs - n_u, plant.n_outputs - n_y
    A = plant.A
    B1, B2 = plant.B[:, :n_w], plant.B[:, n_w:]
    C1, C2 = plant.C[:n_z], plant.C[n_z:]
    D12, D21 = plant.D[:n_z, n_w:], plant.D[n_z:, :n_w]
    found = [
        f"the mode at {_rate(rate)} of {name} cannot be stabilised: no control reaches it"
        for rate, name in _bad_modes(A.T, B2.T, names, unstable_only=True)
    ]
    found += [
        f"the mode at {_rate(rate)} of {name} is not seen by any measurement and does not decay"
        for rate, name in _bad_modes(A, C2, names, unstable_only=True)
    ]
    full_control, full_measured = _full_column_rank(D12), _full_column_rank(D21.T)
    if not full_control:
        found.append(
            "a control costs nothing at high rates (D12 loses rank): w2 needs a gain there; "
            "give it a pole_rad_s at least as often as a zero_rad_s"
        )
    if not full_measured:
        found.append(
            "a measurement is free of noise at high rates (D21 loses rank): the reference must "
            "enter the error directly"
        )
    if full_control:
        found += [
            f"from the controls to what is judged there is a zero on the imaginary axis at "
            f"{_rate(rate)}, in {name}: move the pole or zero of that weight off the axis"
            for rate, name in _axis_zeros(A, B2, C1, D12, names)
        ]
    if full_measured:
        found += [
            f"from the disturbances to the measurements there is a zero on the imaginary axis at "
            f"{_rate(rate)}, in {name}: let a disturbance reach that mode (w3), or damp it"
            for rate, name in _axis_zeros(A.T, C2.T, B1.T, D21.T, names)
        ]
    return found


def _axis_zeros(
    A: Array, B: Array, C: Array, D: Array, names: Sequence[str]
) -> list[tuple[complex, str]]:
    """Zeros on the axis of [A - s, B; C, D] with D of full column rank.

    They are the unobservable modes on the axis of (A - B D+ C, (I - D D+) C).
    """
    inverse = np.linalg.pinv(D)
    rest = C - D @ inverse @ C
    found = _bad_modes(A - B @ inverse @ C, rest, names, unstable_only=False)
    reach = max(np.abs(np.linalg.eigvals(A)).max(initial=1.0), 1.0)
    return [(rate, name) for rate, name in found if abs(rate.real) <= NEAR_AXIS * reach]


def _bad_modes(
    A: Array, C: Array, names: Sequence[str], *, unstable_only: bool
) -> list[tuple[complex, str]]:
    """Modes of A that C does not see (Popov, Belevitch, Hautus), one of each conjugate pair."""
    if A.shape[0] == 0:
        return []
    rates, vectors = np.linalg.eig(A)
    size = max(np.linalg.norm(A), np.linalg.norm(C), 1.0)
    reach = max(np.abs(rates).max(), 1.0)
    found = []
    for rate, vector in zip(rates, vectors.T, strict=True):
        if rate.imag < 0.0 or (unstable_only and rate.real < -NEAR_AXIS * reach):
            continue
        pencil = np.vstack([A - rate * np.eye(len(A)), C])
        if np.linalg.svd(pencil, compute_uv=False)[-1] <= RANK * size:
            found.append((complex(rate), names[int(np.argmax(np.abs(vector)))]))
    return list(dict.fromkeys(found))


def _full_column_rank(D: Array) -> bool:
    sigma = np.linalg.svd(D, compute_uv=False)
    return len(sigma) >= D.shape[1] and sigma[D.shape[1] - 1] > 1e-10 * max(sigma[0], 1e-300)


def _rate(rate: complex | Complex) -> str:
    rate = complex(rate)
    if abs(rate.imag) <= 1e-9 * max(abs(rate), 1e-9):
        return f"{rate.real:.3g} rad/s"
    return f"{rate.real:.3g} +- {abs(rate.imag):.3g}i rad/s"
