"""Whether the held-out runs are really held out."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from freeswing.doctor.finding import Finding
from freeswing.ident.runs import SwingRun
from freeswing.session.provenance import hashes
from freeswing.session.repeated_runs import SHARED
from freeswing.session.session_file import Run, Session

# One run left out leaves two, which still disagree with each other where something is wrong.
FEWEST_IDENTIFY = 3


def split_findings(
    session: Session, swings: Sequence[SwingRun], left_out: bool = False
) -> Iterator[Finding]:
    """Roles that are missing, recordings that stand twice, copies under another name.

    Args:
        session: whose runs.
        swings: those that could be read.
        left_out: whether each run is left out in turn where none is held out, as on benches.
    """
    roles = [run.role for run in session.runs]
    if "identify" not in roles:
        yield Finding("error", "runs", "none has the role identify", "give at least one")
    elif roles.count("identify") < FEWEST_IDENTIFY:
        text = f"{roles.count('identify')} identify runs"
        yield Finding("warning", "runs", text, f"{FEWEST_IDENTIFY} or more, from different places")
    if "validate" not in roles and not left_out:
        text = "none has the role validate: nothing can be checked on held-out data"
        yield Finding("warning", "runs", text, "keep a third of the runs for it")
    yield from _same_recording(session)
    yield from _same_samples(swings)


def _same_recording(session: Session) -> Iterator[Finding]:
    """Runs that read the same file, or files with the same bytes."""
    by_content: dict[tuple[str, ...], list[Run]] = defaultdict(list)
    for run in session.runs:
        content = tuple(hashes(session, [run.trajectory or run.video or Path()]).values())
        if content:
            by_content[content].append(run)
    for same in by_content.values():
        for i, first in enumerate(same):
            for second in same[i + 1 :]:
                yield from _overlap(first, second)


def _overlap(first: Run, second: Run) -> Iterator[Finding]:
    """Two runs of one recording: half of the shorter one in both is what identify refuses."""
    windows = [run.window_s or (-np.inf, np.inf) for run in (first, second)]
    start, end = max(one[0] for one in windows), min(one[1] for one in windows)
    if not start < end:
        return
    shortest = min(one[1] - one[0] for one in windows)
    repeats = np.isinf(shortest) or end - start >= SHARED * shortest
    leaks = first.role != second.role
    text = f"runs {first.name} and {second.name} are the same recording"
    text += ", one to identify, one to validate" if leaks else ""
    remedy = "the held-out check would be worthless" if leaks else "it counts twice: keep one"
    yield Finding("error" if leaks or repeats else "warning", "runs", text, remedy)


def _same_samples(swings: Sequence[SwingRun]) -> Iterator[Finding]:
    """Copies whose files differ (another format, another name) but whose samples agree."""
    seen: dict[tuple[float, ...], SwingRun] = {}
    for run in swings:
        known = run.trajectory.values[run.trajectory.is_known]
        if len(known) < 8:
            continue
        mark = tuple(np.round(known[:: max(1, len(known) // 8)][:8, :2].ravel(), 5))
        first = seen.setdefault(mark, run)
        if first is not run and first.role != run.role:
            text = f"runs {first.name} and {run.name} hold the same samples"
            yield Finding("error", "runs", text, "one identifies, the other validates: drop one")
