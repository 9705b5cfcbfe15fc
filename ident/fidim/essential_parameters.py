"""Which of the nine parameters are essential, and which may go (FIDIM 2022, sec. 3.2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.robot import Array
from freeswing.ident.fidim.total_least_squares import total_least_squares

WELL_IDENTIFIED_PERCENT = 10.0  # FIDIM 2022, after eq. (34)
NEAR_ZERO = 0.1  # of the largest of its kind: such a value may go (sec. 3.2: not essential)


def essential_parameters(W: Array) -> NDArray[np.bool_]:
    """The 10 % rule (sec. 3.2): near zero and ill determined means not essential, (9,).

    The worst one leaves first; the rest is solved again before the next is judged.
    """
    essential = np.ones(9, dtype=bool)
    while essential.sum() > 1:
        solution = total_least_squares(W[:, np.concatenate([[True], essential])])
        values = np.zeros(9)
        percent = np.zeros(9)
        values[essential], percent[essential] = solution.values, solution.std_percent
        droppable = essential & (percent > WELL_IDENTIFIED_PERCENT) & near_zero(values)
        if not droppable.any():
            break
        essential[np.argmax(np.where(droppable, percent, -np.inf))] = False
    return essential


def undetermined(values: Array, std: Array) -> NDArray[np.bool_]:
    """Values small beside the largest of their kind and known to no tenth of themselves, (9,).

    Source:
        FIDIM 2022, sec. 3.2: parameters that are not essential.
    """
    return (100.0 * std > WELL_IDENTIFIED_PERCENT * np.abs(values)) & near_zero(values)


def near_zero(values: Array) -> NDArray[np.bool_]:
    """Values small beside the largest of their kind (first moments; inertia), (9,).

    Source:
        FIDIM 2022, sec. 3.2: parameters that are not essential.
    """
    scale = np.repeat([np.abs(values[:3]).max(), np.abs(values[3:]).max()], [3, 6])
    return np.abs(values) < NEAR_ZERO * scale
