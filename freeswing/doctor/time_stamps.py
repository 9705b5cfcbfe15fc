"""Time stamps of a run: too few, of another rate than declared, or with jumps."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.doctor.finding import Finding

# Cameras keep their rate to 0.01 %; 29.97 called 30 is 0.1 % and changes an inertia by 0.2 %.
RATE_TOLERANCE = 5e-4
# Stamps rounded to a millisecond at both ends of a recording say its rate to this over its length.
ROUNDING_S = 1e-3
# The shortest filter needs eight.
LEAST_SAMPLES = 8
# Counted from a program's or a machine's start, 30 years are not reached.
SINCE_1970_S = 1e9
# A dropped frame doubles a step; jitter of the stamps stays below half a step.
SKIPPED_STEPS = 1.5


def stamp_findings(
    subject: str, trajectory: Trajectory, rate_hz: float | None
) -> Iterator[Finding]:
    """Samples that are too few, that come at another rate than declared, or with jumps."""
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
        text = f"samples come at {found:.2f} Hz, the session says {rate_hz:g} Hz"
        yield Finding("warning", subject, text, "check frame_rate_hz and the time stamps")
    steps = np.diff(trajectory.times_s)
    skipped = int((steps > SKIPPED_STEPS * np.median(steps)).sum())
    if skipped:
        text = f"time stamps jump {skipped} times, at most by {steps.max():.3f} s"
        yield Finding("note", subject, text, "dropped frames are bridged or left out")


def _rate(trajectory: Trajectory) -> float:
    """Steps a second over the whole recording, a jump of the stamps counted as its steps."""
    steps = np.diff(trajectory.times_s)
    return float(np.round(steps / np.median(steps)).sum() / steps.sum())
