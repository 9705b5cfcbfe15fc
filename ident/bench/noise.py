"""How noisy each column is, how coloured, and what scatters from run to run.

Residuals of tracks are correlated over many samples: what counts for the swing is their power near
its frequencies, so each column's noise is enlarged until white noise would have that power there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.ident.bench.swing import BenchSwing
from freeswing.ident.likelihood.fit import Solution

BAND = 3.0  # times the fastest swing: a cubic map moves power up to three times its frequency
LEAST_SHARE = 0.25  # of a band's degrees of freedom, which a fit cannot use up
# Power near the swing over that of white noise: of tracks it is 2 to 8 (their errors last over
# neighbouring samples), of what the model lacks hundreds.
COLOURED = 10.0
SLOWEST_PARTS = 0.25  # of the band up to half the sampling rate: where swings are


@dataclass(frozen=True, slots=True)
class Left:
    """What a fit leaves of a measured coordinate in all runs.

    Attributes:
        name: of the coordinate.
        colour: power near the swing over that of its white noise.
        rms: in m or rad.
        unit: "mm" or "mrad", in which it is said.
        strongest_hz: where most of it is.
    """

    name: str
    colour: float
    rms: float
    unit: str
    strongest_hz: float

    @property
    def sentence(self) -> str:
        """How much it is."""
        return (
            f"{self.name} is off by {1e3 * self.rms:.2g} {self.unit} rms, most near "
            f"{self.strongest_hz:.2g} Hz, {self.colour:.0f} times the power of its white noise"
        )


def left_worst(swings: Sequence[BenchSwing], found: Solution) -> Left | None:
    """The coordinate that a fit leaves farthest from white noise; None: none is far."""
    worst = None
    for name, (times, parts, unit) in _by_coordinate(swings, found).items():
        powers = [_powers(t, part) for t, part in zip(times, parts, strict=True)]
        low = float(np.mean([p[f <= SLOWEST_PARTS * f[-1]].mean() for f, p in powers]))
        high = float(np.mean([p[f > SLOWEST_PARTS * f[-1]].mean() for f, p in powers]))
        colour = low / max(high, 1e-300)
        if colour > (COLOURED if worst is None else worst.colour):
            strongest = max(powers, key=lambda one: float(one[1].max()))
            hertz = float(strongest[0][int(np.argmax(strongest[1]))])
            rms = float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
            worst = Left(name, colour, rms, unit, hertz)
    return worst


def _by_coordinate(
    swings: Sequence[BenchSwing], found: Solution
) -> dict[str, tuple[list[Array], list[Array], str]]:
    told: dict[str, tuple[list[Array], list[Array], str]] = {}
    for swing, white in zip(swings, found.residuals, strict=True):
        for column, part in zip(swing.columns, column_residuals(swing, white), strict=False):
            if column.coordinate is not None and len(part) > 8:
                unit = "mm" if column.coordinate < 3 else "mrad"
                times, parts, _ = told.setdefault(column.name, ([], [], unit))
                times.append(swing.times_s[column.known])
                parts.append(part * (column.factor * column.std)[column.known])
    return told


def _powers(times_s: Array, part: Array) -> tuple[Array, Array]:
    period = float(np.median(np.diff(times_s)))
    power = np.abs(np.fft.rfft(part)) ** 2 / len(part)
    return np.fft.rfftfreq(len(part), period)[1:], power[1:]


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
