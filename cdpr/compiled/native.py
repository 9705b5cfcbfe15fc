"""CasADi functions compiled for this processor by LLVM, which numba brings along."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from freeswing.cdpr.compiled.emit import intermediate
from freeswing.cdpr.compiled.processor import engine_of

Array = NDArray[np.float64]

# Level 1 compiles 1,800 operations in 0.05 s, and what it makes runs as fast as level 2's.
OPTIMISED = 1


@dataclass(frozen=True, slots=True, eq=False)
class Native:
    """Machine code of a function: void (double *in, double *out).

    Attributes:
        address: where it lies, for `call_at` in kernels.
        n_in: entries of all inputs.
        n_out: entries of all outputs.
        lanes: instants a call.
        engine: keeps the code in memory: whoever keeps an address must keep this too.
    """

    address: int
    n_in: int
    n_out: int
    lanes: int
    engine: Any


@lru_cache(maxsize=64)
def native(function: Any, lanes: int = 1) -> Native:
    """The function as machine code; see `emit.intermediate` for how inputs and outputs lie.

    Args:
        function: a casadi Function of SX expressions with dense outputs.
        lanes: instants a call.

    Raises:
        ValueError: for an operation that is not one of scalars.
    """
    engine = engine_of(intermediate(function, "compiled", lanes), OPTIMISED)
    sizes = (
        sum(function.nnz_in(i) for i in range(function.n_in())),
        sum(function.nnz_out(i) for i in range(function.n_out())),
    )
    return Native(engine.get_function_address("compiled"), *sizes, lanes, engine)


def _call_at(typing_context, address, inputs, outputs):
    """`call_at` in a kernel calls `Native.address` with the addresses of two contiguous arrays."""

    def generate(context, builder, signature, arguments):
        pointer = ir.PointerType(ir.DoubleType())
        kind = ir.PointerType(ir.FunctionType(ir.VoidType(), [pointer, pointer]))
        places = [builder.inttoptr(argument, pointer) for argument in arguments[1:]]
        builder.call(builder.inttoptr(arguments[0], kind), places)
        return context.get_dummy_value()

    whole = types.none(types.intp, types.intp, types.intp)
    return whole, generate


# Type checkers take the typing context for an argument of each call: to them this is any function.
call_at: Any = intrinsic(_call_at)
