"""Motions near one that is known with its derivatives: simplified Newton steps on its segments.

A step of a fit moves a motion by little. Its linear answer is then nearly the new motion, and all
segments' collocation equations are solved at once with the matrices that are there: a tenth of the
time of a simulation, to the same accuracy (Deuflhard, Newton Methods for Nonlinear Problems, 2011,
sec. 2.1.2).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.model.batch import evaluate, only
from freeswing.cdpr.robot import Array
from freeswing.cdpr.simulation.collocation import Table, table
from freeswing.cdpr.simulation.free_swing import (
    LARGEST_TAIL,
    SETTLED,
    Motion,
    check_start,
    check_swivels,
    tails,
)
from freeswing.cdpr.simulation.sensitivity import Factors, Linearised

SWEEPS = 15  # a simulation takes as long as thirty
LARGEST_RATIO = 0.7  # of a change to the last one: above, the motion is not near


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What leads from a motion to one nearby: slopes and factors that only precondition.

    Attributes:
        motion: the known one.
        columns: which of [zeta_0; rates_0; inertia; values] derivatives are by, (c,).
        accelerations: of the node accelerations by these, (s, 6 m, c).
        factors: of the collocation matrices there.
        by_start: of a segment's accelerations by its own start, (s, 6 m, 12).
        ends: of a segment's end by its start, (s, 12, 12).
    """

    motion: Motion
    columns: np.ndarray
    accelerations: Array
    factors: Factors
    by_start: Array
    ends: Array

    @classmethod
    def of(cls, linear: Linearised) -> Surroundings:
        """What is worth keeping of a linearised motion."""
        found = linear.accelerations
        flat = found.reshape(len(found), -1, found.shape[-1])
        factors, by_start, ends = linear.factors, linear.by_start, linear.ends
        return cls(linear.motion, linear.columns, flat, factors, by_start, ends)

    def motion_at(
        self, zeta: Array, rates: Array, inertia: Array, values: Array, tolerance_m: float
    ) -> Motion | None:
        """The motion from another start with other values, or None where it is not near enough.

        Args:
            zeta: pose coordinates at the start, (6,).
            rates: admissible ones, (6,).
            inertia: (9,).
            values: of the effects, (k,).
            tolerance_m: local error of a segment, as of `cdpr.simulation.free_swing.simulate`.

        Raises:
            ValueError: when the start is not one.
        """
        known = self.motion
        span = (float(known.starts_s[0]), known.end_s)
        check_start(known.model, span, zeta, rates, inertia, values, tolerance_m)
        change = np.concatenate(
            [
                zeta - known.zetas[0],
                rates - known.rates[0],
                inertia - known.inertia,
                values - known.values,
            ]
        )
        expected = self.accelerations @ change[self.columns]
        found = known.accelerations + expected.reshape(known.accelerations.shape)
        aimed = replace(known, inertia=inertia, values=values)
        moved = self._settled(aimed, np.concatenate([zeta, rates]), found, tolerance_m)
        if moved is None or tails(moved).max() > LARGEST_TAIL * tolerance_m:
            return None
        check_swivels(moved)
        return moved

    def _settled(
        self, aimed: Motion, start: Array, found: Array, tolerance_m: float
    ) -> Motion | None:
        """Newton's steps on all segments until they are negligible."""
        t = table(found.shape[1])
        squares = aimed.steps_s[:, None, None] ** 2
        times = aimed.starts_s[:, None] + aimed.steps_s[:, None] * t.nodes
        force = only(aimed.model.acceleration, 0)
        last = np.inf
        for _ in range(SWEEPS):
            aimed = _from(aimed, start, found, t)
            zetas, rates = _at_nodes(aimed, t)
            forces = evaluate(force, times, zetas, rates, aimed.inertia, aimed.values)[0]
            delta = self._answer((forces - found).reshape(len(found), -1), aimed, t)
            found = found + delta.reshape(found.shape)
            change = float(
                np.sqrt(np.sum((squares * delta.reshape(found.shape)) ** 2, (1, 2))).max()
            )
            if not change < LARGEST_RATIO * last:
                return None
            ratio = change / last if np.isfinite(last) else 1.0
            if change * ratio < SETTLED * tolerance_m:
                return _from(aimed, start, found, t)
            last = change
        return None

    def _answer(self, lacking: Array, aimed: Motion, t: Table) -> Array:
        """Change of all node accelerations (s, 6 m) that makes up for what they lack."""
        local = self.factors.solved(lacking)
        nodes = local.reshape(len(local), len(t.nodes), 6)
        step = aimed.steps_s[:, None]
        kicks = np.concatenate([step**2 * (t.twice_end @ nodes), step * (t.once_end @ nodes)], 1)
        states = np.zeros((len(local), 12))
        for k in range(len(local) - 1):
            states[k + 1] = self.ends[k] @ states[k] + kicks[k]
        return local + (self.by_start @ states[..., None])[..., 0]


def obeys(motion: Motion, tolerance_m: float) -> bool:
    """Whether a motion's accelerations are its model's, to what moves a segment by a tolerance."""
    t = table(motion.accelerations.shape[1])
    times = motion.starts_s[:, None] + motion.steps_s[:, None] * t.nodes
    state = (times, *_at_nodes(motion, t), motion.inertia, motion.values)
    lacking = evaluate(only(motion.model.acceleration, 0), *state)[0] - motion.accelerations
    moved = motion.steps_s[:, None, None] ** 2 * lacking
    return bool(np.sqrt(np.sum(moved**2, (1, 2))).max() < tolerance_m)


def _from(aimed: Motion, start: Array, found: Array, t: Table) -> Motion:
    """A motion whose segments join, from its start and node accelerations."""
    step = aimed.steps_s[:, None]
    gained = step * (t.once_end @ found)
    rates = start[6:] + np.vstack([np.zeros(6), np.cumsum(gained[:-1], axis=0)])
    moved = step * rates + step**2 * (t.twice_end @ found)
    zetas = start[:6] + np.vstack([np.zeros(6), np.cumsum(moved[:-1], axis=0)])
    return replace(aimed, zetas=zetas, rates=rates, accelerations=found)


def _at_nodes(motion: Motion, t: Table) -> tuple[Array, Array]:
    """Pose coordinates and rates at the Gauss nodes, (s, m, 6) each."""
    step = motion.steps_s[:, None, None]
    zetas = (
        motion.zetas[:, None]
        + step * t.nodes[:, None] * motion.rates[:, None]
        + step**2 * (t.twice @ motion.accelerations)
    )
    return zetas, motion.rates[:, None] + step * (t.once @ motion.accelerations)
