"""Whether marker files are in another unit than target.toml, by how far markers are apart."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.markers.distances import distances, pairs_of, typical_distances
from freeswing.cdpr.measured.marker_recording import MarkerRecording

Array = NDArray[np.float64]

# mm, cm, dm, inch and foot for m, and inch for mm; layouts are measured to better than 3 %.
UNIT_FACTORS = (1000.0, 100.0, 10.0, 1.0 / 0.0254, 1.0 / 0.3048, 25.4)
UNIT_TOLERANCE = 0.03
SMALLEST_PLATFORM_M = 0.02
LARGEST_PLATFORM_M = 10.0


def far_apart(recording: MarkerRecording) -> list[str]:
    """What is to be said of markers farther apart than any platform is large, else nothing."""
    apart = typical_distances(recording.positions_m, pairs_of(len(recording.names)))
    widest = float(np.max(apart[np.isfinite(apart)], initial=0.0))
    if widest < LARGEST_PLATFORM_M:
        return []
    return [
        f"its markers are up to {widest:.4g} m apart: if they are of one platform, "
        f"{recording.source} states another unit than its numbers have"
    ]


def unit_between(layout: Array, apart: Array) -> tuple[float, bool] | None:
    """Factor of a wrong unit between a layout and distances (n_p,), and whether the layout has it.

    None where the sizes are of one unit. The one whose size no platform has is wrong.
    """
    wanted = distances(layout, pairs_of(len(layout)))
    known = np.isfinite(apart) & (wanted > 0.0)
    if not known.any():
        return None
    ratio = float(np.median(apart[known] / wanted[known]))
    for unit in UNIT_FACTORS:
        for factor in (unit, 1.0 / unit):
            if abs(ratio / factor - 1.0) < UNIT_TOLERANCE:
                size = float(wanted.max())
                return factor, not SMALLEST_PLATFORM_M < size < LARGEST_PLATFORM_M
    return None
