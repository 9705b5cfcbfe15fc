"""What fuzzing does to a file: bytes and numbers replaced, cut out, doubled, the end cut off."""

from __future__ import annotations

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
_SHARE = st.floats(0.0, 1.0, exclude_max=True)


@st.composite
def broken(draw: st.DrawFn, whole: bytes) -> bytes:
    """`whole` after one to three acts of vandalism."""
    data = whole
    for _ in range(draw(st.integers(1, 3))):
        act = draw(st.sampled_from(("number", "bytes", "out", "twice", "end")))
        start = int(draw(_SHARE) * len(data))
        end = start + draw(st.integers(1, 40))
        if act == "number":
            found = list(NUMBER.finditer(data)) or [re.compile(b"").search(data)]
            one = found[int(draw(_SHARE) * len(found))]
            start, end = one.span() if one is not None else (0, 0)
            data = data[:start] + draw(st.sampled_from(HOSTILE)) + data[end:]
        elif act == "bytes":
            data = data[:start] + draw(st.binary(min_size=1, max_size=8)) + data[end:]
        elif act == "out":
            data = data[:start] + data[end:]
        elif act == "twice":
            data = data[:end] + data[start:]
        else:
            data = data[:start]
    return data
