"""An interpreter of CasADi's instructions that takes each over many points at once.

A numba or CasADi interpreter spends most of its time on what surrounds an operation: 0.8 and 8 ns
each and point. Here an instruction loads its vectors, computes and stores them, with nothing in
between: 0.5 ns by 16 points, 0.2 by 64, the same bits. Compiled once, in milliseconds, for all
functions.
"""

from __future__ import annotations

from ctypes import CFUNCTYPE, c_int64, c_void_p
from dataclasses import dataclass
from functools import cache
from typing import Any

import casadi as ca

from freeswing.cdpr.compiled.emit import BINARY, COMPARED, LIBRARY, VECTOR, Text
from freeswing.cdpr.compiled.processor import engine_of

WIDTH = 8  # numbers of the longest vectors that processors have
OPTIMISED = 2
# Blocks of points: a simulated segment has 12, a motion hundreds. Longer ones share more, and leave
# the near cache.
SIZES = (16, 64)
PLAIN = frozenset({*BINARY, ca.OP_SQ, ca.OP_TWICE, ca.OP_NEG, ca.OP_INV, ca.OP_ASSIGN})
LOGICAL = frozenset({*COMPARED, ca.OP_NOT, ca.OP_AND, ca.OP_OR, ca.OP_IF_ELSE_ZERO, ca.OP_SIGN})
KNOWN = PLAIN | LOGICAL | {*VECTOR, *LIBRARY}
_TWO = (ca.OP_POW, ca.OP_CONSTPOW, ca.OP_ATAN2, ca.OP_FMIN, ca.OP_FMAX, ca.OP_FMOD)
TWO = frozenset({*BINARY, *COMPARED, *_TWO, ca.OP_COPYSIGN, ca.OP_HYPOT}) | {
    ca.OP_AND,
    ca.OP_OR,
    ca.OP_IF_ELSE_ZERO,
}


@dataclass(frozen=True, slots=True, eq=False)
class Interpreter:
    """Machine code of the interpreter.

    Attributes:
        run: (code, instructions, constants, points, n, inputs, results, outputs, work): addresses
            of C-contiguous arrays: instructions (k, 4) of 32 bits: operation, target slot, two
            source slots (of an input its place among a point's numbers, of an output its place
            among the results'), constants (k,), points (n, inputs), results (n, outputs), and
            scratch (slots, lanes) on a line of the cache.
        lanes: points of a block.
        engine: keeps the code in memory.
    """

    run: Any
    lanes: int
    engine: Any


