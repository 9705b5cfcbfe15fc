"""One free swing as an experiment: what it excites and whether the robot can do it.

A swing from rest is settled by the pose in which it is released: the cable lengths are those of
that pose, and the equilibrium about which it swings follows from them (FIDIM 2022, sec. 4). Six
numbers therefore describe it, on which everything here depends smoothly.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.free_motion import amplification
from freeswing.cdpr.model.regressor import SwingMotion, regressor
from freeswing.cdpr.model.statics import Equilibrium, equilibrium_at_lengths, modes
from freeswing.cdpr.robot import Array
from freeswing.cdpr.simulation.free_swing import Motion, simulate

_GRID_S = 0.02
_CLOSING_STEPS = 20


@dataclass(frozen=True, slots=True)
class SwingLimits:
    """What a swing must keep (eq. 42), all along.

    Attributes:
        tension_N: smallest and largest cable tension.
        reach_m: largest departure of a free x y z from its equilibrium value.
        reach_rad: the same of a free phi theta chi.
        amplification: how many times more the platform may move than the free coordinates do.
        low_m: lowest x y z of P at equilibrium; None for the box below the pulleys.
        high_m: highest x y z of P at equilibrium.
    """

    tension_N: tuple[float, float] = (20.0, 200.0)
    reach_m: float = 0.1
    reach_rad: float = 0.3
    amplification: float = 10.0
    low_m: Array | None = None
    high_m: Array | None = None


@dataclass(frozen=True, slots=True)
class Swing:
    """A swing released from rest.

    Attributes:
        equilibrium: about which it swings; its lengths are the swing's.
        release: the pose let go, (6,).
        gram: W^T W of its samples, (10, 10).
        tension_N: smallest and largest tension along it.
        reach: largest departure of each free coordinate from equilibrium, (6 - n,).
        amplification: largest along it; see `cdpr.model.free_motion.amplification`.
        frequencies_hz: of the small oscillations about the equilibrium, (6 - n,).
    """

    equilibrium: Equilibrium
    release: Array
    gram: Array
    tension_N: tuple[float, float]
    reach: Array
    amplification: float
    frequencies_hz: Array


@dataclass(frozen=True, slots=True)
class Course:
    """A simulated swing on a fine grid.

    Attributes:
        motion: the simulation.
        times_s: (t,).
        zetas: (t, 6).
        tensions_N: (t, n).
    """

    motion: Motion
    times_s: Array
    zetas: Array
    tensions_N: Array


@dataclass(frozen=True, slots=True)
class Bench:
    """The robot, its nominal inertia and how swings are sampled.

    Attributes:
        model: without effects.
        inertia: nominal `INERTIA_NAMES` values, (9,).
        mass_kg: turns specific tensions into N.
        free: names of the free coordinates.
        limits: what every swing keeps.
        n_samples: samples a swing.
        duration_s: how long a swing is recorded.
    """

    model: Model
    inertia: Array
    mass_kg: float
    free: tuple[str, ...]
    limits: SwingLimits = field(default_factory=SwingLimits)
    n_samples: int = 100
    duration_s: float = 10.0

    @property
    def times_s(self) -> Array:
        """Sampling times, (n_samples,), the release included and the end not."""
        return np.arange(self.n_samples) * (self.duration_s / self.n_samples)

    @property
    def free_indices(self) -> list[int]:
        """Positions of the free coordinates in zeta."""
        from freeswing.cdpr.model.free_motion import coordinate_indices

        return coordinate_indices(self.free)

    @property
    def reach_limits(self) -> Array:
        """Largest departure of each free coordinate, (6 - n,)."""
        limits = self.limits
        reach = [limits.reach_m if k < 3 else limits.reach_rad for k in self.free_indices]
        return np.array(reach, dtype=np.float64)

    def course(self, release: Array, duration_s: float, tolerance_m: float = 1e-8) -> Course:
        """Simulate the swing from a release pose.

        Raises:
            ValueError: when the motion cannot be followed.
        """
        span = (0.0, duration_s)
        motion = simulate(
            self.model, release, np.zeros(6), span, self.inertia, None, tolerance_m, 0.8
        )
        times = np.linspace(0.0, duration_s, round(duration_s / _GRID_S) + 1)
        zetas = motion.at(times)[0]
        return Course(motion, times, zetas, self.mass_kg * motion.tensions(times))

    def regressor(self, motion: Motion) -> Array:
        """W' at the sampling times, (n_samples, 6 - n, 10); eqs. (21)-(25)."""
        zetas, rates, accelerations = motion.at(self.times_s)
        lengths = np.zeros(self.model.robot.n_cables)
        swing = SwingMotion("", self.free, self.times_s, zetas, rates, accelerations, lengths)
        return regressor(self.model, swing)

    def amplification(self, zetas: Array) -> float:
        """The largest along poses (t, 6)."""
        return float(np.max(amplification(self.model, self.free, zetas)))

    def lengths(self, pose: Array) -> Array:
        """Cable lengths at a pose, (n,)."""
        return evaluate(self.model.lengths, pose, self.model.start_values)[0]


