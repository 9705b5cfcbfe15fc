"""Runs of a bench that no fit could show to be wrong."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace

from freeswing.cdpr.files.documents import DataError, InputError
from freeswing.cdpr.measured.target import Target
from freeswing.cdpr.robot import Robot
from freeswing.doctor.bench_units import refuse_wrong_units
from freeswing.doctor.exchanged_by_lean import refuse_exchanged_by_lean
from freeswing.doctor.finding import Finding
from freeswing.doctor.recordings_against_lengths import refuse_mistaken_recordings
from freeswing.doctor.run_samples import run_findings
from freeswing.ident.bench.identify_bench import check_runs
from freeswing.ident.bench.runs import Bench
from freeswing.ident.runs import SwingRun
from freeswing.session.exchanged_lengths import BENCH_DIFFERENCE_M, refuse_exchanged_lengths
from freeswing.session.load_bench import coordinate_swings, load_bench
from freeswing.session.load_swings import trajectory_path
from freeswing.session.repeated_runs import refuse_repeated
from freeswing.session.session_file import Session

WHOLE = "all of the recording is fitted: give it from where the hand has let go"


def bench_findings(
    session: Session, robot: Robot, target: Target | None
) -> Generator[Finding, None, list[SwingRun]]:
    """What stands out in a bench's runs; gives those that measure coordinates."""
    waiting = [
        run
        for run in session.runs
        if run.video is not None and not trajectory_path(session, run).is_file()
    ]
    if waiting:
        for run in waiting:
            yield Finding("note", f"run {run.name}", "not tracked yet", "run freeswing track")
        return []
    try:
        bench = load_bench(session, robot, target)
    except (InputError, DataError) as failure:
        yield Finding("error", "runs", str(failure).replace("\n", " "))
        return []
    swings = coordinate_swings(bench)
    for swing in swings:
        for finding in run_findings(swing, robot, session.frame_rate_hz):
            whole = finding.text == "no window_s"
            yield replace(finding, remedy=WHOLE) if whole else finding
    for refuses in (refuse_wrong_bench_runs, check_runs):
        try:
            refuses(bench, robot)
        except (InputError, DataError) as failure:
            yield Finding("error", "runs", str(failure))
            break
    return swings


def refuse_wrong_bench_runs(bench: Bench, robot: Robot) -> None:
    """Refuse other units, a recording given twice, mistaken quaternions and exchanged lengths.

    Raises:
        InputError: naming what is in another unit.
        DataError: naming the runs, what is wrong and what to do.
    """
    refuse_wrong_units(bench, robot)
    swings = coordinate_swings(bench)
    refuse_repeated(swings)
    refuse_mistaken_recordings(swings, robot)
    refuse_exchanged_lengths(swings, robot, BENCH_DIFFERENCE_M)
    refuse_exchanged_by_lean(bench, robot)
