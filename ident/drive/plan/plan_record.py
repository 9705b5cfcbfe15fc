"""The record of which the worst relative deviation is smallest, within what the robot can do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.excitation import prbs
from freeswing.cdpr.driven.motion import DrivenMotion
from freeswing.cdpr.system.progress import Progress
from freeswing.ident.drive.kinematics import StaticPoses
from freeswing.ident.drive.plan.deviations import Bench, moved_by, relative_deviations
from freeswing.ident.drive.plan.references import References, changed, drawn

Array = NDArray[np.float64]

MOST_TRIES = 60  # plans simulated for one that keeps within the limits
DRAWN_SHARE = 0.4  # of the scored plans: the rest change the best so far
CHANGED_MOTORS = 2  # at most, drawn anew in one change
PAPER_LEVELS_A, PAPER_BAND_HZ = (0.0, 1.0), 1.0  # its identification record (4.2.3)


@dataclass(frozen=True, slots=True)
class Limits:
    """What a planned motion keeps within.

    Attributes:
        margin_N: tensions stay so far from slack, and from their greatest value.
        room: positions stay within this share of the frame's half sizes.
    """

    margin_N: float
    room: float


@dataclass(frozen=True, slots=True)
class Record:
    """A planned record.

    Attributes:
        references: of all motors.
        motion: what the declared robot would do.
        deviations: of each unknown over its value, (k,).
    """

    references: References
    motion: DrivenMotion
    deviations: Array

    @property
    def worst(self) -> float:
        """What the plan is judged by."""
        return float(self.deviations.max())


@dataclass(frozen=True, slots=True)
class Planned:
    """The best record, and what random ones of the paper's kind would give.

    Attributes:
        best: the plan.
        random: deviations of the paper's random records, (m, k).
        random_least_N: least tension in each of them, (m,).
        tried: plans simulated; most of them leave the limits.
        scored: plans of which deviations were computed.
    """

    best: Record
    random: Array
    random_least_N: Array
    tried: int
    scored: int


def plan_record(
    bench: Bench,
    static: StaticPoses,
    limits: Limits,
    *,
    kind: str,
    seconds: float,
    scored: int,
    n_random: int,
    seed: int,
    progress: Progress,
) -> Planned:
    """Draw, then change a motor or two of the best, and keep what has the smallest worst deviation.

    Raises:
        ValueError: when no draw keeps within the limits.
    """
    generator = np.random.default_rng(seed)
    n_samples = round(seconds * bench.rate_hz) + 1
    current = bench.model.drive.current_limits_A
    best: Record | None = None
    tried = 0
    for k in range(scored):
        progress("plans", k / scored)
        for _ in range(MOST_TRIES):
            tried += 1
            if best is None or k < DRAWN_SHARE * scored:
                trial = drawn(kind, n_samples, bench.rate_hz, current, generator)
            else:
                count = int(generator.integers(1, CHANGED_MOTORS + 1))
                motors = generator.choice(len(current), count, replace=False)
                trial = changed(kind, best.references, bench.rate_hz, current, motors, generator)
            motion = _kept(bench, limits, trial.values)
            if motion is not None:
                found = Record(trial, motion, relative_deviations(bench, motion, static))
                best = found if best is None or found.worst < best.worst else best
                break
    if best is None:
        raise ValueError(
            f"none of {tried} plans keeps {limits.margin_N:g} N from slack within {limits.room:g} "
            "of the frame: take a smaller margin, or more room"
        )
    random, least = _papers(bench, static, n_samples, n_random, seed)
    return Planned(best, random, least, tried, scored)


def _kept(bench: Bench, limits: Limits, references: Array) -> DrivenMotion | None:
    """The motion, None where it leaves the limits."""
    try:
        motion = moved_by(bench, references)
    except ValueError:
        return None
    return motion if within(bench, limits, motion.poses, motion.tensions_N) else None


def within(bench: Bench, limits: Limits, poses: Array, tensions_N: Array) -> bool:
    """Whether tensions (.., n) and positions of poses (.., 7) keep the limits."""
    bounds = bench.model.drive.tension_limits_N
    frame = bench.model.robot.entries_m
    middle = 0.5 * (frame.max(axis=0) + frame.min(axis=0))
    half = 0.5 * np.ptp(frame, axis=0)
    if tensions_N.min() < limits.margin_N or (tensions_N > bounds[:, 1] - limits.margin_N).any():
        return False
    return bool((np.abs(poses[..., :3] - middle) <= limits.room * half).all())


def _papers(
    bench: Bench, static: StaticPoses, n_samples: int, count: int, seed: int
) -> tuple[Array, Array]:
    """Deviations (m, k) and least tensions (m,) of random PRBS as the paper's."""
    deviations, least = [], []
    for k in range(count):
        generator = np.random.default_rng([seed, k])
        references = prbs(
            n_samples,
            bench.model.n_cables,
            bench.rate_hz,
            PAPER_LEVELS_A,
            PAPER_BAND_HZ,
            generator,
        )
        motion = moved_by(bench, references)
        deviations.append(relative_deviations(bench, motion, static))
        least.append(float(motion.tensions_N.min()))
    return np.array(deviations).reshape(-1, len(bench.asked.groups)), np.array(least)
