"""One layout of markers for all runs of a session, and what places differ by between runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.markers.layout_against_target import align_to_target
from freeswing.cdpr.markers.layouts_aligned import (
    FREEDOM,
    LEAST_STD_M,
    SETTLED_M,
    Alignment,
    Array,
    Mask,
    align,
)

SESSION_ROUNDS = 10
# Scale of a marker's place from run to run where there is one run alone (Bologna: 0.2 to 0.6 mm).
RUN_STD_M = 3e-4


@dataclass(frozen=True, slots=True)
class SessionLayout:
    """One layout for all runs, and how much a marker's place differs from it in one run.

    Attributes:
        layout_m: markers, platform frame, (n_m, 3).
        change_m: those minus target.toml's, NaN for markers never seen, (n_m, 3).
        run_std_m: scale of a coordinate of a marker's change from run to run.
        from_target: how the layout lies on target.toml's.
    """

    layout_m: Array
    change_m: Array
    run_std_m: float
    from_target: Alignment | None


def session_layout(nominal: Array, runs: Sequence[Array], noise_m: float) -> SessionLayout:
    """The layout that all runs together have, in the frame that target.toml's markers give.

    Args:
        nominal: target.toml's places, (n_m, 3).
        runs: each run's own mean layout in a frame of its own, NaN where never seen, (n_m, 3).
        noise_m: what a run's mean layout is known to; the least scale.
    """
    layout, scale = nominal, RUN_STD_M
    for count in range(SESSION_ROUNDS):
        tried = (align(r, layout, scale) if count else align_to_target(r, layout) for r in runs)
        aligned = [found for found in tried if found is not None]
        if not aligned:
            return SessionLayout(nominal, np.full_like(nominal, np.nan), scale, None)
        changes = np.array([one.change_m for one in aligned])
        weights = np.array([one.weights for one in aligned])
        total = weights.sum(axis=0)
        step = np.nansum(weights[..., None] * changes, axis=0) / np.maximum(total, 1e-300)[:, None]
        layout = layout + step
        scale = _scale(changes - step, scale, noise_m)
        if np.abs(step).max() < SETTLED_M:
            break
    seen = np.asarray(np.isfinite(np.array(runs)).any(axis=(0, 2)))
    onto = align_to_target(np.where(seen[:, None], layout, np.nan), nominal)
    if onto is None:
        return SessionLayout(nominal, np.full_like(nominal, np.nan), scale, None)
    placed = np.where(seen[:, None], onto.points_m, nominal)
    return SessionLayout(placed, onto.change_m, scale, onto)


def _scale(changes: Array, scale_m: float, noise_m: float) -> float:
    """Scale of the changes (n_r, n_m, 3) that are left beside one layout, NaN where unknown.

    A step of expectation and maximisation from a scale: squares by Student's weights over the
    numbers that the frames of the runs and the layout leave free. Medians of what robust fits leave
    are a third too small.

    Source:
        Lange, Little, Taylor 1989, Robust statistical modeling using the t distribution.
    """
    known: Mask = np.asarray(np.isfinite(changes).all(axis=2))
    squares = np.sum(np.where(known[..., None], changes, 0.0) ** 2, axis=2)
    freedom = 3 * known.sum() - 6 * known.any(axis=1).sum() - 3 * known.any(axis=0).sum() + 6
    if freedom < 6:
        return RUN_STD_M
    weights = (FREEDOM + 3.0) / (FREEDOM + squares / scale_m**2)
    return max(float(np.sqrt(np.sum(weights * squares) / freedom)), noise_m, LEAST_STD_M)
