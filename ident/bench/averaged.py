"""Densely sampled runs averaged to as many samples as a swing needs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.ident.bench.runs import BenchRun, Signal

RATE_HZ = 40.0  # averages over 25 ms: a swing of 2 Hz loses 0.4 % of its amplitude, all alike


def averaged(run: BenchRun) -> BenchRun:
    """The run with blocks of successive samples averaged, at most 40 to 80 a second.

    Nothing is lost: noise of neighbours averages out alike here and in the fit, and what is
    correlated between them says nothing about a swing a hundred times slower.
    """
    steps = np.diff(run.times_s)
    size = int((1.0 / RATE_HZ) / float(np.median(steps))) if len(steps) else 1
    if size < 2:
        return run
    count = len(run.times_s) // size
    blocks = run.times_s[: count * size].reshape(count, size)
    whole = np.ptp(blocks, axis=1) < 2.0 / RATE_HZ  # none over a gap
    signals = tuple(_averaged(signal, count, size, whole) for signal in run.signals)
    return replace(run, times_s=blocks.mean(axis=1)[whole], signals=signals)


def _averaged(signal: Signal, count: int, size: int, whole: Array) -> Signal:
    values = signal.values[: count * size].reshape(count, size).mean(axis=1)[whole]
    if signal.std is None:
        return replace(signal, values=values)
    std = signal.std[: count * size].reshape(count, size)
    # White noise averages out; noise that does not is found in the residuals' colour.
    return replace(signal, values=values, std=(np.sqrt((std**2).mean(axis=1) / size))[whole])
