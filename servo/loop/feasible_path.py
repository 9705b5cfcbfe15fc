"""Whether a task stays where the cables can hold the platform at rest."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.servo.files.task_file import Task
from freeswing.servo.synthesis.state_space import Array
from freeswing.servo.tensions.robot_wrenches import held_at_rest

# Places looked at on each way: a step of a metre is seen every 2 cm.
PLACES = 51


def leaves_workspace(model: DrivenModel, task: Task) -> str | None:
    """Where and when a task first asks for a pose that no allowed tensions hold; None if never.

    Args:
        model: the driven robot.
        task: steps; the way between two is taken as straight, at the second one's time.
    """
    names = [cable.name for cable in model.robot.cables]
    entries = np.abs(model.robot.entries_m).max(axis=0)
    for i, (time, goal) in enumerate(zip(task.times_s, task.poses, strict=True)):
        before = task.poses[max(i - 1, 0)]
        ways = before + np.linspace(0.0, 1.0, PLACES)[:, None] * (goal - before)
        outside = np.flatnonzero((np.abs(ways[:, :3]) >= entries).any(axis=1))
        if len(outside):
            return f"at {time:g} s it leaves the frame at {_shown(ways[outside[0]])}"
        shares = held_at_rest(model, ways)
        for k, status in enumerate(shares.status):
            if status != "feasible":
                stop = shares.stops[k]
                why = "" if stop is None else f" (cable {names[stop[0]]} {stop[1]} at its limit)"
                return (
                    f"at {time:g} s it leaves the feasible workspace at {_shown(ways[k])}{why}: "
                    "no tensions between the limits hold the platform there; keep nearer to the "
                    "centre"
                )
    return None


def _shown(pose: Array) -> str:
    place = ", ".join(f"{value:.3f}" for value in pose[:3])
    turn = ", ".join(f"{value:.3f}" for value in pose[3:])
    return f"({place}) m, ({turn}) rad"
