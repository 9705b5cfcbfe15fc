"""Recordings that stand in a session twice: they would count twice, or check themselves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.ident.runs import SwingRun

# A stretch of eight samples is told from others by its noise; coarse files repeat some of them by
# chance (a platform at rest), which never makes half of a swing.
STRETCH = 8
SHARED = 0.5  # of the shorter run's stretches


def refuse_repeated(swings: Sequence[SwingRun]) -> None:
    """Refuse runs whose windows hold the same samples.

    The same swing given twice narrows every deviation by 1.4 with nothing learnt; given to
    identify and to validate, it checks itself.

    Raises:
        DataError: naming the runs.
    """
    seen = [(swing, _part(swing)) for swing in swings]
    pairs = [
        (first.name, second.name)
        for k, (first, one) in enumerate(seen)
        for second, other in seen[k + 1 :]
        if share_samples(one, other)
    ]
    if pairs:
        told = "; ".join(f"{first} and {second}" for first, second in pairs[:5])
        more = f" and {len(pairs) - 5} more pairs" if len(pairs) > 5 else ""
        raise DataError(
            f"runs {told}{more} hold the same samples: they would count twice, or check "
            "themselves; keep one of them, or give them windows that do not overlap"
        )


def _part(swing: SwingRun) -> Trajectory:
    try:
        return swing.inside()
    except DataError:  # an empty window is said where the run is prepared
        return swing.trajectory


def share_samples(first: Trajectory, second: Trajectory) -> bool:
    """Whether half of the shorter one's stretches stand in both, bit for bit, at whatever times."""
    if first.coordinates != second.coordinates:
        return False
    one, other = _stretches(first), _stretches(second)
    fewest = min(len(one), len(other))
    return fewest > 0 and len(one & other) >= SHARED * fewest


def _stretches(trajectory: Trajectory) -> set[bytes]:
    rows = np.ascontiguousarray(trajectory.values[trajectory.is_known])
    return {rows[k : k + STRETCH].tobytes() for k in range(len(rows) - STRETCH + 1)}
