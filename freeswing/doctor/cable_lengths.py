"""Cables of a run that do not keep their length: slack, slipped, turned axes, wrong geometry."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from freeswing.cdpr.measured.recording_to_base_frame import UP_TURNS, moved_trajectory
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import Robot
from freeswing.cdpr.rotation import transform
from freeswing.doctor.finding import Finding
from freeswing.ident.runs import SwingRun
from freeswing.session.exchanged_lengths import (
    LENGTH_DIFFERENCE_M,
    exchanged_sentence,
)

# Geometry that is known to a centimetre changes lengths by some mm along a swing; turned axes by
# as much as the swing is wide, and the right ones by a fifth of that or less.
TURNED_CHANGE_M = 0.01
TURNED_BETTER = 0.2
# Locked cables keep their length to the poses' noise: 0.1 to 0.5 mm, of which 98 % of the samples
# span 4.7 deviations. 3 mm is more than that, and less than any slip of a drum's turn.
LENGTH_CHANGE_M = 0.003


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


def cable_findings(
    subject: str, run: SwingRun, part: Trajectory, robot: Robot
) -> Iterator[Finding]:
    """What lengths of the cables say along a run, and beside those that are stated."""
    model = build_model(robot)
    poses = part.values[part.is_known]
    lengths = evaluate(model.lengths, poses, model.start_values)[0].reshape(len(poses), -1)
    if not np.isfinite(lengths).all():
        text = "the poses put a cable inside its pulley or on its swivel axis"
        yield Finding("error", subject, text, "check the base frame of the poses and entry_m")
        return
    yield from _turned(subject, part, robot, lengths)
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
