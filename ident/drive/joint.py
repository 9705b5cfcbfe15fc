"""Output error and the joint estimate: one likelihood over numbers, starts and static poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.cdpr.driven.sensitivity import N_POSE
from freeswing.cdpr.driven.slopes import moved
from freeswing.ident.drive.at_rest import turns_and_slopes
from freeswing.ident.drive.kinematics import StaticPoses, zero_turns
from freeswing.ident.drive.run_problem import (
    DriveRun,
    Noise,
    Seen,
    compared,
    score_matrix,
    simulated,
    start_pose,
)
from freeswing.ident.drive.solver import (
    MOST_ITERATIONS,
    SMALL_GAIN,
    Found,
    Normal,
    covariance_of,
    minimise,
)
from freeswing.ident.drive.unknowns import Asked

Array = NDArray[np.float64]

ON_BOUND = 1e-6


@dataclass(frozen=True, slots=True)
class Premise:
    """What a fit takes as given.

    Attributes:
        model: the equations.
        theta: numbers that are not asked for, at their values.
        runs: to identify from.
        noise: of the readings.
        zero_pose: where all angles are zero; None: L / r there is unknown.
        offsets: L / r where the angles are zero, a start or, without `free_offsets`, the truth.
        static: poses at rest that join in; None: none.
        free_offsets: whether the offsets are unknowns.
    """

    model: DrivenModel
    theta: Array
    runs: tuple[DriveRun, ...]
    noise: Noise
    zero_pose: Array | None
    offsets: Array
    static: StaticPoses | None = None
    free_offsets: bool = False


@dataclass(frozen=True, slots=True)
class Estimate:
    """A likelihood's maximum.

    Attributes:
        asked: the unknowns.
        values: (k,).
        covariance: counts how residuals of neighbouring samples go together, (k, k).
        determined: which the data determine, (k,).
        on_bound: which ended on a bound of the search, (k,).
        offsets: L / r where the angles are zero, (n,).
        theta: the model's numbers at the maximum.
        found: the search.
        autocorrelation: of the angles' residuals 10 ms apart, by run.
    """

    asked: Asked
    values: Array
    covariance: Array
    determined: NDArray[np.bool_]
    on_bound: NDArray[np.bool_]
    offsets: Array
    theta: Array
    found: Found
    autocorrelation: dict[str, float]

    @property
    def std(self) -> Array:
        """Standard deviations, (k,)."""
        return np.sqrt(np.diag(self.covariance))


class Problem:
    """The sum of squares of runs and static poses over all unknowns.

    Unknowns stand in this order: the numbers, offsets if free, each run's start (shift of its
    pose, then of the currents that were measured there), shifts of the static poses. A start
    current wrong by 5 mA leaves 5 mrad/s in its motor: more than the record can overlook.
    """

    def __init__(self, given: Premise, asked: Asked) -> None:
        self.given, self.asked = given, asked
        self.k = len(asked.groups)
        self.n_offsets = given.model.n_cables if given.free_offsets else 0
        self.n_shared = self.k + self.n_offsets
        self.n_static = 0 if given.static is None else len(given.static.poses)
        theta, zero = self.zero(asked.read(given.model, given.theta), given.offsets)[:2]
        self.starts = [start_pose(given.model, theta, run, zero) for run in given.runs]
        self.n_start = N_POSE + given.model.n_cables
        self.size = self.n_shared + self.n_start * len(given.runs) + 6 * self.n_static
        self.seen: list[Seen] = []
        self.at: Array = np.zeros(0)  # where `seen` was

    def start(self) -> Array:
        """Where the search begins, (size,)."""
        x = np.zeros(self.size)
        x[: self.k] = self.asked.read(self.given.model, self.given.theta)
        x[self.k : self.n_shared] = self.given.offsets[: self.n_offsets]
        return x

    def bounds(self) -> tuple[Array, Array]:
        """Least and greatest values, (size,) each."""
        low, high = np.full(self.size, -np.inf), np.full(self.size, np.inf)
        at = self.start()[: self.k]
        reach = self.asked.reach
        positive = at > 0.0
        low[: self.k][positive] = (at / reach)[positive]
        high[: self.k][positive] = (at * reach)[positive]
        model, first = self.given.model, len(self.given.model.numbers.names)
        for k, group in enumerate(self.asked.groups):
            place = model.index(group.members[0]) - first
            if place >= 0:  # an effect's own limits
                low[k], high[k] = model.parameters[place].low, model.parameters[place].high
        return low, high

    def zero(self, values: Array, offsets: Array) -> tuple[Array, Array, Array]:
        """Theta, L / r of zero angles (n,) and its slope by the shared unknowns."""
        given, n = self.given, self.given.model.n_cables
        theta = self.asked.put(given.model, given.theta, values)
        if given.free_offsets:
            return theta, offsets, np.hstack([np.zeros((n, self.k)), np.eye(n)])
        if given.zero_pose is None:
            return theta, given.offsets, np.zeros((n, self.k))
        return theta, *zero_turns(given.model, theta, given.zero_pose, self.asked)

    def normal(self, x: Array) -> Normal:
        """The normal equations at a point."""
        theta, zero, by_zero = self.zero(x[: self.k], x[self.k : self.n_shared])
        cost, gradient = 0.0, np.zeros(self.size)
        matrix, count, self.seen, self.at = np.zeros((self.size, self.size)), 0, [], x.copy()
        for r, run in enumerate(self.given.runs):
            own = self._own(r)
            pose, first = moved(self.starts[r], x[own][:N_POSE]), x[own][N_POSE:]
            flowing = run.record.currents_A[0] + first
            motion = simulated(self.given.model, theta, run, pose, flowing)
            seen = self._spread(compared(run, motion, zero, self.given.noise, self.asked), by_zero)
            part = _normal(seen)
            place = np.concatenate([np.arange(own.start, own.stop), np.arange(self.n_shared)])
            cost, count = cost + part.cost, count + part.n
            gradient[place] += part.gradient
            matrix[np.ix_(place, place)] += part.matrix
            self.seen.append(seen)
            known = 1.0 / self.given.noise.current_std_A**2
            at = np.arange(own.start + N_POSE, own.stop)
            cost, count = cost + known * (first @ first) / 2, count + len(first)
            gradient[at] += known * first
            matrix[at, at] += known
        static = self.given.static
        if static is None:
            return Normal(float(cost), gradient, matrix, count)
        for p in range(self.n_static):
            part, place = self._static(static, p, x, theta, zero, by_zero)
            cost, count = cost + part.cost, count + part.n
            gradient[place] += part.gradient
            matrix[np.ix_(place, place)] += part.matrix
        return Normal(float(cost), gradient, matrix, count)

    def scores(self, x: Array, at: Normal) -> Array:
        """Covariance of the gradient: the runs' own, white for the static poses, (size, size)."""
        total = at.matrix.copy()
        for r, seen in enumerate(self.seen):
            own = self._own(r)
            place = np.concatenate([np.arange(own.start, own.stop), np.arange(self.n_shared)])
            total[np.ix_(place, place)] += score_matrix(seen) - _normal(seen).matrix
        return total

    def _own(self, run: int) -> slice:
        first = self.n_shared + self.n_start * run
        return slice(first, first + self.n_start)

    def _spread(self, seen: Seen, by_zero: Array) -> Seen:
        """Slopes by start and all shared unknowns: the zero's own are added."""
        more = by_zero / self.given.noise.angle_std_rad
        by_angle, by_pose = seen.slopes
        shape = (*by_angle.shape[:2], self.n_start + self.n_shared)
        angles = np.zeros(shape)
        angles[..., : self.n_start + self.k] = by_angle
        angles[..., self.n_start :] += more
        poses = np.zeros((len(seen.poses), 6, shape[-1]))
        poses[..., : self.n_start + self.k] = by_pose
        return Seen(seen.motion, seen.angles, seen.poses, seen.rows, angles, poses)

    def _static(
        self, static: StaticPoses, p: int, x: Array, theta: Array, zero: Array, by_zero: Array
    ) -> tuple[Normal, NDArray[np.intp]]:
        n = self.given.model.n_cables
        own = self.n_shared + self.n_start * len(self.given.runs) + 6 * p + np.arange(6)
        pose = moved(static.poses[p], x[own])
        currents = static.currents_A[p]
        turns, *slopes = turns_and_slopes(self.given.model, pose, currents, theta, self.asked)
        weight = 1.0 / static.angle_std_rad
        rows = np.zeros((n + 6, self.n_shared + 6))
        rows[:n, : self.n_shared] = weight * by_zero
        rows[:n, : self.k] -= weight * slopes[1]
        rows[:n, self.n_shared :] = -weight * slopes[0]
        rows[n:, self.n_shared :] = np.diag(1.0 / static.pose_std)
        gaps = weight * (zero - turns - static.angles_rad[p])
        right = np.concatenate([gaps, x[own] / static.pose_std])
        part = Normal(float(right @ right) / 2, rows.T @ right, rows.T @ rows, len(right))
        return part, np.concatenate([np.arange(self.n_shared), own])


