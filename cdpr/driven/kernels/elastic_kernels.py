"""Runge and Kutta's steps of a driven robot with elastic cables, sample after sample."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.kernels import kernel
from freeswing.cdpr.compiled.native import call_at
from freeswing.cdpr.driven.kernels.rigid_kernels import N_STATE, set_flows

Array = NDArray[np.float64]


class ElasticMachine(NamedTuple):
    """The equations of motion as machine code, with its memory.

    Attributes:
        address: of (state, out, rates, currents, EA, relaxation, theta) -> acceleration of the
            twist, of the lengths let out, tensions.
        inputs: all of them one after another; the constants stand in it already.
        outputs: (6 + 2 n,).
        lags: time constant of each current loop, (n,).
        looks: state, lengths let out and their rates at the four stages of a step, (4, 13 + 2 n).
        flows: currents there, (4, n).
        slopes: rates of `looks`, (4, 13 + 2 n).
    """

    address: int
    inputs: Array
    outputs: Array
    lags: Array
    looks: Array
    flows: Array
    slopes: Array


@kernel
def set_elastic_slope(machine, stage):
    """Rates of everything at a stage, into `machine.slopes`."""
    y, slope = machine.looks[stage], machine.slopes[stage]
    inputs, outputs, n = machine.inputs, machine.outputs, machine.flows.shape[1]
    for i in range(N_STATE + 2 * n):
        inputs[i] = y[i]
    for j in range(n):
        inputs[N_STATE + 2 * n + j] = machine.flows[stage, j]
    call_at(machine.address, inputs.ctypes.data, outputs.ctypes.data)
    w, x, yy, z = y[3], y[4], y[5], y[6]
    p, q, r = y[10], y[11], y[12]
    for i in range(3):
        slope[i] = y[7 + i]
    slope[3] = 0.5 * (-x * p - yy * q - z * r)
    slope[4] = 0.5 * (w * p + yy * r - z * q)
    slope[5] = 0.5 * (w * q + z * p - x * r)
    slope[6] = 0.5 * (w * r + x * q - yy * p)
    for i in range(6):
        slope[7 + i] = outputs[i]
    for j in range(n):
        slope[N_STATE + j] = y[N_STATE + n + j]
        slope[N_STATE + n + j] = outputs[6 + j]


@kernel
def elastic_step(machine, y, currents, references, period, tensions):
    """Advance y (13 + 2 n,) and currents (n,) in place; tensions (n,) are those at the start."""
    looks, slopes, n = machine.looks, machine.slopes, len(currents)
    set_flows(machine, currents, references, period)
    for i in range(len(y)):
        looks[0, i] = y[i]
    set_elastic_slope(machine, 0)
    for j in range(n):
        tensions[j] = machine.outputs[6 + n + j]
    for stage in range(1, 4):
        part = period if stage == 3 else 0.5 * period
        for i in range(len(y)):
            looks[stage, i] = y[i] + part * slopes[stage - 1, i]
        set_elastic_slope(machine, stage)
    for i in range(len(y)):
        y[i] += (
            period / 6.0 * (slopes[0, i] + 2.0 * slopes[1, i] + 2.0 * slopes[2, i] + slopes[3, i])
        )
    norm = np.sqrt(y[3] ** 2 + y[4] ** 2 + y[5] ** 2 + y[6] ** 2)
    for i in range(3, 7):
        y[i] /= norm
    for j in range(n):
        left = np.exp(-period / machine.lags[j])
        currents[j] = references[j] + (currents[j] - references[j]) * left


@kernel
def elastic_samples(machine, period, count, reach, looks, currents, references, tensions):
    """Fill looks (n_t, 13 + 2 n), currents and tensions (n_t, n) from their first rows.

    Args:
        machine: the equations.
        period: of a sample.
        count: steps a sample.
        reach: a coordinate beyond it is a platform that is lost.
        looks: state, lengths let out, their rates.
        currents: filled.
        references: held, (n_t, n).
        tensions: filled.

    Returns the row at which the platform is lost, or -1.
    """
    y, flowing, unused = looks[0].copy(), currents[0].copy(), np.empty(currents.shape[1])
    for k in range(len(references)):
        for i in range(len(y)):
            looks[k, i] = y[i]
        for j in range(len(flowing)):
            currents[k, j] = flowing[j]
        elastic_step(machine, y, flowing, references[k], period / count, tensions[k])
        for _ in range(count - 1):
            elastic_step(machine, y, flowing, references[k], period / count, unused)
        inside = abs(y[0]) < reach and abs(y[1]) < reach
        if not (inside and abs(y[2]) < reach):  # NaN is not inside
            return k
    return -1
