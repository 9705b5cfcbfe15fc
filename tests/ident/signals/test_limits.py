"""From which numbers on a stretch is a swing and a run is usable: both sides of each limit."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.ident.signals import derivatives, usable_runs
from freeswing.ident.signals import jumps as module
from freeswing.ident.signals.constant_lengths import mean_lengths
from freeswing.ident.signals.derivatives import SignalSettings, UnusableRunError
from freeswing.ident.signals.window import free_window
from tests.ident.swings import paper_model, swing

RATE_RAD_S = 4.0


def window_of(pushed, duration_s=12.0):
    """The window of an oscillator whose acceleration is off by pushed(times)."""
    times = np.arange(0.0, duration_s, 0.04)
    value = 0.02 * np.sin(RATE_RAD_S * times)[:, None]
    velocity = 0.02 * RATE_RAD_S * np.cos(RATE_RAD_S * times)[:, None]
    acceleration = -(RATE_RAD_S**2) * value
    size = np.sqrt(np.mean(acceleration**2))
    off = size * pushed(times)[:, None]
    return free_window(times, value, velocity, acceleration + off, np.ones(1))


@pytest.mark.parametrize(("share", "is_swing"), [(0.33, True), (0.37, False)])
def test_how_much_of_an_acceleration_may_not_follow_from_the_pose(share, is_swing) -> None:
    """A shake at another frequency that is this share of the whole, root mean square."""
    strength = share / np.sqrt(1.0 - share**2)
    shaken = lambda times: strength * np.sqrt(2.0) * np.sin(25.0 * times)  # noqa: E731
    if is_swing:
        start, end = window_of(shaken)
        assert end - start > 4.0, (start, end)
    else:
        with pytest.raises(ValueError, match=r"no free swing found: at best 3[67] %"):
            window_of(shaken)


@pytest.mark.parametrize(("push", "end_s"), [(0.44, 11.96), (0.52, 6.04)])
def test_a_push_ends_the_free_motion(push, end_s) -> None:
    """Half of it follows from the mean over 0.3 s, half from the passes that let go more."""
    shaken = lambda times: push * np.sign(np.sin(25.0 * times + 0.3))  # noqa: E731
    _, end = window_of(lambda times: np.where(times > 6.0, shaken(times), 0.0))
    assert end == pytest.approx(end_s, abs=0.05), end


@pytest.mark.parametrize(("duration_s", "long_enough"), [(4.2, True), (3.8, False)])
def test_how_long_a_swing_must_be(duration_s, long_enough) -> None:
    if long_enough:
        start, end = window_of(np.zeros_like, duration_s)
        assert end - start > 3.8, (start, end)
    else:
        with pytest.raises(ValueError, match="no unbroken 4 s"):
            window_of(np.zeros_like, duration_s)


@pytest.mark.parametrize(("off_m", "usable"), [(0.0048, True), (0.0052, False)])
def test_lengths_that_vary(off_m, usable) -> None:
    """One cable is off for an instant: the platform dips along the cable's slope."""
    model = paper_model()
    rest = swing(5).zetas[0]
    poses = np.tile(rest, (1001, 1))
    slope = _length(model, rest - [0, 0, 1e-5, 0, 0, 0])
    slopes = (slope - _length(model, rest)) / 1e-5
    poses[500, 2] -= off_m / np.abs(slopes).max()
    signals = SimpleNamespace(values=poses)
    if usable:
        mean_lengths(model, signals)  # type: ignore[arg-type]
    else:
        with pytest.raises(UnusableRunError, match="limit 5 mm"):
            mean_lengths(model, signals)  # type: ignore[arg-type]


def _length(model, pose):
    from freeswing.cdpr.model.batch import evaluate

    return evaluate(model.lengths, pose, model.start_values)[0].ravel()


