"""A Dask cluster that takes the work which `track` and `diagnose` can hand out.

The workers run the same functions on the same numbers: the results are those of this machine.
They need this version of freeswing, and the session's folder under the same name.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, cast

from freeswing import __version__
from freeswing.cdpr.files.documents import DataError, InputError

if TYPE_CHECKING:
    from distributed import Client

Answer = tuple[str, str]

ANSWER_WITHIN_S = 5


@contextmanager
def connected(address: str, reads: Path, writes: Path) -> Iterator[Executor]:
    """The cluster whose scheduler is at `address`, for as long as the block lasts.

    Args:
        address: such as `tcp://10.0.0.5:8786`, as `dask scheduler` prints it.
        reads: folder that all workers have to see, absolute.
        writes: folder that they have to write to, absolute.

    Raises:
        InputError: without the extra `cluster`, where no scheduler answers or it has no workers,
            where a worker runs another version or does not see them.
        DataError: where the workers are lost in the middle.
    """
    client = _client(address)
    from distributed.scheduler import KilledWorker

    try:
        _refuse_strangers(client, address, reads, writes)
        yield client.get_executor(pure=False)
    except (KilledWorker, CancelledError) as lost:
        raise DataError(
            f"--cluster {address}: its workers were lost in the middle ({type(lost).__name__}); "
            "see their logs, most often memory runs out. What was done is kept: start again"
        ) from lost
    finally:
        client.close()


def _client(address: str) -> Client:
    try:
        from distributed import Client
    except ImportError as absent:
        raise InputError(
            f"--cluster {address}: Dask is not installed here: pip install 'freeswing[cluster]'"
        ) from absent
    logger = logging.getLogger("distributed")
    level = logger.level
    logger.setLevel(logging.CRITICAL)  # its retries are said below, in one sentence
    try:
        return Client(address, timeout=ANSWER_WITHIN_S, set_as_default=False)
    except (OSError, ValueError, TypeError) as silent:
        raise InputError(
            f"--cluster {address}: no Dask scheduler answers there within {ANSWER_WITHIN_S} s; "
            "start one with `dask scheduler` and give the tcp:// address that it prints"
        ) from silent
    finally:
        logger.setLevel(level)


def _refuse_strangers(client: Client, address: str, reads: Path, writes: Path) -> None:
    """Before anything is handed out: who is there, of which version, and what they see."""
    workers = client.scheduler_info(n_workers=-1)["workers"]
    if not workers:
        raise InputError(
            f"--cluster {address}: the scheduler has no workers; start some with "
            f"`dask worker {address} --nthreads 1`"
        )
    try:
        answers = cast("dict[str, Answer]", client.run(look_around, str(reads), str(writes)))
    except ImportError as absent:
        raise InputError(
            f"--cluster {address}: a worker lacks freeswing ({absent}); install version "
            f"{__version__} where the workers run"
        ) from absent
    for worker, (version, unusable) in answers.items():
        if version != __version__:
            raise InputError(
                f"--cluster {address}: worker {worker} runs freeswing {version}, here it is "
                f"{__version__}; install the same version on both"
            )
        if unusable:
            raise InputError(
                f"--cluster {address}: worker {worker} cannot {unusable}; the session has to lie "
                "in a folder that all workers share under the same name"
            )


def look_around(reads: str, writes: str) -> Answer:
    """On a worker: its version, and what it cannot do, empty where it can do all."""
    if not os.access(reads, os.R_OK | os.X_OK):
        return __version__, f"read {reads}"
    if not os.access(writes, os.W_OK | os.X_OK):
        return __version__, f"write to {writes}"
    return __version__, ""
