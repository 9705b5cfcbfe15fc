"""Frames that come early or late by chance: how much, and how far it widens what is claimed.

A camera whose frame was stamped late by dt sees the platform along its motion from where the others
see it. What slow errors do to that dt cancels between neighbouring frames; what is left beyond the
pixels' noise is the stamps' own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.vision.fuse.blocks import blocks
from freeswing.vision.fuse.corner_noise import whitened
from freeswing.vision.fuse.fuse_cameras import Fit, free_of
from freeswing.vision.fuse.linearised_block import linearised
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.rig.rig_kernels import CLOCK, LINE
from freeswing.vision.rig.rig_step import RigStep

Array = NDArray[np.float64]

LEAST_JITTER_S = 1e-4
"""At 1 m/s less moves the platform by less than 0.1 mm, and cameras' own errors look like it."""
_LEAST_FRAMES = 20  # a median of so many steps is good to a fifth
_FLOOR_PX = 0.03
"""What lenses leave from frame to frame; the fit's own floor may hold the very jitter."""
_NORMAL_MAD = 1.4826
_VARIANCE_BY_MAD = 2.33
"""Relative deviation of a variance by the median of n absolute values, times the root of n."""
_SURE_SIGMAS = 4.0
"""Of that. Forty frames of a swing of millimetres tell 0.2 to 0.5 ms by chance, and poses that 1 ms
puts off by less than they claim."""


@dataclass(frozen=True, slots=True)
class Lateness:
    """Equations of how late each camera's frame is at each instant, the pose eliminated.

    Attributes:
        normal: (n, n_c, n_c); what is late alike in all is the pose's.
        right: (n_c, n).
        alone: of each camera if the pose were known, (n_c, n).
    """

    normal: Array
    right: Array
    alone: Array


def lateness(views: Sequence[CameraViews], watch: Watch, poses: Poses, fit: Fit) -> Lateness:
    """How late frames are, by what they miss the poses along their motion.

    Source:
        Triggs et al. 2000, Bundle Adjustment: A Modern Synthesis, sec. 6: poses eliminated.
    """
    n_c, n, size = len(views), len(poses.times_s), free_of(watch)
    right, alone = np.zeros((n_c, n)), np.zeros((n_c, n))
    cross, whole = np.zeros((n_c, n, size)), np.zeros((n, size, size))
    pull = np.zeros((n, size))
    for block in blocks(views, watch, poses.times_s, poses):
        linear = linearised(block, views, poses)
        white = whitened(block, fit.noise.at_most(_FLOOR_PX), views)
        rates = np.einsum("oij,oj->oi", white, linear.rates)
        misses = np.einsum("oij,oj->oi", white, linear.residuals)
        by_pose = white @ linear.jacobians[:, :, :size]
        instant = block.first + np.repeat(np.arange(len(block.starts) - 1), np.diff(block.starts))
        at = (block.camera_of, instant)
        np.add.at(right, at, (rates * misses).sum(axis=1))
        np.add.at(alone, at, (rates**2).sum(axis=1))
        np.add.at(cross, at, np.einsum("oia,oi->oa", by_pose, rates))
        np.add.at(pull, instant, np.einsum("oia,oi->oa", by_pose, misses))
        np.add.at(whole, instant, np.einsum("oia,oib->oab", by_pose, by_pose))
    # the pose moves with a late camera as far as the others let it (Schur complement)
    inverse = np.linalg.pinv(whole, rcond=1e-9, hermitian=True)
    normal = -np.einsum("cna,nab,dnb->ncd", cross, inverse, cross, optimize=True)
    normal[:, np.arange(n_c), np.arange(n_c)] += alone.T
    right -= np.einsum("cna,nab,nb->cn", cross, inverse, pull, optimize=True)
    return Lateness(normal, right, alone)


def stamp_jitter_s(told: Lateness) -> Array:
    """Standard deviation of each camera's stamps against the others', 0 where none shows, (n_c,).

    One camera alone shows none: there is nothing to hold its stamps against.

    Source:
        Press et al. 2007, Numerical Recipes, sec. 15.4: late stamps as unknowns of least
        squares, poses eliminated.
    """
    n_c = len(told.right)
    if n_c < 2:
        return np.zeros(n_c)
    weight = np.diagonal(told.normal, axis1=1, axis2=2).T
    late = told.right
    weight = np.where(weight > 1e-3 * told.alone, weight, 0.0)
    both = (weight > 0.0).sum(axis=0) > 1
    jitter = np.zeros(n_c)
    for index in range(n_c):
        mine = both & (weight[index] > 0.0)
        if mine.sum() < _LEAST_FRAMES:
            continue
        variance = 1.0 / weight[index, mine]
        sharp = variance <= np.median(variance)  # where the platform moves fast enough to tell
        steps = np.diff((late[index, mine] * variance)[sharp])
        spread = _NORMAL_MAD * float(np.median(np.abs(steps - np.median(steps)))) / np.sqrt(2.0)
        # against the other cameras' stamps, whose jitter is in it too: of n alike, one in n
        claimed = float(np.median(variance[sharp]))
        if spread**2 < claimed * (1.0 + _SURE_SIGMAS * _VARIANCE_BY_MAD / np.sqrt(len(steps))):
            continue
        excess = (spread**2 - claimed) * (n_c - 1) / n_c
        jitter[index] = np.sqrt(max(excess, 0.0))
    return np.where(jitter > LEAST_JITTER_S, jitter, 0.0)


def widened_step(step: RigStep, views: Sequence[CameraViews], jitter_s: Array) -> RigStep:
    """The step's clocks and line times with what jitter does to them."""
    deviations = step.deviations.copy()
    for index, view in enumerate(views):
        rows = np.concatenate([np.zeros(0), *(p.rows_px.mean(axis=1) for _, p in view.pieces())])
        frames = max(len(view.numbers), 1)
        spread = max(float(np.std(rows)), 1.0) if len(rows) else 1.0
        clock = jitter_s[index] / np.sqrt(frames)
        deviations[index, CLOCK] = np.hypot(deviations[index, CLOCK], clock)
        deviations[index, LINE] = np.hypot(deviations[index, LINE], clock / spread)
    return replace(step, deviations=deviations)
