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

BAND = 3.0  # times the fastest swing: a cubic map moves power up to three times its frequency
LEAST_SHARE = 0.25  # of a band's degrees of freedom, which a fit cannot use up


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
