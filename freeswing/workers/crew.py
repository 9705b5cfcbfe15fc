"""Who does the work that can be handed out: processes of this machine, or a cluster."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass

from freeswing.session.session_file import Session


@dataclass(frozen=True, slots=True)
class Crew:
    """They do not change a result, only how soon it is there.

    Attributes:
        processes: on this machine, 0 for one a core.
        executor: takes the work instead, such as a cluster's.
    """

    processes: int = 0
    executor: Executor | None = None


@contextmanager
def crew_for(session: Session, processes: int, cluster: str | None) -> Iterator[Crew]:
    """The crew that the flags `--workers` and `--cluster` name; see `cluster.connected`."""
    if cluster is None:
        yield Crew(processes)
        return
    from freeswing.workers.cluster import connected

    session.results.mkdir(parents=True, exist_ok=True)
    with connected(cluster, session.folder.resolve(), session.results.resolve()) as executor:
        yield Crew(processes, executor)
