"""Samples that lie a step away from the one before: no platform jumps, no smoother reaches across.

A step is where the samples before it, extrapolated, miss those after it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.robot import Array
from freeswing.ident.signals.regular_grid import jump_sizes, white_noise_std

# Deviations of the noise that an extrapolation error must exceed, whatever the limit.
_ABOVE_NOISE = 8.0
# Times the median extrapolation error that a step must exceed: 5.4 deviations, which normal errors
# exceed once in ten million samples.
_UNUSUAL = 8.0


def jumps_in(filled: Array, limit: Array) -> NDArray[np.bool_]:
    """True where a sample lies a step away from the one before it, (n,).

    Args:
        filled: samples on a regular grid, short gaps bridged, NaN in others, (n, c).
        limit: what no coordinate jumps by, (c,).

    Source:
        Hampel 1974, The Influence Curve and its Role in Robust Estimation: deviations by medians.
    """
    sizes, gain = jump_sizes(filled)
    limit = np.fmax(limit, _ABOVE_NOISE * gain * white_noise_std(filled))
    # A slowly sampled swing outruns the extrapolation everywhere; a step does so once.
    known = np.isfinite(sizes).all(axis=1)
    if known.any():
        limit = np.fmax(limit, _UNUSUAL * np.median(np.abs(sizes[known]), axis=0))
    magnitude = np.where(np.isfinite(sizes), np.abs(sizes), 0.0) / limit
    worst = magnitude.max(axis=1)
    # One step is felt by several neighbouring estimates: its place is the largest of them.
    padded = np.pad(worst, 4)
    largest = np.lib.stride_tricks.sliding_window_view(padded, 9).max(axis=1)
    return (worst > 1.0) & (worst >= largest)
