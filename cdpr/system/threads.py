"""Independent pieces of numeric work on several processors of one process.

numpy and the tapes of `cdpr.model.batch` let go of Python's interpreter while they compute, so that
threads share the processors. Each piece is computed as in a loop: results are the same bits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from multiprocessing import parent_process
from typing import TypeVar

T = TypeVar("T")

_allowed: ContextVar[int] = ContextVar("threads", default=1)


@contextmanager
def threads(count: int) -> Iterator[None]:
    """Let `side_by_side` use so many threads within the block.

    Worker processes share the processors already: in them there is always one.
    """
    token = _allowed.set(count)
    try:
        yield
    finally:
        _allowed.reset(token)


def side_by_side(call: Callable[..., T], *columns: Iterable[object]) -> list[T]:
    """What `map` would give, pieces computed at once where `threads` allows it.

    All threads have ended when it returns: a process may be forked then.

    Args:
        call: of one element of each column; it may not use what another call changes.
        columns: of the same length.
    """
    rows = list(zip(*columns, strict=True))
    count = min(_allowed.get() if parent_process() is None else 1, len(rows))
    if count < 2:
        return [call(*row) for row in rows]
    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(call, *zip(*rows, strict=True)))