def estimate(
    given: Premise, asked: Asked, most: int = MOST_ITERATIONS, misfit_gain: float = SMALL_GAIN
) -> Estimate:
    """The most likely values of what is asked for, after `most` steps of the search at most.

    Args:
        given: what the fit takes as given.
        asked: the unknowns.
        most: steps tried.
        misfit_gain: the search ends at a step that gains less of its cost, where that is well
            above the noise's.

    Raises:
        ValueError: when the runs cannot be simulated from where the search begins.
    """
    problem = Problem(given, asked)
    low, high = problem.bounds()
    found = minimise(problem.normal, problem.start(), low, high, most, misfit_gain)
    at = found.normal
    if not np.array_equal(problem.at, found.values):  # its last step was not taken
        at = problem.normal(found.values)
    k = problem.k
    inverse, known = covariance_of(at.matrix)
    robust = _sandwich(inverse, problem.scores(found.values, at), known)
    # Scores vanish at the maximum, which hides part of what few samples carry: never below white.
    factor = np.sqrt(np.maximum(1.0, np.diag(robust) / np.diag(inverse))[:k])
    factor = np.where(known[:k], factor, 1.0)
    values = found.values[:k]
    theta, zero, _ = problem.zero(values, found.values[k : problem.n_shared])
    bound = np.minimum(values - low[:k], high[:k] - values) <= ON_BOUND * np.abs(values)
    return Estimate(
        asked,
        values,
        inverse[:k, :k] * np.outer(factor, factor),
        known[:k],
        bound,
        zero,
        theta,
        found,
        {seen[0].name: _lagged(seen[1]) for seen in zip(given.runs, problem.seen, strict=True)},
    )


