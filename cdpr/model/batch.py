"""CasADi functions evaluated over leading batch axes, straight from and into numpy memory.

Several points go through the function's tape, all at once (`cdpr.compiled.interpreter`); a single
one, and a function that has no tape, through CasADi's interpreter, to the same bits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial, wraps
from itertools import accumulate
from math import prod
from threading import RLock
from typing import Any, ParamSpec, TypeVar

import casadi as ca
import numpy as np

from freeswing.cdpr.compiled.interpreter import KNOWN, interpreter, lanes_for
from freeswing.cdpr.robot import Array

LARGEST_CHUNK = 1024
CACHE_LINE = 8  # numbers

P = ParamSpec("P")
T = TypeVar("T")

# A function's buffer is one for all threads, and what is built belongs to all of them.
_CASADI = RLock()


def _built_once(most: int) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Keeps up to `most` results; of several threads that ask for one, the first makes it."""

    def decorated(build: Callable[P, T]) -> Callable[P, T]:
        kept = lru_cache(maxsize=most)(build)

        @wraps(build)
        def found(*arguments: P.args, **named: P.kwargs) -> T:
            with _CASADI:
                return kept(*arguments, **named)

        return found

    return decorated


@dataclass(frozen=True, slots=True)
class Tape:
    """A function as a list of instructions.

    Attributes:
        code: (k, 4) and
        constants: (k,), as `cdpr.compiled.interpreter.Interpreter` takes them.
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
        n = len(points)
        # Machine code that a second thread made too would end with it, and run no more.
        with _CASADI:
            fitting = interpreter(lanes_for(n))
        work = _on_a_line(self.slots * fitting.lanes)
        arrays = (self.code, self.constants, points, results, work)
        code, constants, first, into, scratch = (array.ctypes.data for array in arrays)
        call = partial(
            fitting.run,
            *(code, len(self.code), constants, first, n, self.inputs),
            *(into, self.outputs, scratch),
        )

        def run(keep: object = (arrays, fitting)) -> None:
            call()

        return run


def _on_a_line(count: int) -> Array:
    """Memory that begins on a line of the cache, (count,)."""
    more = np.empty(count + CACHE_LINE)
    first = (-more.ctypes.data // more.itemsize) % CACHE_LINE
    return more[first : first + count]


@_built_once(256)
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
        operation = function.instruction_id(k)
        to, sources = function.instruction_output(k), function.instruction_input(k)
        if operation == ca.OP_CONST:
            constants[k] = function.instruction_constant(k)
            code[k] = operation, to[0], 0, 0
        elif operation == ca.OP_INPUT:
            code[k] = operation, to[0], first_in[sources[0]] + sources[1], 0
        elif operation == ca.OP_OUTPUT:
            code[k] = operation, first_out[to[0]] + to[1], sources[0], 0
        elif operation in KNOWN:
            code[k] = operation, to[0], sources[0], sources[-1]
        else:
            return None
    return Tape(code, constants, function.sz_w(), first_in[-1], first_out[-1])


def evaluate(function: Any, *arguments: Any) -> tuple[Array, ...]:
    """Call a function for every element of the broadcast batch.

    Args:
        function: a casadi Function with dense outputs. What its names begin with decides the
            shapes: `scalar` is a number, `matrix` a matrix, all else a column.
        arguments: one array an input, shaped (*batch, rows) or, for a scalar input, (*batch,).

    Returns:
        One array an output: (*batch,), (*batch, rows) or (*batch, rows, cols).

    Raises:
        ValueError: when an argument's last axis does not fit its input.
    """
    arrays = [np.asarray(argument, dtype=np.float64) for argument in arguments]
    tails, sizes, names = _signature(function)
    heads = []
    for i, (array, tail) in enumerate(zip(arrays, tails, strict=True)):
        if tail and array.shape[-1:] != tail:
            raise ValueError(
                f"{function.name()}: input {i} has shape {array.shape}, its last axis must be "
                f"{tail[0]} long"
            )
        heads.append(array.shape[: array.ndim - len(tail)])
    batch = np.broadcast_shapes(*heads)
    tape = tape_of(function) if prod(batch) > 1 else None
    if tape is None:
        flat = [
            np.ascontiguousarray(np.broadcast_to(array, batch + tail)).reshape(prod(batch), *tail)
            for array, tail in zip(arrays, tails, strict=True)
        ]
        results = _interpreted(function, flat, sizes)
    else:
        results = _taped(tape, batch, arrays, tails, sizes)
    return tuple(_shaped(result, name, batch) for result, name in zip(results, names, strict=True))


Sizes = list[tuple[int, int]]


@_built_once(256)
def _signature(function: Any) -> tuple[list[tuple[int, ...]], Sizes, list[str]]:
    """Trailing axes of each input, rows and columns of each output, and the outputs' names."""
    tails = [
        () if name.startswith("scalar") else (function.size1_in(i),)
        for i, name in enumerate(function.name_in())
    ]
    sizes = [function.size_out(i) for i in range(function.n_out())]
    return tails, sizes, function.name_out()


