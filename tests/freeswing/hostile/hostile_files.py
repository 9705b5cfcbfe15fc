"""What fuzzing does to a file: bytes and numbers replaced, cut out, doubled, the end cut off."""

from __future__ import annotations

import random
import re

from hypothesis import strategies as st

HOSTILE = (
    b"nan",
    b"-inf",
    b"1e999",
    b"-1",
    b"0",
    b"1e-300",
    b"9" * 400,
    b"''",
    b"[]",
    b"{}",
    b"[[[[",
    b"null",
    b"true",
    b"2024-01-01",
    b"\x00",
    b"\xff\xfe",
    b"\n",
    b"../../x",
    b"a" * 3000,
)
NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")


def vandalised(whole: bytes, chance: random.Random) -> bytes:
    """`whole` after one to three acts of vandalism."""
    data = whole
    for _ in range(chance.randint(1, 3)):
        start = chance.randrange(len(data) + 1)
        end = start + chance.randint(1, 40)
        act = chance.choice(("number", "bytes", "bit", "out", "twice", "end"))
        if act == "number" and (found := list(NUMBER.finditer(data))):
            start, end = chance.choice(found).span()
            data = data[:start] + chance.choice(HOSTILE) + data[end:]
        elif act == "bytes":
            data = data[:start] + chance.randbytes(chance.randint(1, 8)) + data[end:]
        elif act == "bit" and data:
            place = min(start, len(data) - 1)
            flipped = bytes([data[place] ^ 1 << chance.randrange(8)])
            data = data[:place] + flipped + data[place + 1 :]
        elif act == "out":
            data = data[:start] + data[end:]
        elif act == "twice":
            data = data[:end] + data[start:]
        else:
            data = data[:start]
    return data


@st.composite
def broken(draw: st.DrawFn, whole: bytes) -> bytes:
    """The same by Hypothesis, which makes what fails small."""
    return vandalised(whole, draw(st.randoms(use_true_random=False)))
