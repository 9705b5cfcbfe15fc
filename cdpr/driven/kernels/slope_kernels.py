"""How the steps of a motion answer to its start and to numbers: Runge and Kutta's own, exactly."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.kernels import kernel
from freeswing.cdpr.compiled.native import call_at
from freeswing.cdpr.driven.kernels.rigid_kernels import N_STATE, one_step, stage_shares

Array = NDArray[np.float64]

STAGES = 4
N_POSE = 6


class Slope(NamedTuple):
    """Derivatives of the acceleration as machine code of four lanes, one a stage.

    Attributes:
        address: of (state, currents, theta, direction) -> direction . (derivatives of the twist's
            acceleration by state, currents and chosen numbers).
        inputs: one row an entry, theta stands in it already, (13 + n + len(theta) + 6, 4).
        outputs: (13 + n + k, 4).
        by: the derivatives at each stage, (4, 6, 13 + n + k).
    """

    address: int
    inputs: Array
    outputs: Array
    by: Array


@kernel
def set_derivatives(machine, slope):
    """Derivatives at the stages that `machine` holds, into `slope.by`."""
    n, inputs, outputs = machine.flows.shape[1], slope.inputs, slope.outputs
    for stage in range(STAGES):
        for i in range(N_STATE):
            inputs[i, stage] = machine.states[stage, i]
        for j in range(n):
            inputs[N_STATE + j, stage] = machine.flows[stage, j]
    first = len(inputs) - 6
    for direction in range(6):
        for k in range(6):
            for stage in range(STAGES):
                inputs[first + k, stage] = 1.0 if k == direction else 0.0
        call_at(slope.address, inputs.ctypes.data, outputs.ctypes.data)
        for stage in range(STAGES):
            for i in range(len(outputs)):
                slope.by[stage, direction, i] = outputs[i, stage]


@kernel
def set_rates(state, by, changes, shares, rates):
    """Rates (13, m) of changes (13, m) at a stage, sources included.

    Args:
        state: there, (13,).
        by: derivatives of the acceleration there, (6, 13 + n + k).
        changes: of the state by start pose, start currents and numbers.
        shares: what is left there of a unit start current, (n,).
        rates: filled.
    """
    n, m = len(shares), changes.shape[1]
    w, x, y, z = 0.5 * state[3], 0.5 * state[4], 0.5 * state[5], 0.5 * state[6]
    p, q, r = 0.5 * state[10], 0.5 * state[11], 0.5 * state[12]
    for c in range(m):
        rates[0, c], rates[1, c], rates[2, c] = changes[7, c], changes[8, c], changes[9, c]
        dw, dx, dy, dz = changes[3, c], changes[4, c], changes[5, c], changes[6, c]
        dp, dq, dr = changes[10, c], changes[11, c], changes[12, c]
        rates[3, c] = -p * dx - q * dy - r * dz - x * dp - y * dq - z * dr
        rates[4, c] = p * dw + r * dy - q * dz + w * dp - z * dq + y * dr
        rates[5, c] = q * dw - r * dx + p * dz + z * dp + w * dq - x * dr
        rates[6, c] = r * dw + q * dx - p * dy - y * dp + x * dq + w * dr
    for i in range(6):
        row = rates[7 + i]
        for c in range(m):
            row[c] = 0.0
        for s in range(N_STATE):
            factor = by[i, s]
            for c in range(m):
                row[c] += factor * changes[s, c]
        for j in range(n):
            row[N_POSE + j] += by[i, N_STATE + j] * shares[j]
        for k in range(N_POSE + n, m):
            row[k] += by[i, N_STATE + k - N_POSE]


@kernel
def carry(machine, slope, left, period, changes):
    """Changes (13, m) after the step whose stages `machine` holds, in place.

    Args:
        machine: as `one_step` left it.
        slope: derivatives of the acceleration.
        left: of a unit start current at the step's start, (n,); at its end afterwards.
        period: of the step.
        changes: by start pose, start currents and numbers.
    """
    set_derivatives(machine, slope)
    m, n = changes.shape[1], len(left)
    shares, total = np.empty((STAGES, n)), np.zeros((N_STATE, m))
    for j in range(n):
        middle, last = stage_shares(machine.lags[j], period)
        shares[0, j], shares[1, j] = left[j], left[j] * middle
        shares[2, j], shares[3, j] = shares[1, j], left[j] * last
        left[j] *= np.exp(-period / machine.lags[j])
    looked, rates = changes.copy(), np.empty((N_STATE, m))
    for stage in range(STAGES):
        if stage > 0:
            part = period if stage == 3 else 0.5 * period
            for i in range(N_STATE):
                for c in range(m):
                    looked[i, c] = changes[i, c] + part * rates[i, c]
        set_rates(machine.states[stage], slope.by[stage], looked, shares[stage], rates)
        weight = 2.0 if stage in (1, 2) else 1.0
        for i in range(N_STATE):
            for c in range(m):
                total[i, c] += weight * rates[i, c]
    for i in range(N_STATE):
        for c in range(m):
            changes[i, c] += period / 6.0 * total[i, c]


@kernel
def all_slopes(machine, slope, period, states, currents, references, steps, result):
    """Fill result (n_t, 13, m) from its first row; quaternions are normalised as the steps do."""
    now, left = result[0].copy(), np.ones(currents.shape[1])
    unused = np.empty(currents.shape[1])
    for k in range(len(steps)):
        state, flowing = states[k].copy(), currents[k].copy()
        part = period / steps[k]
        for _ in range(steps[k]):
            one_step(machine, state, flowing, references[k], part, unused)
            carry(machine, slope, left, part, now)
            for c in range(now.shape[1]):
                along = 0.0
                for i in range(3, 7):
                    along += state[i] * now[i, c]
                for i in range(3, 7):
                    now[i, c] -= state[i] * along
        for i in range(N_STATE):
            for c in range(now.shape[1]):
                result[k + 1, i, c] = now[i, c]
