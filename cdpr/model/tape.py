"""CasADi functions as tapes that run over blocks of points (see `cdpr.model.tape_kernels`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import accumulate
from typing import Any

import casadi as ca
import numpy as np

from freeswing.cdpr.model import tape_kernels as kernels
from freeswing.cdpr.robot import Array

OPERATIONS = {
    ca.OP_MUL: kernels.MUL,
    ca.OP_ADD: kernels.ADD,
    ca.OP_SUB: kernels.SUB,
    ca.OP_DIV: kernels.DIV,
    ca.OP_NEG: kernels.NEG,
    ca.OP_SQ: kernels.SQUARE,
    ca.OP_TWICE: kernels.TWICE,
    ca.OP_INV: kernels.INVERSE,
    ca.OP_CONST: kernels.CONSTANT,
    ca.OP_INPUT: kernels.INPUT,
    ca.OP_OUTPUT: kernels.OUTPUT,
    ca.OP_SQRT: kernels.ROOT,
    ca.OP_SIN: kernels.SINE,
    ca.OP_COS: kernels.COSINE,
    ca.OP_TAN: kernels.TANGENT,
    ca.OP_ASIN: kernels.ARC_SINE,
    ca.OP_ACOS: kernels.ARC_COSINE,
    ca.OP_ATAN: kernels.ARC_TANGENT,
    ca.OP_TANH: kernels.TANH,
    ca.OP_EXP: kernels.EXP,
    ca.OP_LOG: kernels.LOG,
    ca.OP_FABS: kernels.ABSOLUTE,
    ca.OP_SIGN: kernels.SIGN,
    ca.OP_ASSIGN: kernels.COPY,
    ca.OP_NOT: kernels.NOT,
    ca.OP_ATAN2: kernels.ARC_TANGENT_2,
    ca.OP_POW: kernels.POWER,
    ca.OP_CONSTPOW: kernels.POWER,
    ca.OP_FMIN: kernels.LEAST,
    ca.OP_FMAX: kernels.LARGEST,
    ca.OP_LT: kernels.LESS,
    ca.OP_LE: kernels.LESS_EQUAL,
    ca.OP_EQ: kernels.EQUAL,
    ca.OP_NE: kernels.UNEQUAL,
    ca.OP_AND: kernels.AND,
    ca.OP_OR: kernels.OR,
    ca.OP_IF_ELSE_ZERO: kernels.IF_ELSE_ZERO,
}


@dataclass(frozen=True, slots=True)
class Tape:
    """A function as a list of instructions.

    Attributes:
        code: (k, 4) and
        constants: (k,), as `tape_kernels.run_tape` takes them.
        slots: of scratch memory.
        inputs: numbers a point.
        outputs: numbers a result; matrices by columns.
    """

    code: Array
    constants: Array
    slots: int
    inputs: int
    outputs: int

    def run(self, points: Array) -> Array:
        """Results (n, outputs) at C-contiguous points (n, inputs)."""
        results = np.empty((len(points), self.outputs))
        self.bound(points, results)()
        return results

    def bound(self, points: Array, results: Array) -> Callable[[], None]:
        """What runs the tape over the same memory each time, for tight loops."""
        work = np.empty((self.slots, kernels.LANES))
        return partial(kernels.run_tape, self.code, self.constants, points, results, work)


@lru_cache(maxsize=256)
def tape_of(function: Any) -> Tape | None:
    """A function's tape; None where it does something that tapes do not know.

    Args:
        function: a casadi Function with dense inputs and outputs.
    """
    if not function.is_a("SXFunction"):
        return None
    sizes_in = [function.numel_in(i) for i in range(function.n_in())]
    sizes_out = [function.numel_out(i) for i in range(function.n_out())]
    first_in, first_out = (list(accumulate(sizes, initial=0)) for sizes in (sizes_in, sizes_out))
    count = function.n_instructions()
    code, constants = np.zeros((count, 4), dtype=np.uint32), np.zeros(count)
    for k in range(count):
        operation = OPERATIONS.get(function.instruction_id(k))
        if operation is None:
            return None
        to, sources = function.instruction_output(k), function.instruction_input(k)
        if operation == kernels.CONSTANT:
            constants[k] = function.instruction_constant(k)
            code[k] = operation, to[0], 0, 0
        elif operation == kernels.INPUT:
            code[k] = operation, to[0], first_in[sources[0]] + sources[1], 0
        elif operation == kernels.OUTPUT:
            code[k] = operation, first_out[to[0]] + to[1], sources[0], 0
        else:
            code[k] = operation, to[0], sources[0], sources[-1]
    return Tape(code, constants, function.sz_w(), first_in[-1], first_out[-1])
