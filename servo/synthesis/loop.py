"""What a closed loop can do: bandwidths, modulus margins, delay margin, and what it leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.servo.synthesis.four_block import bare
from freeswing.servo.synthesis.state_space import Array, Complex, StateSpace, close

# Five decades around the rates of cable robots; 400 a decade place a crossing to 0.3 %.
RATES_RAD_S = np.geomspace(1e-2, 1e3, 2001)
# Where what is left at rest is read: an integrator has its pole on 0 itself.
AT_REST_RAD_S = 1e-6
MINUS_3_DB = 1.0 / np.sqrt(2.0)


@dataclass(frozen=True, slots=True)
class Half:
    """Positions or orientations of one loop."""

    bandwidth_rad_s: float
    modulus_margin: float
    static_error: float


@dataclass(frozen=True, slots=True)
class Loop:
    """The loop of one plant and one controller, with a delay in its measurements."""

    stable: bool
    position: Half
    orientation: Half
    delay_margin_s: float


def sensitivity(plant: StateSpace, controller: StateSpace, rates: Array, delay_s: float) -> Complex:
    """S = (I + G K e^(-s delay))^-1 at the rates, six by six each."""
    open_loop = open_response(plant, controller, rates)
    return _sensitivity(open_loop, rates, delay_s)


def open_response(plant: StateSpace, controller: StateSpace, rates: Array) -> Complex:
    """G K at the rates."""
    return plant.at(rates) @ controller.at(rates)


def examine(
    plant: StateSpace, controller: StateSpace, delay_s: float = 0.0, before: Loop | None = None
) -> Loop:
    """Margins of the loop; with a delay it is stable while that is below the delay margin.

    Args:
        plant: continuous, wrench to pose.
        controller: continuous, pose error to wrench.
        delay_s: of the pose on its way to the controller.
        before: the same loop at another delay, to spare its stability and delay margin.
    """
    if before is not None:
        stable, margin = before.delay_margin_s > 0.0, before.delay_margin_s
    else:
        stable = close(bare(plant).plant, controller).is_stable()
        margin = delay_margin(plant, controller) if stable else 0.0
    S = sensitivity(plant, controller, np.r_[AT_REST_RAD_S, RATES_RAD_S], delay_s)
    return Loop(stable and margin > delay_s, _half(S[:, :3, :3]), _half(S[:, 3:, 3:]), margin)


def delay_margin(plant: StateSpace, controller: StateSpace) -> float:
    """The least delay, the same in all measurements, that makes a stable loop unstable.

    Where an eigenvalue of G K has size 1, at w, the delay (pi + its angle) / w puts it on -1.
    Infinite where none ever has.
    """
    values = np.linalg.eigvals(open_response(plant, controller, RATES_RAD_S))
    values = _tracked(np.asarray(values, dtype=np.complex128))
    size = np.log(np.abs(values))
    least = np.inf
    for k, i in zip(*np.nonzero(size[:-1] * size[1:] < 0.0), strict=True):
        share = size[k, i] / (size[k, i] - size[k + 1, i])
        rate = RATES_RAD_S[k] * (RATES_RAD_S[k + 1] / RATES_RAD_S[k]) ** share
        turn = np.angle(values[k + 1, i] / values[k, i])
        angle = np.angle(values[k, i]) + share * turn
        least = min(least, float(np.mod(angle + np.pi, 2.0 * np.pi) / rate))
    return least


def _tracked(values: Complex) -> Complex:
    """Eigenvalues of each row in the order that continues the row before."""
    tracked = values.copy()
    for k in range(1, len(values)):
        left = list(values[k])
        for i, before in enumerate(tracked[k - 1]):
            nearest = int(np.argmin(np.abs(np.array(left) - before)))
            tracked[k, i] = left.pop(nearest)
    return tracked


def _sensitivity(open_loop: Complex, rates: Array, delay_s: float) -> Complex:
    late = np.exp(-1j * rates * delay_s)[:, None, None]
    found = np.linalg.inv(np.eye(open_loop.shape[1]) + open_loop * late)
    return np.asarray(found, dtype=np.complex128)


def _half(S: Complex) -> Half:
    largest = np.linalg.norm(S, 2, axis=(1, 2))
    above = np.flatnonzero(largest >= MINUS_3_DB)
    bandwidth = 0.0 if len(above) == 0 or above[0] <= 1 else float(RATES_RAD_S[above[0] - 1])
    return Half(bandwidth, float(1.0 / largest.max()), float(largest[0]))
