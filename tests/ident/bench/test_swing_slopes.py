"""What a bench's fit is made of, against finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import Cable, Robot
from freeswing.cdpr.rotation import exp_rotation
from freeswing.ident.bench.assemble import EFFECTS, assembled
from freeswing.ident.bench.channels import Channel
from freeswing.ident.bench.objects import body_of, moments, moments_slope, specific, specific_slope
from freeswing.ident.bench.runs import Bench, BenchRun, KnownBody, Load, Placed, Signal

BODY = np.array([0.8, 0.01, -0.02, 0.03, 0.006, 0.007, 0.009, 1e-4, -2e-4, 3e-4])


def slope_by_differences(function, at: np.ndarray, step: float = 1e-6) -> np.ndarray:
    rows = [
        (function(at + step * one) - function(at - step * one)) / (2.0 * step)
        for one in np.eye(len(at))
    ]
    return np.array(rows).T


def test_moments_and_their_slopes() -> None:
    turn, shift = exp_rotation(np.array([0.3, -0.8, 1.1])), np.array([0.1, -0.05, 0.2])
    expected = slope_by_differences(lambda body: moments(body, turn, shift), BODY)
    np.testing.assert_allclose(moments_slope(BODY, turn, shift), expected, atol=1e-8)
    total = moments(BODY, turn, shift)
    np.testing.assert_allclose(
        specific_slope(total), slope_by_differences(specific, total), atol=1e-7
    )
    np.testing.assert_allclose(body_of(0.8, specific(moments(BODY))), BODY, atol=1e-15)


def test_a_turned_load_has_the_inertia_of_its_points() -> None:
    """Eight equal points, turned and shifted, are as heavy to turn as the sum of them."""
    generator = np.random.default_rng(3)
    points = generator.normal(0.0, 0.1, (8, 3))
    centre, off = points.mean(axis=0), points - points.mean(axis=0)
    tensor = np.mean([p @ p * np.eye(3) - np.outer(p, p) for p in off], axis=0)
    entries = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    body = np.concatenate([[1.0], centre, entries])
    turn, shift = exp_rotation(np.array([1.0, 0.4, -0.6])), np.array([0.02, 0.3, -0.1])
    placed = points @ turn.T + shift
    about_p = np.mean([p @ p * np.eye(3) - np.outer(p, p) for p in placed], axis=0)
    np.testing.assert_allclose(
        moments(body, turn, shift)[4:], about_p[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]], atol=1e-15
    )


def test_a_channel_is_its_taylor_polynomial() -> None:
    channel = Channel("dot", "dot_px", ("chi", "x"), order=3)
    assert channel.term_names[:5] == ("chi", "x", "chi*chi", "chi*x", "x*x")
    assert len(channel.terms) == 9
    gains = np.arange(1.0, 10.0)
    pose = np.array([0.02, 0.0, 0.0, 0.0, 0.0, 0.3])
    design = channel.design(pose[None])[0]
    assert design[0] == 0.3
    assert design[3] == pytest.approx(0.006)
    expected = slope_by_differences(lambda at: channel.design(at[None]) @ gains, pose)
    np.testing.assert_allclose(channel.slopes(pose[None], gains)[0], expected[0], atol=1e-8)
    with pytest.raises(ValueError, match=r"gains of theta"):
        Channel("dot", "dot_px", ("chi",), gains={"theta": 1.0})
    with pytest.raises(ValueError, match=r"order is 4"):
        Channel("dot", "dot_px", ("chi",), order=4)


def trifilar() -> Robot:
    angles = 2.0 * np.pi * np.arange(3) / 3.0
    ring = 0.25 * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    up = np.array([0.0, 0.0, 1.2])
    cables = tuple(Cable(str(k), end + up, 0.0, end) for k, end in enumerate(ring))
    return Robot("trifilar", cables)


def small_bench() -> Bench:
    """Three short runs of everything: chi with a load, a channel with a payload, poses of x, y."""
    times = np.linspace(0.0, 2.0, 60)
    chi, x = 0.1 * np.cos(5.0 * times), 0.004 * np.sin(2.8 * times)
    lengths, dot = np.full(3, 1.2), (Signal("dot_px", 900.0 * chi + x),)
    load = Placed("cube", exp_rotation(np.array([0.2, 0.0, 0.4])), np.array([0.01, 0.0, 0.05]))
    weight = KnownBody(0.3, np.array([0.1, 0.0, 0.0]), np.zeros(6))
    runs = (
        BenchRun("a", "identify", times, (Signal("chi", chi),), lengths, 1e-3, loads=(load,)),
        BenchRun("b", "identify", times, dot, lengths, payloads=(weight,)),
        BenchRun("c", "identify", times, (Signal("x", x), Signal("chi", chi)), lengths),
    )
    channels = (Channel("dot", "dot_px", ("chi", "x", "y"), order=2),)
    loads = (Load("cube", 0.7, 0.001, np.zeros(3), np.full(3, 0.002)),)
    return Bench(runs, channels, loads, mass_std_kg=0.01)


def test_every_slope_of_a_swing_is_that_of_differences() -> None:
    slopes_are_those_of_differences(small_bench())


def slopes_are_those_of_differences(bench: Bench, robot: Robot | None = None) -> None:
    """Every block of every run of a bench."""
    start = assembled(build_model(robot or trifilar(), EFFECTS), bench, bench.runs)
    for index, swing in enumerate(start.swings):
        values = {name: np.array(one) for name, one in start.unknowns.of_run(index).items()}
        values["effects"] = values["effects"] + [1e-3, 1e-2, 0.0]
        values["start"] = values["start"] + 0.01
        _, slopes = swing.linearised(values, swing.simulated(values))
        for name, slope in slopes.items():
            block = start.unknowns.block(name)
            for k in np.flatnonzero(block.mask)[:4]:
                step = 1e-3 * block.scale[k]
                ends = []
                for sign in (1.0, -1.0):
                    moved = {**values, name: values[name] + sign * step * np.eye(block.size)[k]}
                    ends.append(swing.residuals(moved, swing.simulated(moved)))
                expected = (ends[0] - ends[1]) / (2.0 * step)
                size = np.abs(expected).max() + 1e-3 / block.scale[k]
                off = np.abs(slope[:, k] - expected).max() / size
                assert off < 2e-3, (swing.name, name, k, off)
