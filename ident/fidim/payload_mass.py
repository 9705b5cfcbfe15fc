"""Mass from runs with a known payload (FIDIM 2022, eqs. 23, 24)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.frozen import freeze
from freeswing.cdpr.robot import Array
from freeswing.ident.runs import Payload

_SWEEPS = 8


@dataclass(frozen=True, slots=True)
class LoadedCentre:
    """Where the centre of mass lies with a payload on.

    Attributes:
        payload: the payload.
        com_m: P to the common centre of mass, platform frame, (3,).
        covariance: of `com_m`, (3, 3).
    """

    payload: Payload
    com_m: Array
    covariance: Array

    def __post_init__(self) -> None:
        freeze(self, "com_m", "covariance")


@dataclass(frozen=True, slots=True)
class MassEstimate:
    """The platform's mass without payloads.

    Attributes:
        mass_kg: mass.
        std_kg: its standard deviation.
        chi_square: weighted residual over its degrees of freedom, about 1 when all agree; None
            where the mass was not found by itself.
    """

    mass_kg: float
    std_kg: float
    chi_square: float | None


def mass_from_payloads(com_m: Array, covariance: Array, loaded: list[LoadedCentre]) -> MassEstimate:
    """Weighted least squares of m (s_L - s) = dm (p_L - s_L) over all payloads (eq. 24).

    The weights are the inverse covariances of both centres, which enter with m itself: iterated.
    The unloaded centre's error is common to all payloads and is treated so.

    Args:
        com_m: centre of mass without payload, (3,).
        covariance: of `com_m`, (3, 3).
        loaded: one or more centres with payload.

    Raises:
        ValueError: when no payload is given, or the centres do not move away from the unloaded one
            towards the payload by more than twice their uncertainty, with the numbers.
    """
    if not loaded:
        raise ValueError("no payload run to take the mass from")
    shifts = np.concatenate([item.com_m - com_m for item in loaded])
    pulls = np.concatenate(
        [item.payload.mass_kg * (item.payload.position_m - item.com_m) for item in loaded]
    )
    mass = float(pulls @ shifts / (shifts @ shifts)) if shifts @ shifts > 0.0 else 0.0
    variance, weight = np.inf, np.eye(len(shifts))
    for _ in range(_SWEEPS):
        weight = np.linalg.inv(_residual_covariance(max(mass, 0.0), covariance, loaded))
        information = float(shifts @ weight @ shifts)
        if not information > 0.0:
            break
        variance = 1.0 / information
        mass = variance * float(shifts @ weight @ pulls)
    std = float(np.sqrt(variance))
    if not mass > 2.0 * std:
        moved = 1e3 * np.linalg.norm(shifts.reshape(-1, 3), axis=1)
        raise ValueError(
            f"payloads move the centre of mass by {np.round(moved, 2)} mm, which gives "
            f"{mass:.3g} +- {std:.2g} kg: no usable mass; put the payload farther from the centre "
            "of mass, or take a heavier one"
        )
    freedom, residual = len(shifts) - 1, mass * shifts - pulls
    return MassEstimate(mass, std, float(residual @ weight @ residual) / freedom)


def _residual_covariance(mass: float, covariance: Array, loaded: list[LoadedCentre]) -> Array:
    """Covariance of m (s_L - s) - dm (p_L - s_L), (3 k, 3 k)."""
    k = len(loaded)
    total: Array = mass**2 * np.kron(np.ones((k, k)), covariance).astype(np.float64)
    for i, item in enumerate(loaded):
        block = slice(3 * i, 3 * i + 3)
        total[block, block] += (mass + item.payload.mass_kg) ** 2 * item.covariance
    return total
