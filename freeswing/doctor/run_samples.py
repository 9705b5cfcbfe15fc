"""One run's samples: time stamps, occlusion, units, taut cables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import Robot
from freeswing.doctor.cable_lengths import cable_findings
from freeswing.doctor.finding import Finding, named_runs
from freeswing.doctor.recordings_against_lengths import mistaken_recording
from freeswing.doctor.time_stamps import stamp_findings
from freeswing.ident.runs import SwingRun
from freeswing.session.exchanged_lengths import (
    exchanged_at_rest,
)

# The slowest modes of a metre of cable take 2 s: two and a half periods tell its frequency.
WORTHWHILE_WINDOW_S = 5.0
# A twentieth missing costs a fortieth of the accuracy; but the same share in one piece costs more.
MOST_MISSING = 0.05
# A quarter of the period of the fastest modes, 2.5 Hz: longer gaps are not bridged but left.
LONGEST_GAP_S = 0.1
# Beyond every hall; and beside it twenty times the pulleys' own distance, for stadium cameras.
FARTHEST_M = 100.0
FARTHEST_REACHES = 20.0
FAR_REMEDY = "millimetres look so: write metres"
# Swings of use are 10 mm and more; 0.1 mm is what standing platforms show as noise.
HARDLY_MOVES_M = 1e-4


def run_findings(
    run: SwingRun, robot: Robot, frame_rate_hz: float | None, *, measured: bool = True
) -> Iterator[Finding]:
    """What stands out in one run, inside its window where it has one."""
    subject = f"run {run.name}"
    for note in run.trajectory.notes:
        yield Finding("warning", subject, note)
    yield from stamp_findings(subject, run.trajectory, frame_rate_hz, measured=measured)
    try:
        part = run.inside()
    except DataError as failure:
        yield Finding("error", subject, str(failure))
        return
    if run.window_s is not None:
        yield from _window(subject, run.trajectory, run.window_s)
    else:
        yield Finding("note", subject, "no window_s", "the free motion is looked for")
    yield from _missing(subject, part)
    if not part.is_known.any():
        return
    said, remedy = mistaken_recording(run, robot)
    beyond = _beyond(part, robot)
    if said or beyond:
        yield Finding("error", subject, said or beyond, remedy or FAR_REMEDY)
        return
    yield from _still(subject, part)
    if part.is_pose:
        yield from cable_findings(subject, run, part, robot)
    elif exchanged := exchanged_at_rest(run, robot)[1]:
        yield Finding("error", subject, exchanged, "put each cable's length in its place")


def _window(
    subject: str, trajectory: Trajectory, window_s: tuple[float, float]
) -> Iterator[Finding]:
    first, last = float(trajectory.times_s[0]), float(trajectory.times_s[-1])
    step = 1.0 / trajectory.sample_rate_hz
    if window_s[0] < first - step or window_s[1] > last + step:
        text = f"window_s {list(window_s)} reaches beyond the samples, {first:g} to {last:g} s"
        yield Finding("warning", subject, text, "correct window_s")
    if window_s[1] - window_s[0] < WORTHWHILE_WINDOW_S:
        text = f"{window_s[1] - window_s[0]:g} s of free motion"
        yield Finding("warning", subject, text, f"{WORTHWHILE_WINDOW_S:g} s or more tell far more")


def _missing(subject: str, part: Trajectory) -> Iterator[Finding]:
    known = part.is_known
    share = 1.0 - known.mean()
    if not known.any():
        yield Finding("error", subject, "every sample of the window is missing", "drop the run")
        return
    times = part.times_s[known]
    gap = float(np.diff(times).max(initial=0.0))
    if share > MOST_MISSING or gap > LONGEST_GAP_S:
        text = f"{100 * share:.1f} % of the samples are missing, the longest gap is {gap:.2f} s"
        yield Finding("warning", subject, text, "markers or tags were hidden there")


def refuse_far_platforms(swings: Sequence[SwingRun], robot: Robot) -> None:
    """Refuse runs that put the platform farther off than any cable holds it.

    Raises:
        DataError: naming the runs and the columns.
    """
    told = [(swing.name, _beyond(swing.inside(), robot)) for swing in swings]
    wrong = [one for one in told if one[1]]
    if wrong:
        names = [name for name, _ in wrong]
        raise DataError(f"{named_runs(names)}: {wrong[0][1]}; {FAR_REMEDY}")


def _positions(part: Trajectory) -> list[int]:
    return [k for k, name in enumerate(part.coordinates) if name in ("x", "y", "z")]


def _beyond(part: Trajectory, robot: Robot) -> str:
    """Which coordinates reach farther than any cable does; empty where none."""
    reach = float(np.abs(robot.entries_m).max())
    limit = max(FARTHEST_M, FARTHEST_REACHES * reach)
    known = part.values[part.is_known]
    farthest = {
        part.coordinates[k]: float(np.abs(known[:, k]).max(initial=0.0)) for k in _positions(part)
    }
    said = [f"{name} reaches {far:g} m" for name, far in farthest.items() if far > limit]
    return f"{', '.join(said)}, the pulleys lie within {reach:g} m" if said else ""


def _still(subject: str, part: Trajectory) -> Iterator[Finding]:
    columns = _positions(part)
    if not columns:
        return
    still = float(np.nanmax(np.nanstd(part.values[:, columns], axis=0)))
    if still < HARDLY_MOVES_M:
        text = f"the platform hardly moves (std {1e3 * still:.3f} mm)"
        yield Finding("warning", subject, text, "set it swinging, or correct window_s")
