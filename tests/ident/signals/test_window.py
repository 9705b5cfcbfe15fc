"""Finding the free motion where the session does not state it."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.ident.runs import SwingRun
from freeswing.ident.signals.derivatives import UnusableRunError, signals_of
from tests.ident.swings import recorded, swing

RELEASE_S = 5.0


def session_of(equilibrium: int, noise_m: float, coordinates: tuple[str, ...]) -> SwingRun:
    """Rest, a hand that carries the platform away and holds it, release at 5 s, 10 s of swing."""
    motion = swing(equilibrium)
    generator = np.random.default_rng(equilibrium)
    free = recorded(motion, "r", None, 0.0, POSE_COORDINATES)
    zetas = free.trajectory.values
    rest = zetas.mean(axis=0)
    times = np.arange(1501) / 100.0
    early = times[: round(100 * RELEASE_S)]
    share = 0.5 - 0.5 * np.cos(np.pi * np.clip((early - 1.5) / 2.0, 0.0, 1.0))
    shake = 0.004 * np.sin(2 * np.pi * 3.1 * early) * ((early > 1.5) & (early < 3.5))
    led = rest + share[:, None] * (zetas[0] - rest) + shake[:, None]
    values = np.vstack([led, zetas])[: len(times)]
    noise = np.where(np.arange(6) < 3, noise_m, noise_m / 0.2)
    values = values + noise * generator.standard_normal(values.shape)
    columns = [POSE_COORDINATES.index(name) for name in coordinates]
    trajectory = Trajectory(times, coordinates, values[:, columns], None, "made")
    return SwingRun("r", "identify", trajectory, free.lengths_m)


@pytest.mark.parametrize("coordinates", [("x", "y"), POSE_COORDINATES])
@pytest.mark.parametrize("equilibrium", [3, 7, 11])
def test_the_window_starts_after_the_release_and_lasts(equilibrium: int, coordinates):
    start, end = signals_of(session_of(equilibrium, 1e-4, coordinates)).window_s
    assert RELEASE_S - 0.15 < start < RELEASE_S + 1.2, f"window {start:.2f} to {end:.2f} s"
    assert end > 14.3, f"window {start:.2f} to {end:.2f} s"


def test_a_recording_at_rest_holds_no_swing():
    generator = np.random.default_rng(0)
    times = np.arange(1001) / 100.0
    still = Trajectory(times, ("x", "y"), 1e-4 * generator.standard_normal((1001, 2)), None, "made")
    with pytest.raises(UnusableRunError, match="no free swing found"):
        signals_of(SwingRun("r", "identify", still))


def test_too_short_a_recording_says_so():
    times = np.arange(301) / 100.0
    short = Trajectory(times, ("x", "y"), np.column_stack([np.sin(9 * times)] * 2), None, "made")
    with pytest.raises(UnusableRunError, match="no unbroken 4 s"):
        signals_of(SwingRun("r", "identify", short))