def _taped(
    tape: Tape,
    batch: tuple[int, ...],
    arrays: list[Array],
    tails: list[tuple[int, ...]],
    sizes: Sizes,
) -> list[Array]:
    """Results of a tape, (n, cols, rows) each."""
    points, first = np.empty((*batch, tape.inputs)), 0
    for array, tail in zip(arrays, tails, strict=True):
        if tail:
            points[..., first : first + tail[0]] = array
        else:
            points[..., first] = array
        first += tail[0] if tail else 1
    together = tape.run(points.reshape(prod(batch), tape.inputs))
    return [
        part.reshape(len(part), cols, rows)
        for part, (rows, cols) in zip(_parts(together, sizes), sizes, strict=True)
    ]


def _interpreted(function: Any, flat: list[Array], sizes: Sizes) -> list[Array]:
    """Results of CasADi's interpreter, (n, cols, rows) each."""
    total = len(flat[0])
    results = [np.empty((total, cols, rows)) for rows, cols in sizes]
    done = 0
    while done < total:
        count = min(LARGEST_CHUNK, 1 << ((total - done).bit_length() - 1))
        kept = [np.ascontiguousarray(array[done : done + count]) for array in flat]
        with _CASADI:
            buffer, run = _buffer(function, count)
            for i, array in enumerate(kept):
                if array.size:
                    buffer.set_arg(i, array.reshape(-1).data)
            for i, result in enumerate(results):
                if result.size:
                    buffer.set_res(i, result[done : done + count].reshape(-1).data)
            run()
        done += count
    return results


def _shaped(result: Array, name: str, batch: tuple[int, ...]) -> Array:
    _, cols, rows = result.shape
    if name.startswith("matrix"):
        return np.ascontiguousarray(result.transpose(0, 2, 1)).reshape(*batch, rows, cols)
    whole = np.ascontiguousarray(result)
    return whole.reshape(batch) if name.startswith("scalar") else whole.reshape(*batch, rows)


@lru_cache(maxsize=256)
def _buffer(function: Any, count: int) -> tuple[Any, Any]:
    mapped = function if count == 1 else function.map(count)
    return mapped.buffer()


class Bound:
    """A function of a fixed batch with its memory bound once, for tight loops.

    Attributes:
        inputs: arrays (count, rows) to fill before each run; scalars are (count, 1).
        outputs: arrays (count, rows) or, transposed, (count, cols, rows), valid after a run.
    """

    def __init__(self, function: Any, count: int) -> None:
        sizes_in = [(function.size1_in(i), 1) for i in range(function.n_in())]
        sizes_out = [function.size_out(i) for i in range(function.n_out())]
        tape = tape_of(function) if count > 1 else None
        if tape is not None:
            points, results = np.zeros((count, tape.inputs)), np.zeros((count, tape.outputs))
            self.inputs = _parts(points, sizes_in)
            self.outputs = _parts(results, sizes_out)
            self.run = tape.bound(points, results)
            return
        mapped = function if count == 1 else function.map(count)
        self._buffer, self.run = mapped.buffer()
        self.inputs = [np.zeros((count, rows)) for rows, _ in sizes_in]
        self.outputs = [
            np.zeros((count, rows) if cols == 1 else (count, cols, rows))
            for rows, cols in sizes_out
        ]
        for i, array in enumerate(self.inputs):
            if array.size:
                self._buffer.set_arg(i, array.reshape(-1).data)
        for i, array in enumerate(self.outputs):
            self._buffer.set_res(i, array.reshape(-1).data)


def _parts(together: Array, sizes: Sizes) -> list[Array]:
    """Views of (n, all) as columns (n, rows), or (n, cols, rows) of a matrix, one after another."""
    ends = np.cumsum([rows * cols for rows, cols in sizes])
    parts = np.split(together, ends[:-1], axis=1)
    return [
        part if cols == 1 else part.reshape(len(part), cols, rows)
        for part, (rows, cols) in zip(parts, sizes, strict=True)
    ]


