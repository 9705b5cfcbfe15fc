"""A CasADi function of scalars written as LLVM's intermediate language.

Every operation becomes one instruction in CasADi's own order, without any freedom to reassociate or
to fuse: results are the interpreter's, bit by bit. With several lanes each value is a vector, and
one call computes as many instants.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

BINARY = {ca.OP_ADD: "fadd", ca.OP_SUB: "fsub", ca.OP_MUL: "fmul", ca.OP_DIV: "fdiv"}
VECTOR = {ca.OP_SQRT: "sqrt", ca.OP_FABS: "fabs", ca.OP_FLOOR: "floor", ca.OP_CEIL: "ceil"}
LIBRARY = {
    ca.OP_EXP: "exp",
    ca.OP_LOG: "log",
    ca.OP_POW: "pow",
    ca.OP_CONSTPOW: "pow",
    ca.OP_SIN: "sin",
    ca.OP_COS: "cos",
    ca.OP_TAN: "tan",
    ca.OP_ASIN: "asin",
    ca.OP_ACOS: "acos",
    ca.OP_ATAN: "atan",
    ca.OP_ATAN2: "atan2",
    ca.OP_SINH: "sinh",
    ca.OP_COSH: "cosh",
    ca.OP_TANH: "tanh",
    ca.OP_ASINH: "asinh",
    ca.OP_ACOSH: "acosh",
    ca.OP_ATANH: "atanh",
    ca.OP_FMIN: "fmin",
    ca.OP_FMAX: "fmax",
    ca.OP_FMOD: "fmod",
    ca.OP_COPYSIGN: "copysign",
    ca.OP_ERF: "erf",
    ca.OP_LOG1P: "log1p",
    ca.OP_EXPM1: "expm1",
    ca.OP_HYPOT: "hypot",
}
COMPARED = {ca.OP_LT: "olt", ca.OP_LE: "ole", ca.OP_EQ: "oeq", ca.OP_NE: "une"}


def intermediate(function: Any, name: str, lanes: int = 1) -> str:
    """The function as text: void name(double *in, double *out).

    Args:
        function: a casadi Function of SX expressions with dense outputs.
        name: what the machine code is called.
        lanes: how many instants one call computes.

    `in` holds all inputs one after another, columns first, each entry `lanes` times; `out` does
    so for the outputs.

    Raises:
        ValueError: for an operation that is not one of scalars.
    """
    text = Text(lanes)
    starts_in = _starts(function.nnz_in, function.n_in())
    starts_out = _starts(function.nnz_out, function.n_out())
    registers: dict[int, str] = {}
    for k in range(function.n_instructions()):
        operation, taken = function.instruction_id(k), function.instruction_input(k)
        given = function.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            text.store(registers[taken[0]], starts_out[given[0]] + given[1])
        elif operation == ca.OP_INPUT:
            registers[given[0]] = text.load(starts_in[taken[0]] + taken[1])
        elif operation == ca.OP_CONST:
            registers[given[0]] = text.constant(function.instruction_constant(k))
        else:
            values = [registers[place] for place in taken]
            registers[given[0]] = text.operation(operation, values)
    return text.whole(name)


def _starts(size: Callable[[int], int], count: int) -> list[int]:
    return [sum(size(i) for i in range(k)) for k in range(count)]


@dataclass(slots=True)
class Text:
    """Lines of one function body under way."""

    lanes: int
    lines: list[str] = field(default_factory=list)
    declared: set[str] = field(default_factory=set)
    count: int = 0

    @property
    def kind(self) -> str:
        """The type of a value."""
        return self._of("double")

    def whole(self, name: str, arguments: str = "ptr noalias %in, ptr noalias %out") -> str:
        """The module with the lines as the body of one function."""
        head = "\n".join(sorted(self.declared))
        body = "\n".join(self.lines)
        signature = f"define void @{name}({arguments})"
        return f"{head}\n{signature} {{\n{body}\nret void\n}}\n"

    def constant(self, value: float) -> str:
        """A number as it stands in the text."""
        bits = f"0x{np.float64(value).view(np.uint64):016X}"
        return bits if self.lanes == 1 else f"<{', '.join([f'double {bits}'] * self.lanes)}>"

    def load(self, place: int) -> str:
        """An input."""
        return self._new(f"load {self.kind}, ptr {self._at('%in', place)}, align 8")

    def store(self, value: str, place: int) -> None:
        """Write an output."""
        pointer = self._at("%out", place)
        self.lines.append(f"store {self.kind} {value}, ptr {pointer}, align 8")

    def vector_at(self, base: str, place: int | str) -> str:
        """A vector of memory on a line of the cache, counted in vectors."""
        return self._new(f"load {self.kind}, ptr {self._at(base, place)}, align {8 * self.lanes}")

    def put_vector(self, value: str, base: str, place: int | str) -> None:
        """Store one there."""
        pointer = self._at(base, place)
        self.lines.append(f"store {self.kind} {value}, ptr {pointer}, align {8 * self.lanes}")

    def operation(self, operation: int, values: list[str]) -> str:
        """The value of one operation."""
        kind, first = self.kind, values[0]
        if operation in BINARY:
            return self._new(f"{BINARY[operation]} {kind} {first}, {values[1]}")
        if operation == ca.OP_SQ:
            return self._new(f"fmul {kind} {first}, {first}")
        if operation == ca.OP_TWICE:
            return self._new(f"fadd {kind} {first}, {first}")
        if operation == ca.OP_NEG:
            return self._new(f"fneg {kind} {first}")
        if operation == ca.OP_ASSIGN:
            return first
        if operation == ca.OP_INV:
            return self._new(f"fdiv {kind} {self.constant(1.0)}, {first}")
        if operation in VECTOR:
            return self._vector(VECTOR[operation], first)
        if operation in LIBRARY:
            return self._library(LIBRARY[operation], values)
        return self._logical(operation, values)

    def _logical(self, operation: int, values: list[str]) -> str:
        zero, one, first = self.constant(0.0), self.constant(1.0), values[0]
        if operation in COMPARED:
            return self._number(self._compared(COMPARED[operation], first, values[1]))
        if operation == ca.OP_NOT:
            return self._number(self._compared("oeq", first, zero))
        if operation in (ca.OP_AND, ca.OP_OR):
            both = [self._compared("une", value, zero) for value in values]
            word = "and" if operation == ca.OP_AND else "or"
            return self._number(self._new(f"{word} {self._of('i1')} {both[0]}, {both[1]}"))
        if operation == ca.OP_IF_ELSE_ZERO:
            return self._either(self._compared("une", first, zero), values[1], zero)
        if operation == ca.OP_SIGN:
            minus = self.constant(-1.0)
            rest = self._either(self._compared("olt", first, zero), minus, first)
            return self._either(self._compared("ogt", first, zero), one, rest)
        raise ValueError(f"operation {operation} of CasADi is not one of scalars")

    def _compared(self, word: str, left: str, right: str) -> str:
        return self._new(f"fcmp {word} {self.kind} {left}, {right}")

    def _either(self, condition: str, yes: str, no: str) -> str:
        kind = self.kind
        return self._new(f"select {self._of('i1')} {condition}, {kind} {yes}, {kind} {no}")

    def _number(self, condition: str) -> str:
        return self._new(f"uitofp {self._of('i1')} {condition} to {self.kind}")

    def _vector(self, word: str, value: str) -> str:
        """An operation that processors have for vectors too."""
        name = f"llvm.{word}.{'f64' if self.lanes == 1 else f'v{self.lanes}f64'}"
        self.declared.add(f"declare {self.kind} @{name}({self.kind})")
        return self._new(f"call {self.kind} @{name}({self.kind} {value})")

    def _library(self, name: str, values: list[str]) -> str:
        """A function of the C library, lane by lane."""
        self.declared.add(f"declare double @{name}({', '.join(['double'] * len(values))})")
        if self.lanes == 1:
            return self._called(name, values)
        whole = "undef"
        for lane in range(self.lanes):
            parts = [
                self._new(f"extractelement {self.kind} {value}, i32 {lane}") for value in values
            ]
            one = self._called(name, parts)
            whole = self._new(f"insertelement {self.kind} {whole}, double {one}, i32 {lane}")
        return whole

    def _called(self, name: str, values: list[str]) -> str:
        return self._new(f"call double @{name}({', '.join(f'double {v}' for v in values)})")

    def _at(self, base: str, place: int | str) -> str:
        return self._new(f"getelementptr {self.kind}, ptr {base}, i64 {place}")

    def _of(self, kind: str) -> str:
        return kind if self.lanes == 1 else f"<{self.lanes} x {kind}>"

    def _new(self, instruction: str) -> str:
        self.count += 1
        name = f"%v{self.count}"
        self.lines.append(f"{name} = {instruction}")
        return name
