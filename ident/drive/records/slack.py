"""Cables that would have to push, and motors asked for more than they give."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.cdpr.driven.motion import DrivenMotion
from freeswing.ident.drive.run_problem import DriveRun, head_of, simulated, start_pose

Array = NDArray[np.float64]

# Before its first slack cable a run must have so much: what starts and friction do takes 0.3 s.
SHORTEST_S = 0.5
# A cable that pushes for less is not taken for slack: a newton too many moves 0.3 kg by 40 um in
# it, an encoder's count, and numbers that are slightly off see such moments at the edges of steps.
LASTING_S = 0.005
# So much of a run is left out before its first slack: angles and numbers are not yet exact there.
MARGIN_S = 0.02


def first_slack(motion: DrivenMotion) -> int:
    """Samples before rigid cables would first have had to push for `LASTING_S`; all without that.

    From there on a real cable hangs and the rigid model is wrong. Elastic ones hang by themselves.
    """
    if motion.lengths_out_m is not None:
        return len(motion.times_s)
    pushing = np.asarray(motion.slack.any(axis=1))
    lasting = max(1, round(LASTING_S / (motion.times_s[1] - motion.times_s[0])))
    if len(pushing) < lasting:
        return len(pushing)
    rows = np.flatnonzero(np.lib.stride_tricks.sliding_window_view(pushing, lasting).all(axis=1))
    return int(rows[0]) if len(rows) else len(pushing)


def before_slack(
    model: DrivenModel,
    theta: Array,
    runs: Iterable[DriveRun],
    zero: Array,
    *,
    at_least: bool = False,
) -> tuple[DriveRun, ...]:
    """The runs, each up to shortly before its first slack cable by these numbers.

    Args:
        model: the equations.
        theta: their numbers.
        runs: whole recordings.
        zero: L / r where the angles are zero, (n,).
        at_least: numbers that a search only starts from may see slack where none is, or not
            follow a run at all: `SHORTEST_S` of each run stay then, or all of it.

    Raises:
        ValueError: when too little is left of one, or it cannot be simulated.
    """
    return tuple(_cut(model, theta, run, zero, at_least) for run in runs)


def _cut(model: DrivenModel, theta: Array, run: DriveRun, zero: Array, at_least: bool) -> DriveRun:
    try:
        motion = simulated(model, theta, run, start_pose(model, theta, run, zero))
    except ValueError:
        if at_least:
            return run
        raise
    until = first_slack(motion)
    if until == len(motion.times_s):
        return run
    seconds = until / run.rate_hz - MARGIN_S
    if at_least:
        seconds = max(seconds, SHORTEST_S)
    if seconds < SHORTEST_S:
        cable = model.robot.cables[int(np.argmax(motion.slack[until]))]
        raise ValueError(
            f"run {run.name}: cable {cable.name} is slack from {until / run.rate_hz:.2f} s on: "
            "rigid cables tell nothing after that; record it again with a higher least current, "
            'or give it role = "validate"'
        )
    return head_of(run, seconds)
