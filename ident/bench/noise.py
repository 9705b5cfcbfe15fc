"""How noisy each column is, how coloured, and what scatters from run to run.

Residuals of tracks are correlated over many samples: what counts for the swing is their power near
its frequencies, so each column's noise is enlarged until white noise would have that power there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.ident.bench.swing import BenchSwing
from freeswing.ident.likelihood.fit import Solution
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown

BAND = 3.0  # times the fastest swing: a cubic map moves power up to three times its frequency
LEAST_SHARE = 0.25  # of a band's degrees of freedom, which a fit cannot use up
WIDE_SCATTER = 0.01  # of Izz: a run this far off is lost, not scattered
SIGNIFICANT = 2.71  # chi-square of one at 10 %: a scatter below is none


def column_residuals(swing: BenchSwing, white: Array) -> list[Array]:
    """A run's whitened residuals split by column."""
    counts = [int(column.known.sum()) for column in swing.columns]
    ends = np.cumsum(counts)
    return [white[end - count : end] for count, end in zip(counts, ends, strict=True)]


def rescaled(
    swings: Sequence[BenchSwing], found: Solution, fastest_hz: float, coloured: bool
) -> tuple[BenchSwing, ...]:
    """The swings with noise as large as their residuals say, colour included where asked.

    Args:
        swings: as they were fitted.
        found: the fit.
        fastest_hz: highest frequency of their small oscillations.
        coloured: whether power near the swing counts, and not the size alone.
    """
    shared = sum(int(block.mask.sum()) for block in found.unknowns.shared)
    own = sum(int(block.mask.sum()) for block in found.unknowns.own)
    columns = sum(len(swing.columns) for swing in swings)
    used = (shared + own * len(swings)) / columns
    colours = _colours(swings, found, fastest_hz, used) if coloured else {}
    scaled = []
    for swing, white in zip(swings, found.residuals, strict=True):
        parts = column_residuals(swing, white)
        news = []
        for column, part in zip(swing.columns, parts, strict=True):
            left = max(len(part) - used, LEAST_SHARE * len(part))
            size = np.sqrt(float(np.sum(part**2)) / left) * column.factor
            news.append(replace(column, factor=size * np.sqrt(colours.get(column.name, 1.0))))
        scaled.append(replace(swing, columns=tuple(news)))
    return tuple(scaled)


def _colours(
    swings: Sequence[BenchSwing], found: Solution, fastest_hz: float, used: float
) -> dict[str, float]:
    """Power near the swing over that of white noise of the same size, at least 1, by column."""
    low: dict[str, float] = {}
    whole: dict[str, float] = {}
    bins: dict[str, float] = {}
    total: dict[str, float] = {}
    for swing, white in zip(swings, found.residuals, strict=True):
        parts = column_residuals(swing, white)
        for column, part in zip(swing.columns, parts, strict=True):
            times = swing.times_s[column.known]
            period = float(np.median(np.diff(times)))
            power = np.abs(np.fft.rfft(part)) ** 2
            inside = np.fft.rfftfreq(len(part), period) <= BAND * fastest_hz
            freedom = 2.0 * float(inside.sum())
            name = column.name
            low[name] = low.get(name, 0.0) + float(power[inside].sum()) / float(power.sum())
            whole[name] = whole.get(name, 0.0) + 1.0
            bins[name] = bins.get(name, 0.0) + max(freedom - used, LEAST_SHARE * freedom)
            total[name] = total.get(name, 0.0) + len(part)
    return {name: max(1.0, (low[name] / whole[name]) / (bins[name] / total[name])) for name in low}


def scatter_block(runs: int, izz: float, std: float) -> Unknown:
    """What each run's Izz may be off by beyond its noise: rehanging, twisting, placing."""
    spread = np.full(runs, std)
    prior = Gaussian(np.zeros(runs), spread, "scatter between runs")
    return Unknown("scatter", np.zeros(runs), np.full(runs, 0.01 * izz), prior)


def scatter_std(found: Solution) -> float:
    """Standard deviation of what runs scatter by, from a fit with a wide prior for it; 0: none.

    The likelihood of the scatter alone, all else integrated out (Laird, Ware 1982).
    """
    values, covariance = found.value("scatter"), found.covariance_of("scatter")
    wide = float(found.unknowns.block("scatter").prior.std[0])  # type: ignore[union-attr]
    information = np.linalg.inv(covariance) - np.eye(len(values)) / wide**2
    pulled = np.linalg.inv(covariance) @ values
    sizes = wide * np.exp(np.linspace(-7.0, 0.0, 60))

    def cost(size: float) -> float:
        inside = np.eye(len(values)) + size**2 * information
        gain = pulled @ np.linalg.solve(information + np.eye(len(values)) / size**2, pulled)
        return float(np.linalg.slogdet(inside)[1] - gain)

    costs = np.array([cost(size) for size in sizes])
    best = int(np.argmin(costs))
    return float(sizes[best]) if costs[best] < -SIGNIFICANT else 0.0