def lanes_for(points: int) -> int:
    """Length of the blocks that take a number of points soonest."""
    return min(SIZES, key=lambda lanes: -(-points // lanes) * (lanes + SIZES[0]))


@cache
def interpreter(lanes: int) -> Interpreter:
    """The interpreter with blocks of `lanes` points, a multiple of `WIDTH`."""
    engine = engine_of(_text(lanes), OPTIMISED)
    kinds = (c_void_p, c_int64, c_void_p, c_void_p, c_int64, c_int64, c_void_p, c_int64, c_void_p)
    return Interpreter(CFUNCTYPE(None, *kinds)(engine.get_function_address("run")), lanes, engine)


def _text(lanes: int) -> str:
    """The module: a loop over blocks, in it one over instructions, in it one block of code each."""
    text = Text(WIDTH)
    cases = [*sorted(KNOWN), ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT]
    jumps = " ".join(f"i32 {one}, label %case{one}" for one in cases)
    text.lines += [HEAD, *(_slot(name, place, lanes) for name, place in SLOTS)]
    text.lines.append(f"switch i32 %operation, label %next [ {jumps} ]")
    for operation in sorted(KNOWN):
        (_case if operation in PLAIN else _rare_case)(text, operation, lanes)
    _constant_case(text, lanes)
    text.lines += [part.replace("LANES", str(lanes)) for part in (INPUT_CASE, OUTPUT_CASE, TAIL)]
    return text.whole("run", ARGUMENTS)


ARGUMENTS = (
    "ptr noalias readonly %code, i64 %count, ptr noalias readonly %constants, "
    "ptr noalias readonly %points, i64 %n, i64 %inputs, ptr noalias %results, i64 %outputs, "
    "ptr noalias %work"
)
SLOTS = (("to", 1), ("a", 2), ("b", 3))
HEAD = """entry:
%some = icmp sgt i64 %n, 0
br i1 %some, label %block, label %done
block:
%first = phi i64 [0, %entry], [%following, %blockend]
%left = sub i64 %n, %first
%last = sub i64 %left, 1
br label %fetch
fetch:
%k = phi i64 [0, %block], [%after, %next]
%here = getelementptr [4 x i32], ptr %code, i64 %k
%operation = load i32, ptr %here, align 4"""
INPUT_CASE = f"""case{ca.OP_INPUT}:
br label %in
in:
%lane = phi i64 [0, %case{ca.OP_INPUT}], [%inext, %in]
%over = icmp sgt i64 %lane, %last
%used = select i1 %over, i64 %last, i64 %lane
%irow = add i64 %first, %used
%istart = mul i64 %irow, %inputs
%iplace = add i64 %istart, %a
%ifrom = getelementptr double, ptr %points, i64 %iplace
%number = load double, ptr %ifrom, align 8
%ito = getelementptr double, ptr %atto, i64 %lane
store double %number, ptr %ito, align 8
%inext = add i64 %lane, 1
%imore = icmp slt i64 %inext, LANES
br i1 %imore, label %in, label %next"""
OUTPUT_CASE = f"""case{ca.OP_OUTPUT}:
br label %out
out:
%olane = phi i64 [0, %case{ca.OP_OUTPUT}], [%onext, %out]
%orow = add i64 %first, %olane
%ostart = mul i64 %orow, %outputs
%oplace = add i64 %ostart, %to
%oto = getelementptr double, ptr %results, i64 %oplace
%ofrom = getelementptr double, ptr %ata, i64 %olane
%result = load double, ptr %ofrom, align 8
store double %result, ptr %oto, align 8
%onext = add i64 %olane, 1
%owithin = icmp slt i64 %onext, LANES
%oknown = icmp slt i64 %onext, %left
%omore = and i1 %owithin, %oknown
br i1 %omore, label %out, label %next"""
TAIL = """next:
%after = add i64 %k, 1
%more = icmp slt i64 %after, %count
br i1 %more, label %fetch, label %blockend
blockend:
%following = add i64 %first, LANES
%again = icmp slt i64 %following, %n
br i1 %again, label %block, label %done
done:"""


def _slot(name: str, place: int, lanes: int) -> str:
    """Where one of an instruction's slots lies in the scratch memory."""
    return f"""%place{name} = getelementptr i32, ptr %here, i64 {place}
%short{name} = load i32, ptr %place{name}, align 4
%{name} = zext i32 %short{name} to i64
%off{name} = mul i64 %{name}, {8 * lanes}
%at{name} = getelementptr i8, ptr %work, i64 %off{name}"""


def _case(text: Text, operation: int, lanes: int) -> None:
    """One operation over a block; all vectors are loaded before one is stored."""
    text.lines.append(f"case{operation}:")
    sources = ("%ata", "%atb") if operation in TWO else ("%ata",)
    parts = range(lanes // WIDTH)
    vectors = [[text.vector_at(source, part) for source in sources] for part in parts]
    for part, values in zip(parts, vectors, strict=True):
        text.put_vector(text.operation(operation, values), "%atto", part)
    text.lines.append("br label %next")


def _rare_case(text: Text, operation: int, lanes: int) -> None:
    """The same in a loop over vectors: what calls a library compiles slowly, and runs so anyway."""
    place = f"%part{operation}"
    text.lines += [
        f"case{operation}:",
        f"br label %rare{operation}",
        f"rare{operation}:",
        f"{place} = phi i64 [0, %case{operation}], [{place}next, %rare{operation}]",
    ]
    sources = ("%ata", "%atb") if operation in TWO else ("%ata",)
    values = [text.vector_at(source, place) for source in sources]
    text.put_vector(text.operation(operation, values), "%atto", place)
    text.lines += [
        f"{place}next = add i64 {place}, 1",
        f"{place}more = icmp slt i64 {place}next, {lanes // WIDTH}",
        f"br i1 {place}more, label %rare{operation}, label %next",
    ]


def _constant_case(text: Text, lanes: int) -> None:
    text.lines += [
        f"case{ca.OP_CONST}:",
        "%cfrom = getelementptr double, ptr %constants, i64 %k",
        "%constant = load double, ptr %cfrom, align 8",
        f"%single = insertelement {text.kind} undef, double %constant, i32 0",
        f"%same = shufflevector {text.kind} %single, {text.kind} undef, "
        f"<{WIDTH} x i32> zeroinitializer",
    ]
    for part in range(lanes // WIDTH):
        text.put_vector("%same", "%atto", part)
    text.lines.append("br label %next")
