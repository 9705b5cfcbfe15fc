"""Runge and Kutta's steps of a driven robot with rigid cables, sample after sample."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.kernels import kernel
from freeswing.cdpr.compiled.native import call_at

Array = NDArray[np.float64]

N_STATE = 13


class Machine(NamedTuple):
    """The equations of motion as machine code, with its memory.

    Attributes:
        address: of (state, currents, theta) -> acceleration, tensions, signs.
        inputs: state, currents and theta one after another; theta stands in it already.
        outputs: acceleration (6), tensions (n), signs (n).
        lags: time constant of each current loop, (n,).
        states: at the four stages of a step, (4, 13).
        flows: currents there, (4, n).
        slopes: rate of the state there, (4, 13).
    """

    address: int
    inputs: Array
    outputs: Array
    lags: Array
    states: Array
    flows: Array
    slopes: Array


class Pace(NamedTuple):
    """How steps are chosen.

    Attributes:
        period: of a sample.
        least: steps a sample at least.
        turn: by how much a sign may change in one step.
        refined: times more steps at most where one does.
        reach: a coordinate beyond it is a platform that is lost.
    """

    period: float
    least: int
    turn: float
    refined: int
    reach: float


@kernel
def set_flows(machine, currents, references, period):
    """The currents that a step's stages take, from those at its start.

    They are chosen so that the impulse and its first moment are those of the exponential itself:
    PRBS edges then cost no accuracy at steps near the loop's time constant.
    """
    flows = machine.flows
    for j in range(len(currents)):
        middle, last = stage_shares(machine.lags[j], period)
        gap = currents[j] - references[j]
        flows[0, j] = currents[j]
        flows[1, j] = references[j] + gap * middle
        flows[2, j] = flows[1, j]
        flows[3, j] = references[j] + gap * last


@kernel
def stage_shares(lag, period):
    """What is left of a unit gap of the current at the middle stages and at the last."""
    ratio = lag / period
    left = np.exp(-1.0 / ratio)
    impulse = ratio * (1.0 - left)  # integral of the decay over the period, over the period
    moment = 2.0 * ratio * (1.0 - impulse)  # weighted with the time that is left, times 2
    middle = (3.0 * moment - 1.0) / 2.0
    return middle, 6.0 * impulse - 1.0 - 4.0 * middle


@kernel
def set_slope(machine, stage):
    """Rate of the state at a stage, into `machine.slopes`."""
    state, slope = machine.states[stage], machine.slopes[stage]
    n = machine.flows.shape[1]
    inputs, outputs = machine.inputs, machine.outputs
    for i in range(N_STATE):
        inputs[i] = state[i]
    for j in range(n):
        inputs[N_STATE + j] = machine.flows[stage, j]
    call_at(machine.address, inputs.ctypes.data, outputs.ctypes.data)
    for i in range(3):
        slope[i] = state[7 + i]
    w, x, y, z = state[3], state[4], state[5], state[6]
    p, q, r = state[10], state[11], state[12]
    slope[3] = 0.5 * (-x * p - y * q - z * r)
    slope[4] = 0.5 * (w * p + y * r - z * q)
    slope[5] = 0.5 * (w * q + z * p - x * r)
    slope[6] = 0.5 * (w * r + x * q - y * p)
    for i in range(6):
        slope[7 + i] = outputs[i]


@kernel
def one_step(machine, state, currents, references, period, tensions):
    """Advance state (13,) and currents (n,) in place; the largest change of a motor's sign.

    Args:
        machine: the equations.
        state: changed.
        currents: changed.
        references: held, (n,).
        period: of this step.
        tensions: filled with those at the step's start, (n,).
    """
    states, slopes, outputs, n = machine.states, machine.slopes, machine.outputs, len(currents)
    set_flows(machine, currents, references, period)
    for i in range(N_STATE):
        states[0, i] = state[i]
    set_slope(machine, 0)
    signs = np.empty(n)
    for j in range(n):
        tensions[j], signs[j] = outputs[6 + j], outputs[6 + n + j]
    for stage in range(1, 4):
        part = period if stage == 3 else 0.5 * period
        for i in range(N_STATE):
            states[stage, i] = state[i] + part * slopes[stage - 1, i]
        set_slope(machine, stage)
    turned = 0.0
    for j in range(n):
        turned = max(turned, abs(outputs[6 + n + j] - signs[j]))
        left = np.exp(-period / machine.lags[j])
        currents[j] = references[j] + (currents[j] - references[j]) * left
    for i in range(N_STATE):
        state[i] += (
            period / 6.0 * (slopes[0, i] + 2.0 * slopes[1, i] + 2.0 * slopes[2, i] + slopes[3, i])
        )
    norm = np.sqrt(state[3] ** 2 + state[4] ** 2 + state[5] ** 2 + state[6] ** 2)
    for i in range(3, 7):
        state[i] /= norm
    return turned


@kernel
def one_sample(machine, pace, state, currents, references, tensions):
    """Advance by one period of held references; the number of steps that it took.

    A period in which a motor turns round, and its friction with it, is taken again in steps so
    fine that the smoothed sign changes by at most `pace.turn` in each.
    """
    before, flowing, unused = state.copy(), currents.copy(), np.empty(len(currents))
    turned = one_step(machine, state, currents, references, pace.period / pace.least, tensions)
    for _ in range(pace.least - 1):
        step = one_step(machine, state, currents, references, pace.period / pace.least, unused)
        turned = max(turned, step)
    if not turned > pace.turn:
        return pace.least
    count = pace.least * min(int(np.ceil(turned / pace.turn)), pace.refined)
    for i in range(N_STATE):
        state[i] = before[i]
    for j in range(len(currents)):
        currents[j] = flowing[j]
    for _ in range(count):
        one_step(machine, state, currents, references, pace.period / count, unused)
    return count


@kernel
def all_samples(machine, pace, states, currents, references, tensions, steps):
    """Fill states (n_t, 13), currents and tensions (n_t, n), steps (n_t - 1,) from first rows.

    Returns the row at which the platform is lost, or -1.
    """
    state, flowing = states[0].copy(), currents[0].copy()
    for k in range(len(references) - 1):
        steps[k] = one_sample(machine, pace, state, flowing, references[k], tensions[k])
        for i in range(N_STATE):
            states[k + 1, i] = state[i]
        for j in range(len(flowing)):
            currents[k + 1, j] = flowing[j]
        inside = abs(state[0]) < pace.reach and abs(state[1]) < pace.reach
        if not (inside and abs(state[2]) < pace.reach):  # NaN is not inside
            return k + 1
    last = len(references) - 1
    one_step(machine, state, flowing, references[last], pace.period, tensions[last])
    return -1
