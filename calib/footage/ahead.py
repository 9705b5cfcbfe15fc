"""Items made in a thread of their own, a few before they are asked for."""

from __future__ import annotations

from collections.abc import Generator, Iterable
from queue import Empty, Full, Queue
from threading import Event, Thread
from typing import TypeVar

Item = TypeVar("Item")

_DEPTH = 4  # frames: one that is slow to decode then keeps nobody waiting
_POLL_S = 0.1


class _End:
    """After the last item, with what went wrong."""

    __slots__ = ("error",)

    def __init__(self, error: BaseException | None) -> None:
        self.error = error


def ahead(items: Iterable[Item], depth: int = _DEPTH) -> Generator[Item]:
    """The same items in their order, made up to `depth` of them before they are asked for.

    A decoder and a tracker, which both let go of the interpreter while they work, then take two
    cores. What goes wrong in the making is raised here, in its place; the thread ends with this
    iterator.
    """
    made: Queue[Item | _End] = Queue(depth)
    stop = Event()

    def put(item: Item | _End) -> bool:
        while not stop.is_set():
            try:
                made.put(item, timeout=_POLL_S)
            except Full:
                continue
            return True
        return False

    def work() -> None:
        error: BaseException | None = None
        try:
            for item in items:
                if not put(item):
                    break
        except BaseException as raised:  # noqa: BLE001, raised again where the items are used
            error = raised
        finally:
            close = getattr(items, "close", None)
            if close is not None:
                close()
        put(_End(error))

    worker = Thread(target=work, name="ahead", daemon=True)
    worker.start()
    try:
        while not isinstance(item := made.get(), _End):
            yield item
        if item.error is not None:
            raise item.error
    finally:
        stop.set()
        while worker.is_alive():
            try:
                made.get_nowait()
            except Empty:
                worker.join(_POLL_S)
