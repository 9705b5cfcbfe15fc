"""Time stamps of runs: too few, of another rate than declared, with jumps, or counted on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.measured.lost_rows import lost_rows
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.doctor.finding import Finding, named_runs
from freeswing.ident.runs import SwingRun

# Cameras keep their rate to 0.01 %; 29.97 called 30 is 0.1 % and changes an inertia by 0.2 %.
RATE_TOLERANCE = 5e-4
# Apart by so much a rate is no nominal one: stamps or the session are wrong, and an inertia by
# twice of it. Every second or third sample of a capture is another matter.
RATE_CONTRADICTED = 3e-3
# One step twice as long as those around may be a knock against something; the third is no chance.
LEAST_LOST = 3
# Stamps rounded to a millisecond at both ends of a recording say its rate to this over its length.
ROUNDING_S = 1e-3
# The shortest filter needs eight.
LEAST_SAMPLES = 8
# Counted from a program's or a machine's start, 30 years are not reached.
SINCE_1970_S = 1e9
# A dropped frame doubles a step; jitter of the stamps stays below half a step.
SKIPPED_STEPS = 1.5


def stamp_findings(
    subject: str, trajectory: Trajectory, rate_hz: float | None, *, measured: bool = True
) -> Iterator[Finding]:
    """Samples that are too few, that come at another rate than declared, or with jumps.

    The rate of what was not `measured` but filmed is weighed where it is tracked.
    """
    if len(trajectory) and trajectory.times_s[0] > SINCE_1970_S:
        text = f"its times begin at {trajectory.times_s[0]:.10g} s: they count from 1970"
        yield Finding("note", subject, text, "window_s counts so too")
    if len(trajectory) < LEAST_SAMPLES:
        yield Finding(
            "error", subject, f"{len(trajectory)} samples, at least {LEAST_SAMPLES} are needed"
        )
        return
    found = _rate(trajectory)
    rounding = ROUNDING_S / trajectory.duration_s
    if rate_hz is not None and abs(found / rate_hz - 1.0) > RATE_TOLERANCE + rounding:
        level = "error" if measured and _contradicts(trajectory, rate_hz) else "warning"
        text = f"samples come at {found:.2f} Hz, the session says {rate_hz:g} Hz"
        yield Finding(level, subject, text, "check frame_rate_hz and the time stamps")
    lost = lost_rows(trajectory)
    if len(lost):
        level = "error" if len(lost) >= LEAST_LOST else "warning"
        yield Finding(level, subject, _lost_text(len(lost), float(lost[0])), LOST_REMEDY)
    steps = np.diff(trajectory.times_s)
    skipped = int((steps > SKIPPED_STEPS * np.median(steps)).sum())
    if skipped:
        text = f"time stamps jump {skipped} times, at most by {steps.max():.3f} s"
        yield Finding("note", subject, text, "dropped frames are bridged or left out")


def refuse_wrong_stamps(swings: Sequence[SwingRun], rate_hz: float | None) -> None:
    """Refuse measured runs whose stamps cannot be the times of their samples.

    Args:
        swings: the runs that were measured; a camera's clock is looked at where it is tracked.
        rate_hz: as the session says, None where it says none.

    Raises:
        DataError: naming the runs.
    """
    if rate_hz is not None:
        wrong = [swing for swing in swings if _contradicts(swing.trajectory, rate_hz)]
        if wrong:
            names = [swing.name for swing in wrong]
            raise DataError(
                f"{named_runs(names)}: samples come at {_rate(wrong[0].trajectory):.2f} Hz, the "
                f"session says {rate_hz:g} Hz: one of the two clocks is wrong, and an inertia by "
                "twice of it; correct frame_rate_hz or the time stamps"
            )
    found = [(swing, lost_rows(swing.trajectory)) for swing in swings]
    if sum(len(lost) for _, lost in found) >= LEAST_LOST:
        found.sort(key=lambda one: -len(one[1]))
        lost = found[0][1]
        said = _lost_text(len(lost), float(lost[0]))
        names = [swing.name for swing, one in found if len(one)]
        raise DataError(f"{named_runs(names)}: {said}; {LOST_REMEDY}")


LOST_REMEDY = "export the capture's own stamps, or lost rows with empty cells"


def _lost_text(count: int, first_s: float) -> str:
    steps = (
        f"{count} steps, the first at {first_s:.2f} s, are"
        if count > 1
        else f"the step to {first_s:.2f} s is"
    )
    return (
        f"{steps} twice as long as those around, in all coordinates and at even time stamps: rows "
        "were lost and the stamps counted on"
    )


def _contradicts(trajectory: Trajectory, rate_hz: float) -> bool:
    """Whether a rate is neither the session's nor a whole part or multiple of it."""
    if len(trajectory) < LEAST_SAMPLES:
        return False
    ratio = _rate(trajectory) / rate_hz
    ratio = max(ratio, 1.0 / ratio)
    tolerance = RATE_CONTRADICTED + ROUNDING_S / trajectory.duration_s
    return abs(ratio / np.round(ratio) - 1.0) > tolerance


def _rate(trajectory: Trajectory) -> float:
    """Steps a second over the whole recording, a jump of the stamps counted as its steps.

    By samples that are known: what was left out of a rate that somebody raised has other steps.
    """
    known = trajectory.is_known
    steps = np.diff(trajectory.times_s[known] if known.sum() > 1 else trajectory.times_s)
    return float(np.round(steps / np.median(steps)).sum() / steps.sum())
