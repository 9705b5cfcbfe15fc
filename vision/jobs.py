"""Independent jobs over processes, with their progress."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from typing import Any

from freeswing.cdpr.system.lifeline import tie_to
from freeswing.cdpr.system.progress import Progress

_POLL_S = 0.5


@dataclass(frozen=True, slots=True)
class Job:
    """A call to be made in some process."""

    label: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]


def run_jobs(
    jobs: Sequence[Job],
    workers: int,
    progress: Progress | None,
    executor: Executor | None = None,
) -> list[Any]:
    """Results of all jobs in their order; the first failure ends the rest and is raised.

    Args:
        jobs: in the order of the results.
        workers: processes; 0 = one a core. With one (or one job) everything happens in this one.
        progress: told a job's label and the fraction done.
        executor: makes the calls instead of processes of this machine; left open.
    """
    if executor is not None:
        return _all_of(executor, jobs, progress)
    count = min(workers or os.cpu_count() or 1, len(jobs))
    if count <= 1:
        return _one_by_one(jobs, progress)
    context = multiprocessing.get_context("spawn")
    tied = {"initializer": tie_to, "initargs": (os.getpid(),)}
    with ProcessPoolExecutor(count, mp_context=context, **tied) as pool:
        try:
            return _all_of(pool, jobs, progress)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _all_of(pool: Executor, jobs: Sequence[Job], progress: Progress | None) -> list[Any]:
    futures: dict[Future[Any], Job] = {}
    for job in jobs:
        futures[pool.submit(job.function, *job.arguments)] = job
    open_jobs = set(futures)
    try:
        while open_jobs:
            done, open_jobs = wait(open_jobs, _POLL_S, return_when=FIRST_COMPLETED)
            for future in done:
                future.result()
                if progress is not None:
                    progress(futures[future].label, 1.0 - len(open_jobs) / len(jobs))
    except BaseException:
        for future in open_jobs:
            future.cancel()
        raise
    return [future.result() for future in futures]


def _one_by_one(jobs: Sequence[Job], progress: Progress | None) -> list[Any]:
    found = []
    for index, job in enumerate(jobs):
        if progress is not None:
            progress(job.label, index / len(jobs))
        found.append(job.function(*job.arguments))
    if progress is not None and jobs:
        progress(jobs[-1].label, 1.0)
    return found