@_built_once(64)
def with_jacobian(function: Any, inputs: tuple[int, ...], output: int = 0) -> Any:
    """One output of a function and its Jacobian by the concatenated `inputs`.

    Args:
        function: a casadi Function of SX expressions with column outputs.
        inputs: which inputs to differentiate by, in order.
        output: which output.
    """
    symbols = [ca.SX.sym(f"x{i}", function.size1_in(i)) for i in range(function.n_in())]
    value = function.call(symbols)[output]
    by = ca.vertcat(*[symbols[i] for i in inputs])
    results = [ca.densify(value), ca.densify(ca.jacobian(value, by))]
    names = [function.name_out()[output], "matrix_jacobian"]
    name = f"{function.name()}_jacobian"
    # A search for common expressions finds 1 % more of them in ten times the time.
    return ca.Function(name, symbols, results, function.name_in(), names)


@_built_once(128)
def moved_columns(
    function: Any, inputs: tuple[int, ...], among: tuple[int, ...] | None = None
) -> tuple[Any, tuple[int, ...]]:
    """The first output's Jacobian by concatenated `inputs`, as far as it depends on them.

    Args:
        function: a casadi Function of SX expressions with column outputs.
        inputs: which inputs to differentiate by, in order.
        among: columns that are asked for, ascending; None: all.

    Returns:
        A function that gives the columns that are not structurally zero, and which these are.
    """
    symbols = [ca.SX.sym(f"x{i}", function.size1_in(i)) for i in range(function.n_in())]
    by = ca.vertcat(*[symbols[i] for i in inputs])
    asked = list(range(by.numel()) if among is None else among)
    jacobian = ca.jacobian(function.call(symbols)[0], by[asked])
    moved = [k for k in range(jacobian.size2()) if jacobian[:, k].nnz()]
    results = [ca.densify(jacobian[:, moved])]
    name = f"{function.name()}_moved"
    made = ca.Function(name, symbols, results, function.name_in(), ["matrix_jacobian"])
    return made, tuple(asked[k] for k in moved)


@_built_once(16)
def jacobian_by_others(function: Any, still: tuple[float, ...], among: tuple[int, ...]) -> Any:
    """Jacobian of a function by all inputs but time, its last values standing still.

    What effects that do nothing there would cost falls away.

    Args:
        function: a casadi Function of SX expressions, of time, columns and, last, values.
        still: the last values' numbers.
        among: columns that are asked for, of all inputs but time one after another, ascending;
            those of the values that stand still are passed over.

    Returns:
        A function of the same inputs without these values: of its first output, (m, p).
    """
    symbols = [ca.SX.sym(f"x{i}", function.size1_in(i)) for i in range(function.n_in())]
    known = ca.SX.sym("known", symbols[-1].numel() - len(still))
    there = function.call([*symbols[:-1], ca.vertcat(known, ca.DM(still))])[0]
    others = ca.vertcat(*symbols[1:-1], known)
    slopes = ca.densify(ca.jacobian(there, others[[k for k in among if k < others.numel()]]))
    inputs, name = [*symbols[:-1], known], f"{function.name()}_by_others"
    return ca.Function(name, inputs, [slopes], function.name_in(), ["matrix_jacobian"])


@_built_once(16)
def jacobian_about(function: Any, still: tuple[float, ...], among: tuple[int, ...]) -> Any:
    """Jacobian of a function by its last values about where they stand still.

    Their expressions fall away there: a screen needs the slopes of effects that do nothing alone.

    Args:
        function: a casadi Function of SX expressions, of time, columns and, last, values.
        still: the last values' numbers.
        among: which of these are asked for, ascending; numbers below zero are passed over.

    Returns:
        A function of the same inputs without these values: of its first output, (m, q).
    """
    symbols = [ca.SX.sym(f"x{i}", function.size1_in(i)) for i in range(function.n_in())]
    first = symbols[-1].numel() - len(still)
    moving, fixed = symbols[-1][:first], symbols[-1][first:]
    # A symbol of its own: slices of one cannot be inputs.
    known = ca.SX.sym("known", first)
    slopes = ca.jacobian(function.call(symbols)[0], fixed[[k for k in among if k >= 0]])
    there = ca.vertcat(known, ca.DM(still))
    slopes = ca.densify(ca.substitute(slopes, ca.vertcat(moving, fixed), there))
    inputs, name = [*symbols[:-1], known], f"{function.name()}_by_still"
    return ca.Function(name, inputs, [slopes], function.name_in(), ["matrix_jacobian"])


@_built_once(256)
def only(function: Any, *outputs: int) -> Any:
    """The function with some of its outputs alone: what the others need is not computed."""
    names = [function.name_out()[output] for output in outputs]
    parts = "_".join(str(output) for output in outputs)
    return function.factory(f"{function.name()}_only_{parts}", function.name_in(), names)