def swing_from(bench: Bench, release: Array, equilibrium: Equilibrium | None = None) -> Swing:
    """Simulate and describe the swing released at a pose.

    Args:
        bench: how.
        release: (6,).
        equilibrium: that of the same lengths, or one near it to start from; found when None.

    Raises:
        ValueError: no stable taut equilibrium has these lengths, or the motion cannot be followed.
    """
    lengths = bench.lengths(release)
    near = release if equilibrium is None else equilibrium.zeta
    found = equilibrium_at_lengths(bench.model, lengths, near, bench.inertia)
    if found is None or not (found.stable and found.taut):
        raise ValueError(f"no stable taut equilibrium has the lengths {np.round(lengths, 4)} m")
    course = bench.course(release, bench.duration_s)
    stacked = bench.regressor(course.motion)
    tensions = course.tensions_N
    return Swing(
        equilibrium=found,
        release=np.array(release),
        gram=np.einsum("tij,tik->jk", stacked, stacked),
        tension_N=(float(tensions.min()), float(tensions.max())),
        reach=furthest(bench, course, found),
        amplification=bench.amplification(course.zetas),
        frequencies_hz=modes(bench.model, found, bench.inertia).frequencies_hz,
    )


def keeps_limits(bench: Bench, swing: Swing) -> bool:
    """Whether a swing keeps all limits."""
    low, high = bench.limits.tension_N
    return bool(
        swing.tension_N[0] >= low
        and swing.tension_N[1] <= high
        and (swing.reach <= bench.reach_limits).all()
        and swing.amplification <= bench.limits.amplification
        and in_workspace(bench, swing.equilibrium.zeta)
    )


def released(bench: Bench, equilibrium: Equilibrium, push: Array) -> Array:
    """The pose reached from an equilibrium along its free directions, lengths kept, (6,).

    Args:
        bench: the robot.
        equilibrium: where to start.
        push: metres (and radians) along an orthonormal basis of the free directions, (6 - n,).

    Raises:
        ValueError: when no pose of the same lengths is near.

    Source:
        FIDIM 2022, sec. 4: displaced with its lengths kept, eq. (5).
    """
    from scipy.linalg import null_space

    values = bench.model.start_values
    jacobian = evaluate(bench.model.cables, equilibrium.zeta, values)[3]
    pose = equilibrium.zeta + null_space(jacobian) @ push
    for _ in range(_CLOSING_STEPS):
        found = evaluate(bench.model.cables, pose, values)
        gap = found[0] - equilibrium.lengths_m
        if np.abs(gap).max() < 1e-12:
            return pose
        pose = pose - np.linalg.pinv(found[3]) @ gap
    raise ValueError(f"a push of {push} leads to no pose of the same lengths")


def furthest(bench: Bench, course: Course, rest: Equilibrium) -> Array:
    """Largest departure of each free coordinate from its rest along a course, (6 - n,)."""
    free = bench.free_indices
    return np.abs(course.zetas[:, free] - rest.zeta[free]).max(axis=0)


def workspace(bench: Bench) -> tuple[Array, Array]:
    """Lowest and highest x y z of P at equilibrium: as stated, or the box below the pulleys.

    Source:
        FIDIM 2022, sec. 5.1: the workspace of random equilibria.
    """
    entries = bench.model.robot.entries_m
    low, high = entries.min(axis=0), entries.max(axis=0)
    down = bench.model.robot.gravity_m_s2 / np.linalg.norm(bench.model.robot.gravity_m_s2)
    depth = float(np.linalg.norm(high - low))
    low, high = (
        np.minimum(low, low + 0.6 * depth * down),
        np.maximum(high, high + 0.6 * depth * down),
    )
    limits = bench.limits
    return (
        low if limits.low_m is None else np.asarray(limits.low_m, float),
        high if limits.high_m is None else np.asarray(limits.high_m, float),
    )


def in_workspace(bench: Bench, pose: Array) -> bool:
    """Whether P lies in the workspace."""
    low, high = workspace(bench)
    return bool((pose[:3] >= low).all() and (pose[:3] <= high).all())
