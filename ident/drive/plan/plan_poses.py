"""Poses at rest to add to one motor at a time, for the geometry that those leave poorly known."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.motion import motor_angles
from freeswing.cdpr.driven.slopes import length_slope, pose_map
from freeswing.cdpr.driven.statics import CENTRE, static_pose
from freeswing.cdpr.model.batch import evaluate
from freeswing.ident.drive.kinematics import StaticPoses, zero_turns
from freeswing.ident.drive.plan.deviations import Bench
from freeswing.ident.drive.plan.plan_record import Limits, within

STATIC_SAMPLES = 100  # each pose at rest is the mean of so many

Array = NDArray[np.float64]

LEVELS_A = (1.0, 2.0, 3.0)
MOST_TOGETHER = 4  # motors with current at once
CANDIDATES = 150


@dataclass(frozen=True, slots=True)
class Poses:
    """What to add.

    Attributes:
        currents_A: one pose a row, (m, n).
        poses: where the platform rests then, (m, 7).
        before: relative deviations of the geometry by one motor at a time, (k,).
        after: with the added poses, (k,).
    """

    currents_A: Array
    poses: Array
    before: Array
    after: Array


def single_motors(bench: Bench) -> Array:
    """The paper's currents at rest: none, then 1 A in one motor after another, (n + 1, n)."""
    n = bench.model.n_cables
    return np.vstack([np.zeros(n), np.eye(n)])


def plan_poses(bench: Bench, limits: Limits, count: int, seed: int) -> Poses:
    """Add the poses, one after another, that lower the worst relative deviation most.

    Args:
        bench: the robot and what is asked for; its kinematic unknowns count.
        limits: tensions and room.
        count: poses to add.
        seed: of the currents that are tried.

    Raises:
        ValueError: without kinematic unknowns.
    """
    asked = bench.asked.kinematic
    if not asked.groups:
        raise ValueError("no kinematic unknown: poses at rest tell the geometry alone")
    geometry = replace(bench, asked=asked)
    known = _information(geometry, at_rest(bench, single_motors(bench))).sum(axis=0)
    before = _relative(geometry, known)
    tried = _tried(bench, limits, seed)
    n = bench.model.n_cables
    if len(tried) == 0 or count == 0:
        return Poses(np.zeros((0, n)), np.zeros((0, 7)), before, before)
    seen = at_rest(bench, tried)
    parts = _information(geometry, seen)
    chosen: list[int] = []
    for _ in range(min(count, len(tried))):
        costs = [_relative(geometry, known + part).max() for part in parts]
        best = int(np.argmin(costs))
        chosen.append(best)
        known = known + parts[best]
    return Poses(tried[chosen], seen.poses[chosen], before, _relative(geometry, known))


def _tried(bench: Bench, limits: Limits, seed: int) -> Array:
    """Currents under which the platform rests within the limits, (m, n)."""
    model, generator = bench.model, np.random.default_rng(seed)
    most = model.drive.current_limits_A[:, 1]
    found = []
    for _ in range(CANDIDATES):
        row = np.zeros(model.n_cables)
        together = generator.integers(1, MOST_TOGETHER + 1)
        motors = generator.choice(model.n_cables, together, replace=False)
        row[motors] = np.minimum(generator.choice(LEVELS_A, together), most[motors])
        try:
            rest = static_pose(model, row)
        except ValueError:  # no stable rest under these
            continue
        if within(bench, limits, rest.pose, rest.tensions_N):
            found.append(row)
    return np.array(found).reshape(-1, model.n_cables)


def _information(bench: Bench, seen: StaticPoses) -> Array:
    """What each pose tells of the unknowns, its own place being unknown, (n_p, k, k).

    The angles scatter by their counts and by what the measured pose leaves open.
    """
    model, asked = bench.model, bench.asked
    turns = evaluate(length_slope(model, asked.members), seen.poses, model.declared)
    by_zero = zero_turns(model, model.declared, CENTRE, asked)[1]
    rows = by_zero - turns[2] @ asked.spread
    by_pose = turns[1] @ pose_map(seen.poses)
    scatter = by_pose @ (seen.pose_std**2 * np.eye(6)) @ np.swapaxes(by_pose, -1, -2)
    scatter = scatter + seen.angle_std_rad**2 * np.eye(model.n_cables)
    return np.swapaxes(rows, -1, -2) @ np.linalg.solve(scatter, rows)


def _relative(bench: Bench, information: Array) -> Array:
    sizes = bench.sizes
    unit = information * np.outer(sizes, sizes)
    if np.linalg.matrix_rank(unit) < len(sizes):
        return np.full(len(sizes), np.inf)
    return np.sqrt(np.diag(np.linalg.inv(unit)))


def at_rest(bench: Bench, currents: Array) -> StaticPoses:
    """Poses at rest under held currents (n_p, n), as exact readings with their deviations.

    Raises:
        ValueError: when there is no rest under one of them.
    """
    model, noise = bench.model, bench.noise
    poses = np.array([static_pose(model, row).pose for row in currents])
    angles = motor_angles(model, poses, CENTRE, model.declared)
    std = noise.pose_std / np.sqrt(STATIC_SAMPLES)
    return StaticPoses(currents, angles, poses, std, noise.angle_std_rad)
