"""All free swings of one long recording, one after the other."""

from __future__ import annotations

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.ident.runs import SwingRun
from freeswing.ident.signals.derivatives import SignalSettings, UnusableRunError, signals_of
from freeswing.ident.signals.window import REFERENCE_S

Window = tuple[float, float]


def free_motions(trajectory: Trajectory, settings: SignalSettings | None = None) -> list[Window]:
    """Start and end of every stretch that swings freely, in time's order.

    The cleanest swing is found first (`free_window`), then the same is done before and after it,
    until what is left is shorter than a swing can be told from, or swings no longer.

    Args:
        trajectory: poses or any other coordinates.
        settings: how samples become signals.
    """
    found: list[Window] = []
    left = [(float(trajectory.times_s[0]), float(trajectory.times_s[-1]))]
    while left:
        start, end = left.pop()
        window = _one(trajectory, start, end, settings)
        if window is not None:
            found.append(window)
            left += [(start, window[0]), (window[1], end)]
    return sorted(found)


def _one(
    trajectory: Trajectory, start_s: float, end_s: float, settings: SignalSettings | None
) -> Window | None:
    """The cleanest free swing of a part; None where there is none."""
    if end_s - start_s <= REFERENCE_S:
        return None
    try:
        part = trajectory.window(start_s, end_s)
        return signals_of(SwingRun("part", "identify", part), settings).window_s
    except (DataError, UnusableRunError):
        return None
