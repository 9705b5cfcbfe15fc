"""Worker processes that end when the one that started them does, however that was killed."""

from __future__ import annotations

import os
import threading
import time

LOOKS_EVERY_S = 0.5


def tie_to(parent: int) -> None:
    """Watch the parent process from a thread and end this process once it is gone.

    A process that is killed cannot tell its workers; without this they wait for work for ever.

    Args:
        parent: the process id of whoever starts the workers.
    """
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(LOOKS_EVERY_S)
    os._exit(1)
