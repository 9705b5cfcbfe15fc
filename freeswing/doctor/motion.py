"""One run's samples: time stamps, occlusion, units, taut cables."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.measured.frame_change import UP_TURNS, moved_trajectory
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import Robot
from freeswing.cdpr.rotation import transform
from freeswing.doctor.finding import Finding
from freeswing.doctor.quaternions import mistaken_quaternions
from freeswing.ident.runs import SwingRun
from freeswing.session.exchanged_lengths import (
    LENGTH_DIFFERENCE_M,
    exchanged_at_rest,
    exchanged_sentence,
)

# The slowest modes of a metre of cable take 2 s: two and a half periods tell its frequency.
WORTHWHILE_WINDOW_S = 5.0
# A twentieth missing costs a fortieth of the accuracy; but the same share in one piece costs more.
MOST_MISSING = 0.05
# A quarter of the period of the fastest modes, 2.5 Hz: longer gaps are not bridged but left.
LONGEST_GAP_S = 0.1
# Cameras keep their rate to 0.01 %; 29.97 called 30 is 0.1 % and changes an inertia by 0.2 %.
RATE_TOLERANCE = 5e-4
# Stamps rounded to a millisecond at both ends of a recording say its rate to this over its length.
ROUNDING_S = 1e-3
# Beyond every hall; and beside it twenty times the pulleys' own distance, for stadium cameras.
FARTHEST_M = 100.0
FARTHEST_REACHES = 20.0
# Geometry that is known to a centimetre changes lengths by some mm along a swing; turned axes by
# as much as the swing is wide, and the right ones by a fifth of that or less.
TURNED_CHANGE_M = 0.01
TURNED_BETTER = 0.2
# Locked cables keep their length to the poses' noise: 0.1 to 0.5 mm, of which 98 % of the samples
# span 4.7 deviations. 3 mm is more than that, and less than any slip of a drum's turn.
LENGTH_CHANGE_M = 0.003
# Swings of use are 10 mm and more; 0.1 mm is what standing platforms show as noise.
HARDLY_MOVES_M = 1e-4
# The shortest filter needs eight.
LEAST_SAMPLES = 8
# Counted from a program's or a machine's start, 30 years are not reached.
SINCE_1970_S = 1e9
# A dropped frame doubles a step; jitter of the stamps stays below half a step.
SKIPPED_STEPS = 1.5


def run_findings(run: SwingRun, robot: Robot, frame_rate_hz: float | None) -> Iterator[Finding]:
    """What stands out in one run, inside its window where it has one."""
    subject = f"run {run.name}"
    for note in run.trajectory.notes:
        yield Finding("warning", subject, note)
    yield from stamp_findings(subject, run.trajectory, frame_rate_hz)
    try:
        part = run.trajectory.window(*run.window_s) if run.window_s else run.trajectory
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
    yield from _places(subject, part, robot)
    if part.is_pose:
        yield from _cables(subject, run, part, robot)
    elif exchanged := exchanged_at_rest(run, robot)[1]:
        yield Finding("error", subject, exchanged, "put each cable's length in its place")


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


def _places(subject: str, part: Trajectory, robot: Robot) -> Iterator[Finding]:
    lengths = [k for k, name in enumerate(part.coordinates) if name in ("x", "y", "z")]
    if not lengths:
        return
    farthest = float(np.nanmax(np.abs(part.values[:, lengths])))
    reach = float(np.abs(robot.entries_m).max())
    if farthest > max(FARTHEST_M, FARTHEST_REACHES * reach):
        text = f"the platform is {farthest:g} m from the origin, the pulleys within {reach:g} m"
        yield Finding("error", subject, text, "the unit is metres")
    still = float(np.nanmax(np.nanstd(part.values[:, lengths], axis=0)))
    if still < HARDLY_MOVES_M:
        text = f"the platform hardly moves (std {1e3 * still:.3f} mm)"
        yield Finding("warning", subject, text, "set it swinging, or correct window_s")


def _turned(subject: str, part: Trajectory, robot: Robot, lengths: np.ndarray) -> Iterator[Finding]:
    """Whether the cables would keep their length were another axis of the recording up."""
    model = build_model(robot)
    found = _spread(lengths)
    if found < TURNED_CHANGE_M:
        return
    known = part.take(part.is_known)
    spreads = {}
    for axis, turn in UP_TURNS.items():
        poses = moved_trajectory(known, transform(turn, np.zeros(3))).values
        turned = evaluate(model.lengths, poses, model.start_values)[0].reshape(len(poses), -1)
        spreads[axis] = _spread(turned) if np.isfinite(turned).all() else np.inf
    best = min(spreads, key=spreads.__getitem__)
    if best != "z" and spreads[best] < TURNED_BETTER * found:
        text = (
            f"cable lengths change by {1e3 * found:.0f} mm as recorded, by "
            f"{1e3 * spreads[best]:.1f} mm if its axis {best} points up"
        )
        remedy = f'say so in session.toml: [mocap] up = "{best}"'
        yield Finding("warning", subject, text, remedy)


def _spread(lengths: np.ndarray) -> float:
    return float(np.ptp(np.percentile(lengths, [1.0, 99.0], axis=0), axis=0).max())


def _cables(subject: str, run: SwingRun, part: Trajectory, robot: Robot) -> Iterator[Finding]:
    model = build_model(robot)
    poses = part.values[part.is_known]
    lengths = evaluate(model.lengths, poses, model.start_values)[0].reshape(len(poses), -1)
    if not np.isfinite(lengths).all():
        said, remedy = mistaken_quaternions(run, robot)
        if said:
            yield Finding("error", subject, said, remedy)
            return
        text = "the poses put a cable inside its pulley or on its swivel axis"
        yield Finding("error", subject, text, "check the base frame of the poses and entry_m")
        return
    yield from _turned(subject, part, robot, lengths)
    said, remedy = mistaken_quaternions(run, robot)
    if said:
        yield Finding("error", subject, said, remedy)
        return
    for cable, column in zip(robot.cables, lengths.T, strict=True):
        spread = float(np.ptp(np.percentile(column, [1.0, 99.0])))
        if spread > LENGTH_CHANGE_M:
            text = f"cable {cable.name}'s length changes by {1e3 * spread:.1f} mm along the run"
            remedy = "it went slack, slipped on its drum, or the geometry is wrong"
            yield Finding("warning", subject, text, remedy)
    if run.lengths_m is not None:
        off = lengths.mean(axis=0) - run.lengths_m
        if exchanged := exchanged_sentence(run, robot, lengths.mean(axis=0)):
            yield Finding("error", subject, exchanged, "put each cable's length in its place")
            return
        for cable, difference in zip(robot.cables, off, strict=True):
            if abs(difference) > LENGTH_DIFFERENCE_M:
                text = f"cable {cable.name} is {1e3 * difference:+.0f} mm from its cable_lengths_m"
                remedy = "lengths count from D over the pulley: l = |rho| + r (pi - psi)"
                yield Finding("warning", subject, text, remedy)
