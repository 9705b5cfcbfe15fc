"""Dependent coordinates at given cable lengths, followed from sample to sample (FIDIM eq. 44).

A step between samples is taken whole where the tangent foretells it well, else in smaller and
smaller pieces: a solution that is far from foretold belongs to another assembly mode.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.model.batch import Bound
from freeswing.cdpr.robot import Array, finite

NEWTON_SWEEPS = 12
LEAST_PIECE = 2.0**-12
LARGEST_SURPRISE = 0.3
SLACK = 1e-6


@dataclass(frozen=True, slots=True)
class Assembly:
    """Poses that have given lengths and free coordinates.

    Attributes:
        zetas: (n_t, 6).
        determinants: sign-carrying det of the dependent block, (n_t,): zero at a singularity,
            where assembly modes meet.
    """

    zetas: Array
    determinants: Array


@dataclass(frozen=True, slots=True)
class _Pose:
    """A solved pose with what the next step needs."""

    zeta: Array
    lengths: Array
    jacobian: Array
    determinant: float


class Follower:
    """Moves along the poses of one assembly mode.

    Args:
        cables: (zeta, values) -> lengths (n,) and their Jacobian (n, 6).
        values: effect values, (k,).
        chosen: indices of the free coordinates.
        dependent: indices of the others.
        tolerance_m: residual of the lengths.
    """

    def __init__(
        self,
        cables: object,
        values: Array,
        chosen: list[int],
        dependent: list[int],
        tolerance_m: float,
    ) -> None:
        self._bound = Bound(cables, 1)
        self._bound.inputs[1][:] = values
        self._chosen, self._dependent, self._tolerance_m = chosen, dependent, tolerance_m

    def at(self, zeta: Array) -> _Pose:
        """Lengths and Jacobian at a pose."""
        self._bound.inputs[0][0] = zeta
        self._bound.run()
        jacobian = self._bound.outputs[1][0].T.copy()
        determinant = float(np.linalg.det(jacobian[:, self._dependent]))
        return _Pose(zeta.copy(), self._bound.outputs[0][0].copy(), jacobian, determinant)

    def to(self, pose: _Pose, wanted: Array, lengths_m: Array) -> _Pose | None:
        """The pose at `wanted` free coordinates and lengths, or None where the mode ends."""
        done, piece = 0.0, 1.0
        begin, begin_lengths = pose.zeta[self._chosen], pose.lengths
        while done < 1.0:
            ahead = min(1.0, done + piece)
            free = begin + ahead * (wanted - begin)
            lengths = begin_lengths + ahead * (lengths_m - begin_lengths)
            reached = self._step(pose, free, lengths)
            if reached is None:
                piece /= 2.0
                if piece < LEAST_PIECE:
                    return None
                continue
            pose, done, piece = reached, ahead, 2.0 * piece
        return pose

    def _step(self, pose: _Pose, free: Array, lengths_m: Array) -> _Pose | None:
        dependent, chosen = self._dependent, self._chosen
        zeta = pose.zeta.copy()
        along = pose.jacobian[:, chosen] @ (free - zeta[chosen])
        foretold = _solved(pose.jacobian[:, dependent], lengths_m - pose.lengths - along)
        if foretold is None:
            return None
        zeta[chosen] = free
        zeta[dependent] += foretold
        reached = self._newton(zeta, lengths_m)
        if reached is None:
            return None
        surprise = np.abs(reached.zeta[dependent] - zeta[dependent]).max()
        if surprise > LARGEST_SURPRISE * np.abs(foretold).max() + SLACK:
            return None
        same_side = np.sign(reached.determinant) == np.sign(pose.determinant)
        return reached if same_side and reached.determinant != 0.0 else None

    def _newton(self, zeta: Array, lengths_m: Array) -> _Pose | None:
        zeta = zeta.copy()
        for _ in range(NEWTON_SWEEPS):
            pose = self.at(zeta)
            gap = pose.lengths - lengths_m
            if not np.isfinite(gap).all():
                return None
            if np.abs(gap).max() <= self._tolerance_m:
                return pose
            step = _solved(pose.jacobian[:, self._dependent], gap)
            if step is None:
                return None
            zeta[self._dependent] -= step
        return None


def follow(
    follower: Follower, free: tuple[str, ...], lengths_m: Array, free_values: Array, start: Array
) -> Assembly:
    """Poses (n_t, 6) along free coordinates (n_t, 6 - n), from a start pose that settles the mode.

    Raises:
        ValueError: for wrong shapes or numbers that are not finite, and naming the sample at
            which the assembly mode ends.
    """
    free_values = np.asarray(free_values, dtype=np.float64)
    if free_values.ndim != 2 or free_values.shape[1] != len(free) or not len(free_values):
        raise ValueError(
            f"free_values has shape {free_values.shape}, must be (n_t, {len(free)}) with n_t >= 1"
        )
    pose = follower.at(finite("start", start, 6))
    if not np.isfinite(pose.lengths).all():
        raise ValueError(f"start {pose.zeta} has no cable lengths: {pose.lengths}")
    lengths_m = finite("lengths_m", lengths_m, len(pose.lengths))
    zetas, determinants = np.empty((len(free_values), 6)), np.empty(len(free_values))
    for sample, wanted in enumerate(free_values):
        if not np.isfinite(wanted).all():
            raise ValueError(f"sample {sample}: free coordinates {free} are {wanted}, not finite")
        reached = follower.to(pose, wanted, lengths_m)
        if reached is None:
            raise ValueError(
                f"sample {sample}: the cable lengths and the free coordinates {free} = "
                f"{np.array2string(wanted, precision=5)} give no pose continuous with the last "
                f"one (determinant there {pose.determinant:.1e}): the free coordinates pass a "
                'singularity; measure others, or set free_coordinates = "auto"'
            )
        pose = reached
        zetas[sample], determinants[sample] = pose.zeta, pose.determinant
    return Assembly(zetas, determinants)


def _solved(block: Array, right: Array) -> Array | None:
    """Solution, or None where the block is singular or the numbers are not finite."""
    try:
        found = np.linalg.solve(block, right)
    except np.linalg.LinAlgError:
        return None
    return found if np.isfinite(found).all() else None
