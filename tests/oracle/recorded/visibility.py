"""How visible the effects of a session are to an ideal observer who knows none of them.

The observer fits the plain model (true declared geometry, inertia, each run's lengths and initial
state) to the noise-free measurements with the session's own weights. What is left, in standard
deviations, is all that any diagnosis can go by: below about 5 an effect cannot be told from noise.
"""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.robot import POSE_COORDINATES
from tests.oracle.mechanics.equilibrium import (
    ROTATION_SCALE_M,
    freedom_of,
    jacobian_and_lengths,
    lengths_at,
)
from tests.oracle.mechanics.geometry import turn
from tests.oracle.mechanics.newton_euler import Motion, project, simulate, start_state
from tests.oracle.mechanics.world import Array, Body, World, plain_world
from tests.oracle.recorded.sessions import SessionTruth, measured, tait_bryan
from tests.oracle.scenes.robots import declared_robot

STEP_S = 5e-3
EVERY = 5  # of the samples; the others repeat what these tell
INERTIA_STEPS = np.full(9, 1e-6)
LENGTH_STEP_M, POSE_STEP_M, SPEED_STEP_M_S = 1e-7, 1e-6, 1e-5
MOST_ROUNDS = 12


def visibility(
    truth: SessionTruth,
    robot: str,
    pose: bool = True,
    noise_m: float = 1e-4,
    noise_rad: float = 5e-4,
    lengths_std_m: float = 5e-4,
    n_runs: int | None = None,
) -> float:
    """Root of the least chi-square of the plain model on noise-free data (the whole session).

    Args:
        truth: of the session.
        robot: "bologna-4" or "three-cable".
        pose: full poses, or the free coordinates alone.
        noise_m: weight of positions.
        noise_rad: weight of rotations.
        lengths_std_m: weight of the told lengths.
        n_runs: only the first runs, scaled up to all of them.
    """
    declared = declared_robot(robot)
    rows = None
    if not pose:
        rows = [POSE_COORDINATES.index(name) for name in declared.free_coordinates or ()]
    weights = np.array([1.0 / noise_m] * 3 + [1.0 / noise_rad] * 3) * np.sqrt(EVERY)
    runs = truth.runs[:n_runs]
    fits = [
        _RunFit(truth, k, plain_world(declared, truth.body), rows, weights, lengths_std_m)
        for k in range(len(runs))
    ]
    return _least_chi(fits, truth.body) * float(np.sqrt(len(truth.runs) / len(runs)))


def _least_chi(fits: list[_RunFit], body: Body) -> float:
    """Gauss-Newton with halved steps; the slopes are taken anew when they no longer help."""
    inertia = np.concatenate([body.com_m, body.specific_inertia_m2])
    nuisances = [fit.first_guess for fit in fits]
    residuals = [fit.residual(inertia, own) for fit, own in zip(fits, nuisances, strict=True)]
    slopes, fresh = [], False
    for _ in range(MOST_ROUNDS):
        if not fresh:
            slopes = [
                fit.slopes(inertia, own, r)
                for fit, own, r in zip(fits, nuisances, residuals, strict=True)
            ]
        shared, steps = _step(residuals, slopes)
        for share in (1.0, 0.5, 0.2, 0.05):
            tried = [own + share * step for own, step in zip(nuisances, steps, strict=True)]
            found = [
                fit.residual(inertia + share * shared, own)
                for fit, own in zip(fits, tried, strict=True)
            ]
            if _chi(found) < _chi(residuals):
                break
        gain = 1.0 - _chi(found) / max(_chi(residuals), 1e-12)
        if gain > 0.0:
            inertia, nuisances, residuals = inertia + share * shared, tried, found
        if fresh is False and gain < 0.01:
            break
        fresh = gain > 0.3
    return _chi(residuals)


def _chi(residuals: list[Array]) -> float:
    return float(np.sqrt(sum(r @ r for r in residuals)))


