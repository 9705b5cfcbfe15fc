"""Step 1: kinematics from static poses, as published (18) and with poses as the noisy side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.cdpr.driven.slopes import length_slope, moved, pose_map
from freeswing.cdpr.model.batch import evaluate
from freeswing.ident.drive.solver import Found, Normal, covariance_of, minimise
from freeswing.ident.drive.unknowns import Asked

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class StaticPoses:
    """Readings at rest.

    Attributes:
        currents_A: (n_p, n).
        angles_rad: (n_p, n).
        poses: as measured, (n_p, 7).
        pose_std: of small translations and turns, (6,).
        angle_std_rad: of an encoder reading.
    """

    currents_A: Array
    angles_rad: Array
    poses: Array
    pose_std: Array
    angle_std_rad: float


@dataclass(frozen=True, slots=True)
class Kinematics:
    """Estimated geometry.

    Attributes:
        values: of the kinematic unknowns, (k,).
        covariance: (k, k).
        determined: which the poses determine, (k,).
        offsets_rad: L / r where each angle is zero, (n,).
        rms_rad: of the angles that are left.
        found: the search.
        poses: of the latent poses, (n_p, 7).
    """

    values: Array
    covariance: Array
    determined: NDArray[np.bool_]
    offsets_rad: Array
    rms_rad: float
    found: Found
    poses: Array


def zero_turns(model: DrivenModel, theta: Array, zero_pose: Array, asked: Asked) -> tuple:
    """L / r at the pose of zero angles (n,), and its derivative by the unknowns (n, k)."""
    found = evaluate(length_slope(model, asked.members), zero_pose, theta)
    slope = found[2] @ asked.spread if asked.members else np.zeros((model.n_cables, 0))
    return found[0], slope


def as_published(
    model: DrivenModel, theta: Array, asked: Asked, seen: StaticPoses, zero_pose: Array | None
) -> Kinematics:
    """(18): measured poses taken as exact, all the error in the angles; deviations by (19)."""
    k, n = len(asked.groups), model.n_cables
    start = [asked.read(model, theta)]
    if zero_pose is None:
        first = evaluate(length_slope(model), seen.poses, theta)[0] + seen.angles_rad
        start.append(first.mean(axis=0))

    def residuals(x: Array) -> tuple[Array, Array]:
        numbers = asked.put(model, theta, x[:k])
        found = evaluate(length_slope(model, asked.members), seen.poses, numbers)
        slopes = found[2] @ asked.spread
        return _angles(model, numbers, asked, zero_pose, x, found[0], slopes, seen)

    def normal(x: Array) -> Normal:
        gaps, jacobian = residuals(x)
        flat, columns = gaps.reshape(-1), jacobian.reshape(-1, len(x))
        return Normal(float(flat @ flat) / 2, columns.T @ flat, columns.T @ columns, len(flat))

    ended = minimise(normal, np.concatenate(start))
    gaps, _ = residuals(ended.values)
    variance = float(np.sum(gaps**2)) / max(1, gaps.size - len(ended.values))
    inverse, known = covariance_of(ended.normal.matrix)
    turns = _zero_of(model, theta, asked, zero_pose, ended.values)
    rms = float(np.sqrt(np.mean(gaps**2)))
    covariance = variance * inverse[:k, :k]
    return Kinematics(ended.values[:k], covariance, known[:k], turns[:n], rms, ended, seen.poses)


def most_likely(
    model: DrivenModel, theta: Array, asked: Asked, seen: StaticPoses, zero_pose: Array | None
) -> Kinematics:
    """Every true pose is unknown too, with its measurement as what is known of it."""
    first = as_published(model, theta, asked, seen, zero_pose)
    k, state = len(asked.groups), {"poses": seen.poses}
    start = [first.values]
    if zero_pose is None:
        start.append(first.offsets_rad)
    n_shared = sum(len(part) for part in start)
    n_poses = len(seen.poses)

    def normal(x: Array) -> Normal:
        poses = moved(seen.poses, x[n_shared:].reshape(n_poses, 6))
        state["poses"] = poses
        numbers = asked.put(model, theta, x[:k])
        found = evaluate(length_slope(model, asked.members), poses, numbers)
        slopes = found[2] @ asked.spread
        gaps, shared = _angles(model, numbers, asked, zero_pose, x, found[0], slopes, seen)
        by_pose = -(found[1] @ pose_map(poses))
        return _assembled(gaps, shared, by_pose, x, n_shared, seen)

    ended = minimise(normal, np.concatenate([*start, np.zeros(6 * n_poses)]))
    inverse, known = covariance_of(ended.normal.matrix)
    poses = moved(seen.poses, ended.values[n_shared:].reshape(n_poses, 6))
    numbers = asked.put(model, theta, ended.values[:k])
    turns = _zero_of(model, theta, asked, zero_pose, ended.values)
    gaps = turns - evaluate(length_slope(model), poses, numbers)[0] - seen.angles_rad
    rms = float(np.sqrt(np.mean(gaps**2)))
    return Kinematics(ended.values[:k], inverse[:k, :k], known[:k], turns, rms, ended, poses)


def _angles(model, numbers, asked, zero_pose, x, turns, slopes, seen):
    """Residuals of the angles (n_p, n) and slopes by the shared unknowns (n_p, n, k + offsets)."""
    k, n = len(asked.groups), model.n_cables
    if zero_pose is None:
        zero, by_zero = x[k : k + n], np.zeros((n, k))
    else:
        zero, by_zero = zero_turns(model, numbers, zero_pose, asked)
    gaps = zero - turns - seen.angles_rad
    jacobian = by_zero - slopes
    if zero_pose is None:
        ones = np.broadcast_to(np.eye(n), (len(gaps), n, n))
        jacobian = np.concatenate([jacobian, ones], axis=-1)
    return gaps, jacobian


def _assembled(gaps, shared, by_pose, x, n_shared, seen) -> Normal:
    """Normal equations of shared unknowns and one latent pose a row."""
    n_poses, size = len(gaps), len(x)
    matrix, gradient, cost = np.zeros((size, size)), np.zeros(size), 0.0
    weight = 1.0 / seen.angle_std_rad
    for p in range(n_poses):
        own = slice(n_shared + 6 * p, n_shared + 6 * p + 6)
        rows = np.zeros((gaps.shape[1] + 6, size))
        rows[: gaps.shape[1], :n_shared] = weight * shared[p]
        rows[: gaps.shape[1], own] = weight * by_pose[p]
        rows[gaps.shape[1] :, own] = np.diag(1.0 / seen.pose_std)
        right = np.concatenate([weight * gaps[p], x[own] / seen.pose_std])
        cost += right @ right / 2
        gradient += rows.T @ right
        matrix += rows.T @ rows
    return Normal(float(cost), gradient, matrix, gaps.size + 6 * n_poses)


def _zero_of(model, theta, asked, zero_pose, x) -> Array:
    k = len(asked.groups)
    if zero_pose is None:
        return x[k : k + model.n_cables]
    return zero_turns(model, asked.put(model, theta, x[:k]), zero_pose, asked)[0]
