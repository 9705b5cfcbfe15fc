"""One fit for every kind of unknown: runs, named blocks, and how; one solution.

What is minimised is the sum of squares of all runs' whitened residuals and of the unknowns'
distances from what is known of them. Which search goes down, and how each run's own unknowns are
eliminated on the way, is the settings' affair: `Dense` of `ident.likelihood.fit_blocks` for runs
that tell their slopes by block, `FreeSwing` of `ident.likelihood.fit_swings` for free swings.
"""

from __future__ import annotations

from collections.abc import Sized
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from freeswing.cdpr.descent import Stop
from freeswing.cdpr.robot import Array
from freeswing.ident.likelihood.unknowns import Mask, Unknowns

RANK_LIMIT = 1e-9  # singular values of the scaled triangle below so much of the largest are none


@dataclass(frozen=True, slots=True)
class Solution:
    """What a fit gave.

    Attributes:
        unknowns: at the minimum.
        covariance: of all shared unknowns in the order of their blocks, zero where held, infinite
            on the diagonal where the rank does not suffice.
        cost: sum of the squared whitened residuals and prior distances.
        residuals: of each run, whitened.
        singular_values: of the scaled triangle in the estimated shared unknowns, descending.
        rank: how many of them count.
        steps: taken.
        stop: why it ended.
    """

    unknowns: Unknowns
    covariance: Array
    cost: float
    residuals: tuple[Array, ...]
    singular_values: Array
    rank: int
    steps: int
    stop: Stop

    @property
    def reason(self) -> str:
        """Why it ended, a sentence."""
        return self.stop.sentence

    @property
    def converged(self) -> bool:
        """Whether it ended because nothing could be gained any more."""
        return self.stop.converged

    def place(self, name: str) -> slice:
        """Where a shared block stands in the covariance."""
        return self.unknowns.place(name)

    def value(self, name: str) -> Array:
        """Values of a block."""
        return self.unknowns.value(name)

    def covariance_of(self, *names: str) -> Array:
        """Joint covariance of some shared blocks."""
        places = self.unknowns.columns(*names)
        return self.covariance[np.ix_(places, places)]

    def std(self, name: str) -> Array:
        """Standard deviations of a shared block."""
        return np.sqrt(np.diag(self.covariance_of(name)))


Runs = TypeVar("Runs", bound=Sized, contravariant=True)
Found = TypeVar("Found", bound=Solution, covariant=True)


class How(Protocol[Runs, Found]):
    """How to fit: a search with its settings, for one kind of runs."""

    def fitted(self, swings: Runs, unknowns: Unknowns, /) -> Found:
        """The solution; the unknowns have as many rows as there are runs."""
        ...


def fit(swings: Runs, unknowns: Unknowns, how: How[Runs, Found]) -> Found:
    """Minimise the sum of squares of all runs' residuals and the unknowns' prior distances.

    Args:
        swings: the runs.
        unknowns: where to start; blocks of each run have one row a run.
        how: settings, which say what kind of runs they fit.

    Raises:
        ValueError: without a run, with a block of other runs, or when the start itself has no
            residuals, naming the run.
    """
    if not len(swings):
        raise ValueError("no run to fit")
    for block in unknowns.own:
        if len(block.value) != len(swings):
            count = len(block.value)
            raise ValueError(f"unknown {block.name}: values of {count} runs for {len(swings)}")
    return how.fitted(swings, unknowns)


def shared_covariance(triangle: Array, determined: bool, free: Mask, scale: Array) -> Array:
    """Covariance of the shared unknowns, (p, p), zero where held.

    Args:
        triangle: R of the scaled problem in those that are estimated, (f, f).
        determined: whether its rank suffices; else their variances are infinite.
        free: which are estimated, (p,).
        scale: of all of them, (p,).

    Source:
        Bjoerck 1996, Numerical Methods for Least Squares Problems, sec. 2.8.
    """
    covariance = np.zeros((len(free), len(free)))
    places = np.flatnonzero(free)
    if not determined:
        covariance[places, places] = np.inf
    elif len(places):
        inverse = np.linalg.inv(triangle) * scale[free][:, None]
        covariance[np.ix_(places, places)] = inverse @ inverse.T
    return covariance
