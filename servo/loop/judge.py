"""What a run of the loop was worth: what is left of each step, how fast, and whether it held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.servo.files.task_file import Task
from freeswing.servo.loop.closed_loop import Run
from freeswing.servo.loop.held_or_lost import is_held, is_shaking
from freeswing.servo.synthesis.state_space import Array

SETTLED_S = 1.0  # what is left is read over the last second of each step, as the paper's Fig. 14


@dataclass(frozen=True, slots=True)
class Step:
    """One step of a task.

    Attributes:
        begins_s: when.
        left_m: distance of the mean position of its last second from the one asked for.
        left_rad: the same of the angles.
        jitter_m: rms of the position about that mean.
        t90_s: until 90 % of the way are done; NaN for a step without a way or one that never does.
        overshoot: beyond the end, as a share of the way; NaN as above.
    """

    begins_s: float
    left_m: float
    left_rad: float
    jitter_m: float
    t90_s: float
    overshoot: float


@dataclass(frozen=True, slots=True)
class Judgement:
    """One run.

    Attributes:
        steps: each step of the task that was begun.
        least_N: least tension, negative where a cable would have had to push.
        most_N: greatest tension.
        slack: names of the cables that would have had to push.
        outside: share of samples with a tension outside its limits.
        scaled: share of samples whose wrench was not feasible.
        current_rms_A: change of the references from sample to sample, rms: what noise costs.
        held: whether the platform was where it was asked to be at every step's end, no cable slack.
        why: a sentence where it was not.
    """

    steps: tuple[Step, ...]
    least_N: float
    most_N: float
    slack: tuple[str, ...]
    outside: float
    scaled: float
    current_rms_A: float
    held: bool
    why: str


def judge(run: Run, task: Task, names: tuple[str, ...], limits_N: Array) -> Judgement:
    """Judge a run by its task.

    Args:
        run: what happened.
        task: what was asked.
        names: of the cables.
        limits_N: of the tensions, (n, 2).
    """
    ends = np.append(task.times_s[1:], task.end_s)
    steps = tuple(
        _step(run, task, i, float(ends[i]))
        for i in range(len(ends))
        if len(run.times_s) and run.times_s[-1] >= ends[i] - 2e-3
    )
    tensions = run.tensions_N
    slack = tuple(name for name, t in zip(names, tensions.T, strict=True) if (t < 0.0).any())
    out = (tensions < limits_N[:, 0]) | (tensions > limits_N[:, 1])
    why = _why(run, steps, slack)
    return Judgement(
        steps,
        float(tensions.min(initial=np.inf)),
        float(tensions.max(initial=-np.inf)),
        slack,
        float(out.any(axis=1).mean()) if len(out) else 1.0,
        float((run.scales < 1.0).mean()) if len(run.scales) else 1.0,
        float(np.sqrt(np.mean(np.diff(run.references_A, axis=0) ** 2))),
        not why,
        why,
    )


def _why(run: Run, steps: tuple[Step, ...], slack: tuple[str, ...]) -> str:
    if run.lost_s is not None:
        return f"lost at {run.lost_s:.2f} s: the platform ran away"
    if slack:
        return f"cable {', '.join(slack)} went slack"
    far = [step for step in steps if not is_held(step.left_m, step.left_rad)]
    if far:
        return (
            f"{1e3 * far[0].left_m:.0f} mm and {far[0].left_rad:.2f} rad are left of the step at "
            f"{far[0].begins_s:g} s"
        )
    shaken = [step for step in steps if is_shaking(step.jitter_m)]
    if shaken:
        size, begin = 1e3 * shaken[0].jitter_m, shaken[0].begins_s
        return f"shaking by {size:.0f} mm after the step at {begin:g} s"
    return ""


def _step(run: Run, task: Task, index: int, end: float) -> Step:
    begin, goal = float(task.times_s[index]), task.poses[index]
    inside = (run.times_s >= begin - 1e-9) & (run.times_s < end - 1e-9)
    last = inside & (run.times_s >= max(begin, end - SETTLED_S) - 1e-9)
    mean = run.poses[last].mean(axis=0)
    jitter = np.sqrt(((run.poses[last, :3] - mean[:3]) ** 2).sum(axis=1).mean())
    t90 = overshoot = np.nan
    way = goal[:3] - task.poses[max(index - 1, 0), :3]
    if (length := float(way @ way)) > 0.0:
        done = (run.poses[inside, :3] - task.poses[index - 1, :3]) @ way / length
        overshoot = float(done.max() - 1.0)
        if (done >= 0.9).any():
            t90 = float(run.times_s[inside][np.argmax(done >= 0.9)] - begin)
    return Step(
        begin,
        float(np.linalg.norm(mean[:3] - goal[:3])),
        float(np.linalg.norm(mean[3:] - goal[3:])),
        float(jitter),
        t90,
        overshoot,
    )