@pytest.mark.parametrize(("over", "usable"), [(5.2, True), (4.8, False)])
def test_motion_must_stand_out_of_its_noise(monkeypatch, over, usable) -> None:
    velocities = np.tile([[0.01, 0.0]], (100, 1))
    covariances = np.tile(np.diag([0.0, 0.0, 1.0, 1.0, 0.0, 0.0]) * (0.01 / over) ** 2, (100, 1, 1))
    signals = SimpleNamespace(
        coordinates=("x", "y"), velocities=velocities, covariances=covariances
    )
    monkeypatch.setattr(usable_runs, "signals_of", lambda *_: signals)
    if usable:
        assert usable_runs._checked_signals(None, SignalSettings()) is signals  # type: ignore[arg-type]
    else:
        with pytest.raises(UnusableRunError, match=r"is 4\.8 times the noise"):
            usable_runs._checked_signals(None, SignalSettings())  # type: ignore[arg-type]


@pytest.mark.parametrize(("amount", "serves"), [(19.0, True), (21.0, False)])
def test_free_coordinates_that_tell_the_pose(monkeypatch, amount, serves) -> None:
    """Full poses were measured: where the free ones do not tell them, they serve alone."""
    zetas = np.zeros((3, 6))
    full = SimpleNamespace(lengths_m=np.ones(4), zetas=zetas)
    monkeypatch.setattr(usable_runs, "full_motion", lambda *_: full)
    monkeypatch.setattr(usable_runs, "free_motion", lambda *_: full)
    monkeypatch.setattr(usable_runs, "amplification", lambda *_: np.array([1.0, amount]))
    signals = SimpleNamespace(coordinates=POSE_COORDINATES, select=lambda free: None)
    run = SimpleNamespace(lengths_m=None)
    found, told = usable_runs._prepared(paper_model(), run, signals, ("x", "y"))  # type: ignore[arg-type]
    assert told == amount
    assert (found.free is not None) == serves, found.why_not_free
    assert ("limit 20" in found.why_not_free) == (not serves), found.why_not_free


def test_a_tenth_of_a_second_after_letting_go_is_left_out() -> None:
    start, _ = window_of(np.zeros_like)
    assert 0.09 < start < 0.11, start


@pytest.mark.parametrize(("size_m", "jumps"), [(0.076, 0), (0.084, 1)])
def test_a_jump_is_eight_times_the_usual_extrapolation_error(monkeypatch, size_m, jumps) -> None:
    sizes = np.full((101, 1), 0.01)
    sizes[50] = size_m
    monkeypatch.setattr(module, "jump_sizes", lambda _: (sizes, 1.0))
    monkeypatch.setattr(module, "white_noise_std", lambda _: np.zeros(1))
    limit = np.array([SignalSettings().jump_limit_m])
    assert module.jumps_in(sizes, limit).sum() == jumps


@pytest.mark.parametrize(("size_m", "jumps"), [(0.38, 0), (0.42, 1)])
def test_a_jump_is_eight_deviations_of_the_noise(monkeypatch, size_m, jumps) -> None:
    """Noise of 10 mm that an extrapolation enlarges five times, about a run that hardly moves."""
    sizes = np.full((101, 1), 0.01)
    sizes[50] = size_m
    monkeypatch.setattr(module, "jump_sizes", lambda _: (sizes, 5.0))
    monkeypatch.setattr(module, "white_noise_std", lambda _: np.full(1, 0.01))
    assert module.jumps_in(sizes, np.full(1, 1e-3)).sum() == jumps


@pytest.mark.parametrize(("n", "enough"), [(9, False), (10, True)])
def test_more_samples_than_the_nine_parameters(monkeypatch, n, enough) -> None:
    unbroken = np.arange(20) < n
    monkeypatch.setattr(derivatives, "_unbroken", lambda *_: unbroken)
    monkeypatch.setattr(derivatives, "_apply", lambda *_: (0.0, 0.0, 0.0))
    monkeypatch.setattr(derivatives, "free_window", lambda *_: (1.0, 2.0))
    run = SimpleNamespace(window_s=None, trajectory=SimpleNamespace(coordinates=("x",)))
    grid, kernels = SimpleNamespace(times_s=np.arange(20.0)), SimpleNamespace(half=2)
    asked = run, grid, np.zeros((20, 1)), np.zeros(20, bool), kernels
    if enough:
        assert derivatives._window(*asked) == (1.0, 2.0)  # type: ignore[arg-type]
    else:
        with pytest.raises(UnusableRunError, match="no unbroken stretch"):
            derivatives._window(*asked)  # type: ignore[arg-type]
