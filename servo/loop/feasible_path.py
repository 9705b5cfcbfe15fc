"""Whether a task stays where the cables can hold the platform at rest."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.cdpr.driven.statics import holding_wrench
from freeswing.cdpr.rotation import matrix_from_quaternion
from freeswing.servo.files.task_file import Task
from freeswing.servo.robot_now import pose7
from freeswing.servo.synthesis.state_space import Array
from freeswing.servo.tensions.methods import distribute_all
from freeswing.servo.tensions.robot_wrenches import demands_at_rest

# Places looked at on each way: a step of a metre is seen every 2 cm.
PLACES = 51


def leaves_workspace(model: DrivenModel, task: Task) -> str | None:
    """Where and when a task first asks for a pose that no allowed tensions hold; None if never.

    Args:
        model: the driven robot.
        task: steps; the way between two is taken as straight, at the second one's time.
    """
    entries = np.abs(model.robot.entries_m).max(axis=0)
    for i, (time, goal) in enumerate(zip(task.times_s, task.poses, strict=True)):
        before = task.poses[max(i - 1, 0)]
        ways = before + np.linspace(0.0, 1.0, PLACES)[:, None] * (goal - before)
        outside = np.flatnonzero((np.abs(ways[:, :3]) >= entries).any(axis=1))
        if len(outside):
            return f"at {time:g} s it leaves the frame at {_shown(ways[outside[0]])}"
        statuses, stops = _held(model, ways)
        for k, status in enumerate(statuses):
            if status != "feasible":
                why = "" if stops[k] is None else f" (cable {stops[k]} at its limit)"
                return (
                    f"at {time:g} s it leaves the feasible workspace at {_shown(ways[k])}{why}: "
                    "no tensions between the limits hold the platform there; keep nearer to the "
                    "centre"
                )
    return None


def _held(model: DrivenModel, poses: Array) -> tuple[tuple[str, ...], list[str | None]]:
    places = np.array([pose7(pose) for pose in poses])
    wrenches = np.array([holding_wrench(model, place) for place in places])
    turns = matrix_from_quaternion(places[:, 3:])
    wrenches[:, 3:] = np.einsum("kij,kj->ki", turns, wrenches[:, 3:])
    demands, _, _ = demands_at_rest(model, places, wrenches, of_motors=True)
    shares = distribute_all(demands)
    names = [cable.name for cable in model.robot.cables]
    return shares.status, [None if s is None else f"{names[s[0]]} {s[1]}" for s in shares.stops]


def _shown(pose: Array) -> str:
    place = ", ".join(f"{value:.3f}" for value in pose[:3])
    turn = ", ".join(f"{value:.3f}" for value in pose[3:])
    return f"({place}) m, ({turn}) rad"