def carried_over(given: Premise, asked: Asked, two_step: Estimate, kinematic: Array) -> Array:
    """Covariance that a two-step estimate has from its kinematics, (k, k).

    The implicit-function derivative -H_dd^-1 H_dk of the second step's minimum, starts included,
    instead of the paper's seven further fits.

    Args:
        given: the second step's premise.
        asked: kinematic and dynamic unknowns.
        two_step: the second step's estimate.
        kinematic: covariance of the first step, (n_kinematic, n_kinematic).

    Source:
        Newey, McFadden 1994, Large Sample Estimation and Hypothesis Testing, sec. 6: two
        steps.
    """
    given = Premise(
        given.model, two_step.theta, given.runs, given.noise, given.zero_pose, given.offsets
    )
    problem = Problem(given, asked)
    matrix = problem.normal(problem.start()).matrix
    first = asked.n_kinematic
    rest = np.arange(first, problem.size)
    inverse, _ = covariance_of(matrix[np.ix_(rest, rest)])
    inverse[~np.isfinite(inverse)] = 0.0
    slope = -inverse @ matrix[np.ix_(rest, np.arange(first))]
    carried = slope @ kinematic @ slope.T
    k = len(asked.groups) - first
    return carried[:k, :k]


def _sandwich(inverse: Array, scores: Array, known: NDArray[np.bool_]) -> Array:
    safe = np.where(np.isfinite(inverse), inverse, 0.0)
    safe[~known], safe[:, ~known] = 0.0, 0.0
    return safe @ scores @ safe


def _normal(seen: Seen) -> Normal:
    columns = np.vstack([part.reshape(-1, part.shape[-1]) for part in seen.slopes])
    right = np.concatenate([seen.angles.reshape(-1), seen.poses.reshape(-1)])
    return Normal(float(right @ right) / 2, columns.T @ right, columns.T @ columns, len(right))


def _lagged(seen: Seen) -> float:
    """Correlation of the angles' residuals with themselves 10 ms on."""
    lag = max(1, round(0.01 / (seen.motion.times_s[1] - seen.motion.times_s[0])))
    gaps = seen.angles - seen.angles.mean(axis=0)
    power = float(np.sum(gaps**2))
    return float(np.sum(gaps[lag:] * gaps[:-lag])) / power if power > 0.0 else 0.0
