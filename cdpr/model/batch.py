"""CasADi functions evaluated over leading batch axes, straight from and into numpy memory.

Several points go through the function's tape, all at once (`cdpr.model.tape`); a single one, and a
function that has no tape, through CasADi's interpreter, to the same bits.
"""

from __future__ import annotations

from functools import lru_cache
from math import prod
from typing import Any

import casadi as ca
import numpy as np

from freeswing.cdpr.model.tape import Tape, tape_of
from freeswing.cdpr.robot import Array

LARGEST_CHUNK = 1024


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
    tails = [
        () if name.startswith("scalar") else (function.size1_in(i),)
        for i, name in enumerate(function.name_in())
    ]
    heads = []
    for i, (array, tail) in enumerate(zip(arrays, tails, strict=True)):
        if tail and array.shape[-1:] != tail:
            raise ValueError(
                f"{function.name()}: input {i} has shape {array.shape}, its last axis must be "
                f"{tail[0]} long"
            )
        heads.append(array.shape[: array.ndim - len(tail)])
    batch = np.broadcast_shapes(*heads)
    flat = [
        np.ascontiguousarray(np.broadcast_to(array, batch + tail)).reshape(prod(batch), *tail)
        for array, tail in zip(arrays, tails, strict=True)
    ]
    sizes = [function.size_out(i) for i in range(function.n_out())]
    tape = tape_of(function) if prod(batch) > 1 else None
    results = _interpreted(function, flat, sizes) if tape is None else _taped(tape, flat, sizes)
    return tuple(
        _shaped(result, name, batch)
        for result, name in zip(results, function.name_out(), strict=True)
    )


Sizes = list[tuple[int, int]]


def _taped(tape: Tape, flat: list[Array], sizes: Sizes) -> list[Array]:
    """Results of a tape, (n, cols, rows) each."""
    total = len(flat[0])
    together = tape.run(np.concatenate([array.reshape(total, -1) for array in flat], axis=1))
    return [
        np.ascontiguousarray(part).reshape(total, cols, rows)
        for part, (rows, cols) in zip(_parts(together, sizes), sizes, strict=True)
    ]


def _interpreted(function: Any, flat: list[Array], sizes: Sizes) -> list[Array]:
    """Results of CasADi's interpreter, (n, cols, rows) each."""
    total = len(flat[0])
    results = [np.empty((total, cols, rows)) for rows, cols in sizes]
    done = 0
    while done < total:
        count = min(LARGEST_CHUNK, 1 << ((total - done).bit_length() - 1))
        buffer, run = _buffer(function, count)
        kept = [np.ascontiguousarray(array[done : done + count]) for array in flat]
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
    if name.startswith("scalar"):
        return result.reshape(batch)
    if name.startswith("matrix"):
        return np.ascontiguousarray(result.transpose(0, 2, 1)).reshape(*batch, rows, cols)
    return result.reshape(*batch, rows)


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


@lru_cache(maxsize=64)
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
    options = {"cse": True}
    name = f"{function.name()}_jacobian"
    return ca.Function(name, symbols, results, function.name_in(), names, options)


@lru_cache(maxsize=256)
def only(function: Any, *outputs: int) -> Any:
    """The function with some of its outputs alone: what the others need is not computed."""
    names = [function.name_out()[output] for output in outputs]
    parts = "_".join(str(output) for output in outputs)
    return function.factory(f"{function.name()}_only_{parts}", function.name_in(), names)
