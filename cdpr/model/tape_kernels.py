"""Numba kernels that run a tape: one instruction at a time, each over a block of points.

What an interpreter costs an instruction is shared by the points of a block, and an instruction's
loop over them is one or two vector operations: 0.6 ns an operation and point, where CasADi's own
interpreter takes 8, to the same bits.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from freeswing.cdpr.robot import Array

# Points of a block: two cache lines a slot, and a Jacobian's thousand slots within the near cache.
LANES = 16

(MUL, ADD, SUB, DIV, NEG, SQUARE, TWICE, INVERSE, CONSTANT, INPUT, OUTPUT, ROOT) = range(12)
FIRST_UNARY = 12
(SINE, COSINE, TANGENT, ARC_SINE, ARC_COSINE, ARC_TANGENT, TANH, EXP, LOG) = range(12, 21)
(ABSOLUTE, SIGN, COPY, NOT) = range(21, 25)
FIRST_BINARY = 25
(ARC_TANGENT_2, POWER, LEAST, LARGEST, LESS, LESS_EQUAL, EQUAL, UNEQUAL) = range(25, 33)
(AND, OR, IF_ELSE_ZERO) = range(33, 36)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def run_tape(code: Array, constants: Array, points: Array, results: Array, work: Array) -> None:
    """Evaluate a tape at every point.

    Args:
        code: operation, target slot, two source slots each, (k, 4); of an input its place among
            the numbers of a point, of an output its place among the results'.
        constants: of the instructions that are one, (k,).
        points: inputs, (n, i).
        results: to be filled, (n, o).
        work: scratch, (slots, `LANES`).
    """
    n = points.shape[0]
    for first in range(0, n, LANES):
        count = min(LANES, n - first)
        for k in range(code.shape[0]):
            operation, to, a, b = code[k, 0], code[k, 1], code[k, 2], code[k, 3]
            if operation < INVERSE:
                _arithmetic(operation, work, to, a, b)
            elif operation == INPUT:
                for lane in range(LANES):
                    work[to, lane] = points[first + min(lane, count - 1), a]
            elif operation == OUTPUT:
                for lane in range(count):
                    results[first + lane, to] = work[a, lane]
            elif operation == CONSTANT:
                for lane in range(LANES):
                    work[to, lane] = constants[k]
            elif operation < FIRST_UNARY:
                _roots(operation, work, to, a)
            elif operation < FIRST_BINARY:
                _unary(operation, work, to, a)
            else:
                _binary(operation, work, to, a, b)


@numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _arithmetic(operation: int, work: Array, to: int, a: int, b: int) -> None:
    if operation == MUL:
        for lane in range(LANES):
            work[to, lane] = work[a, lane] * work[b, lane]
    elif operation == ADD:
        for lane in range(LANES):
            work[to, lane] = work[a, lane] + work[b, lane]
    elif operation == SUB:
        for lane in range(LANES):
            work[to, lane] = work[a, lane] - work[b, lane]
    elif operation == DIV:
        for lane in range(LANES):
            work[to, lane] = work[a, lane] / work[b, lane]
    elif operation == NEG:
        for lane in range(LANES):
            work[to, lane] = -work[a, lane]
    elif operation == SQUARE:
        for lane in range(LANES):
            work[to, lane] = work[a, lane] * work[a, lane]
    else:
        for lane in range(LANES):
            work[to, lane] = work[a, lane] + work[a, lane]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _roots(operation: int, work: Array, to: int, a: int) -> None:
    if operation == ROOT:
        for lane in range(LANES):
            work[to, lane] = np.sqrt(work[a, lane])
    else:
        for lane in range(LANES):
            work[to, lane] = 1.0 / work[a, lane]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _unary(operation: int, work: Array, to: int, a: int) -> None:
    for lane in range(LANES):
        x = work[a, lane]
        if operation < EXP:
            work[to, lane] = _turned(operation, x)
        elif operation == EXP:
            work[to, lane] = math.exp(x)
        elif operation == LOG:
            work[to, lane] = np.log(x)
        elif operation == ABSOLUTE:
            work[to, lane] = abs(x)
        elif operation == SIGN:
            work[to, lane] = -1.0 if x < 0.0 else (1.0 if x > 0.0 else x)
        elif operation == NOT:
            work[to, lane] = 1.0 if x == 0.0 else 0.0
        else:
            work[to, lane] = x


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _turned(operation: int, x: float) -> float:
    if operation == SINE:
        return math.sin(x)
    if operation == COSINE:
        return math.cos(x)
    if operation == TANGENT:
        return math.tan(x)
    if operation == ARC_SINE:
        return float(np.arcsin(x))
    if operation == ARC_COSINE:
        return float(np.arccos(x))
    if operation == ARC_TANGENT:
        return math.atan(x)
    return math.tanh(x)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _binary(operation: int, work: Array, to: int, a: int, b: int) -> None:
    for lane in range(LANES):
        x, y = work[a, lane], work[b, lane]
        if operation == ARC_TANGENT_2:
            work[to, lane] = math.atan2(x, y)
        elif operation == POWER:
            work[to, lane] = x**y
        elif operation == LEAST:
            work[to, lane] = y if y < x or x != x else x
        elif operation == LARGEST:
            work[to, lane] = y if y > x or x != x else x
        else:
            work[to, lane] = _told_apart(operation, x, y)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _told_apart(operation: int, x: float, y: float) -> float:
    if operation == IF_ELSE_ZERO:
        return y if x != 0.0 else 0.0
    if operation == LESS:
        found = x < y
    elif operation == LESS_EQUAL:
        found = x <= y
    elif operation == EQUAL:
        found = x == y
    elif operation == UNEQUAL:
        found = x != y
    elif operation == AND:
        found = x != 0.0 and y != 0.0
    else:
        found = x != 0.0 or y != 0.0
    return 1.0 if found else 0.0
