"""Items made ahead by a thread: their order, what goes wrong, and that the thread ends."""

from __future__ import annotations

import threading
import time

import pytest

from freeswing.calib.footage.ahead import ahead


def waiting() -> int:
    return sum(thread.name == "ahead" for thread in threading.enumerate())


def test_all_items_in_their_order() -> None:
    assert list(ahead(range(1000))) == list(range(1000))
    assert waiting() == 0


def test_an_error_is_raised_in_its_place() -> None:
    def items():
        yield from (1, 2, 3)
        raise OSError("the file ends here")

    seen = []
    with pytest.raises(OSError, match="ends here"):
        seen.extend(ahead(items()))
    assert waiting() == 0
    found = ahead(items())
    assert [next(found) for _ in range(3)] == [1, 2, 3]
    with pytest.raises(OSError, match="ends here"):
        next(found)


def test_no_more_than_asked_for_are_made_ahead_and_an_unused_rest_is_closed() -> None:
    made, closed = [], []

    def items():
        try:
            for k in range(100):
                made.append(k)
                yield k
        finally:
            closed.append(True)

    found = ahead(items(), depth=3)
    assert next(found) == 0
    time.sleep(0.2)
    assert 2 <= len(made) <= 5, f"{len(made)} made for one asked"
    found.close()
    assert closed == [True]
    assert waiting() == 0