class _RunFit:
    """One run's residual as a function of the inertia and of its own nuisance parameters."""

    def __init__(
        self,
        truth: SessionTruth,
        k: int,
        plain: World,
        rows: list[int] | None,
        weights: Array,
        lengths_std_m: float,
    ) -> None:
        run = truth.runs[k]
        self.rows, self.weights, self.lengths_std_m = rows, weights, lengths_std_m
        self.body, self.duration_s = truth.body, float(run.motion.times_s[-1])
        self.stamps, self.points, self.quaternions = measured(truth.scene, run)
        self.told = run.world.length + truth.scene.length_bias_m
        self.start = start_state(plain, self.points[0], self.quaternions[0])
        lengths = lengths_at(plain, self.points[0], self.quaternions[0])
        self.world = plain._replace(length=lengths)
        J, _ = jacobian_and_lengths(self.world, self.start[:3], self.start[3:7])
        self.freedom = freedom_of(J)
        self.freedom[3:] /= ROTATION_SCALE_M
        moves = np.zeros(2 * self.freedom.shape[1])
        self.first_guess = np.concatenate([lengths - self.told, moves])

    def residual(self, inertia: Array, nuisance: Array) -> Array:
        """Weighted differences of samples and lengths."""
        n, f = len(self.told), self.freedom.shape[1]
        body = Body(self.body.mass_kg, inertia[:3], inertia[3:])
        world = self.world._replace(
            com=np.ascontiguousarray(inertia[:3]),
            inertia=body.inertia_p,
            length=self.told + nuisance[:n],
        )
        state = self.start.copy()
        move = self.freedom @ nuisance[n : n + f]
        state[:3] += move[:3]
        turn(state[3:7], move[3:])
        state[7:13] = self.freedom @ nuisance[n + f :]
        project(0.0, state, world)
        last = self.stamps[-1]
        motion = simulate(world, state[:3], state[3:7], last, state[7:13], 100.0, STEP_S)
        return np.concatenate([self._samples(motion), nuisance[:n] / self.lengths_std_m])

    def _samples(self, motion: Motion) -> Array:
        p, q = _at(motion, self.stamps)
        if self.rows is None:
            gaps = np.hstack([p - self.points, _between(self.quaternions, q)])
            return (gaps[::EVERY] * self.weights).ravel()
        gaps = np.hstack([p - self.points, tait_bryan(q) - tait_bryan(self.quaternions)])
        return (gaps[::EVERY, self.rows] * self.weights[self.rows]).ravel()

    def slopes(self, inertia: Array, nuisance: Array, here: Array) -> tuple[Array, Array]:
        """Columns of the inertia (9) and of the run's own parameters, by differences."""
        n, f = len(self.told), self.freedom.shape[1]
        steps = np.array([LENGTH_STEP_M] * n + [POSE_STEP_M] * f + [SPEED_STEP_M_S] * f)
        shared = [self.residual(inertia + e, nuisance) - here for e in np.diag(INERTIA_STEPS)]
        own = [self.residual(inertia, nuisance + e) - here for e in np.diag(steps)]
        return np.array(shared).T / INERTIA_STEPS, np.array(own).T / steps


def _step(
    residuals: list[Array], jacobians: list[tuple[Array, Array]]
) -> tuple[Array, list[Array]]:
    """Least-squares step: the runs' own parameters are eliminated, then found again."""
    left, right = [], []
    for r, (shared, own) in zip(residuals, jacobians, strict=True):
        q, _ = np.linalg.qr(own)
        left.append(shared - q @ (q.T @ shared))
        right.append(-r + q @ (q.T @ r))
    found: Array = np.linalg.lstsq(np.vstack(left), np.concatenate(right), rcond=1e-10)[0]
    steps: list[Array] = [
        np.linalg.lstsq(own, -r - shared @ found, rcond=1e-10)[0]
        for r, (shared, own) in zip(residuals, jacobians, strict=True)
    ]
    return found, steps


def _at(motion: Motion, stamps: Array) -> tuple[Array, Array]:
    if len(stamps) == len(motion.times_s) and np.allclose(stamps, motion.times_s, atol=1e-12):
        return motion.positions_m, motion.quaternions
    from scipy.interpolate import CubicSpline

    both = np.hstack([motion.positions_m, motion.quaternions])
    seen = CubicSpline(motion.times_s, both)(stamps)
    return seen[:, :3], seen[:, 3:] / np.linalg.norm(seen[:, 3:], axis=1, keepdims=True)


def _between(a: Array, b: Array) -> Array:
    """Small rotation vectors (base frame) from orientations a to b, (n_t, 3)."""
    w0, v0, w1, v1 = a[:, :1], a[:, 1:], b[:, :1], b[:, 1:]
    vector = w0 * v1 - w1 * v0 - np.cross(v1, v0)
    scalar = w0 * w1 + np.sum(v0 * v1, axis=1, keepdims=True)
    return 2.0 * vector * np.sign(scalar)
