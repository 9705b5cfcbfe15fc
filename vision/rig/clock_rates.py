"""Cameras whose clocks run at different rates: one drifts away from the other along a run.

Quartz keeps its rate to some tens of millionths, so that two cameras part by some milliseconds in a
minute. What parts them faster is a wrong rate: of the two one has its frames at wrong times, and
inertia goes with the square of time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import DataError
from freeswing.vision.fuse.fuse_cameras import Fit
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.rig.real_effects import LEAST_CLOCK_S, is_real
from freeswing.vision.rig.rig_step import Finding, leaving_out, stretches
from freeswing.vision.rig.stamp_jitter import Lateness

Array = NDArray[np.float64]

MOST_APART = 2e-4
"""Quartz clocks keep their rate to 1e-4 where it is hot or cold; times off by more between two
cameras leave one of them wrong, and inertia by twice as much, beside deviations of 1e-3."""


@dataclass(frozen=True, slots=True)
class Rates:
    """By how much cameras' clocks run faster than those of most.

    Attributes:
        values: (n_c,).
        deviations: (n_c,).
        about_s: base time at which all show the same.
        half_s: from there to the first or last instant.
    """

    values: Array
    deviations: Array
    about_s: float
    half_s: float

    @property
    def real(self) -> NDArray[np.bool_]:
        """Which of them surely part a camera from the others by what matters, (n_c,)."""
        return is_real(self.values * self.half_s, self.deviations * self.half_s, LEAST_CLOCK_S)


def clock_rates(told: Lateness, poses: Poses, fit: Fit) -> Rates:
    """Rates of the cameras' clocks against each other, all zero where there is but one.

    Deviations are those of leaving out a quarter of a second at a time, or those of the equations
    where these are larger.

    Source:
        Press et al. 2007, Numerical Recipes, sec. 15.4: general linear least squares.
    """
    n_c, known, times = len(told.right), poses.known, poses.times_s
    if n_c < 2 or known.sum() < 2:
        return Rates(np.zeros(n_c), np.zeros(n_c), 0.0, 0.0)
    about = 0.5 * float(times[known][0] + times[known][-1])
    half = 0.5 * float(times[known][-1] - times[known][0])
    turns = np.stack([np.ones(len(times)), (times - about) / half], axis=1) * known[:, None]
    parts = []
    for stretch in range(int(stretches(times).max()) + 1):
        own = stretches(times) == stretch
        normal = np.einsum(
            "ni,ncd,nj->icjd", turns[own], told.normal[own], turns[own], optimize=True
        )
        right = np.einsum("ni,cn->ic", turns[own], told.right[:, own])
        parts.append((normal.reshape(2 * n_c, 2 * n_c), right.ravel()))
    whole = sum((part[0] for part in parts), np.zeros((2 * n_c, 2 * n_c)))
    pull = sum((part[1] for part in parts), np.zeros(2 * n_c))
    free = np.arange(2 * n_c) % n_c > 0  # against the first camera: what all do alike is no drift
    chosen = np.ix_(free, free)

    def solved(normal: Array, right: Array) -> Array:
        found = np.zeros(2 * n_c)
        found[free] = np.linalg.pinv(normal[chosen], hermitian=True) @ right[free]
        return -(found[n_c:] - np.median(found[n_c:]))  # most are right; of two each half

    inverse = np.zeros((2 * n_c, 2 * n_c))
    inverse[chosen] = np.linalg.pinv(whole[chosen], hermitian=True)
    apart = np.eye(n_c) - 1.0 / n_c
    excess = max(fit.total[0] / max(fit.total[1], 1), 1.0)
    own = np.sqrt(np.diag(apart @ inverse[n_c:, n_c:] @ apart) * excess)
    left = leaving_out(np.array([solved(whole - n, pull - r) for n, r in parts]))
    return Rates(solved(whole, pull) / half, np.maximum(own, left) / half, about, half)


def refuse_far_apart(views: Sequence[CameraViews], rates: Rates) -> None:
    """Passes cameras whose clocks run alike, but for what clocks are.

    Raises:
        DataError: naming both and by how much.
    """
    told = np.where(rates.real, rates.values, 0.0)  # what is not sure runs as most do
    fast, slow = int(np.argmax(told)), int(np.argmin(told))
    apart = float(told[fast] - told[slow])
    if apart > MOST_APART:
        names = [view.camera.name for view in views]
        raise DataError(
            f"cameras {names[fast]} and {names[slow]}: of what they saw the stamps of "
            f"{names[fast]} take {100.0 * apart:.3f} % longer: one of them has wrong times, and "
            "inertia would be off by up to twice as much. Its rate is another than stated, or "
            f"frames of {names[slow]} were lost while its stamps were counted on. Give the frames' "
            "own times (a csv with frame,t_s beside each video), or the rate that each camera has"
        )


def at_one_rate(
    views: Sequence[CameraViews], clocks_s: Array, rates: Rates
) -> tuple[list[CameraViews], list[Finding], list[str]]:
    """Cameras with stamps as clocks of one rate would have made them, what was found, in words.

    Args:
        views: with their own stamps.
        clocks_s: what has to be added to these for base time, (n_c,).
        rates: of their clocks.
    """
    now, findings, said = list(views), [], []
    for k in np.flatnonzero(rates.real).tolist():
        name, rate, std = views[k].camera.name, float(rates.values[k]), float(rates.deviations[k])
        about = rates.about_s - float(clocks_s[k])
        now[k] = views[k].restamped(views[k].stamps_s - rate * (views[k].stamps_s - about))
        numbers = (("rate", rate, std), ("about_s", about, 0.0))
        findings.append(Finding("clock_rate", name, numbers))
        said.append(
            f"{name}: of what the cameras saw its stamps take {1e6 * rate:+.0f} millionths longer "
            "than those of most (of two, than the mean): put right"
        )
    return now, findings, said
