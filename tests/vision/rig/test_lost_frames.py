"""Frames lost while the stamps were counted on, by one camera's own poses, and each limit."""

from __future__ import annotations

from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.rotation import exp_rotation
from freeswing.vision.rig import lost_frames as module
from freeswing.vision.rig.gross_faults import refuse_contradicting
from freeswing.vision.rig.lag_search import OwnTrack
from freeswing.vision.rig.lost_frames import (
    Loss,
    counted,
    is_strained,
    likeliest,
    lost_frames,
    unlikeliness,
    ways_to_lose,
)

RATE_HZ = 20.0
NOISE = np.array([1e-4, 1e-4, 5e-4, 2e-3, 2e-3, 5e-4])


def stub(**attributes: Any) -> Any:
    return SimpleNamespace(**attributes)


def swing(frames: np.ndarray, seed: int = 3) -> OwnTrack:
    """Three modes, as a camera sees these of the platform's frames, stamped one after another."""
    rng = np.random.default_rng(seed)
    t = frames / RATE_HZ
    modes = [np.exp(-0.02 * t) * np.cos(2 * np.pi * hz * t + hz) for hz in (0.8, 1.3, 1.45)]
    shapes = 0.1 * rng.normal(size=(3, 6)) + 0.05
    values = np.stack(modes, axis=1) @ shapes + NOISE * rng.normal(size=(len(t), 6))
    times = np.arange(len(t)) / RATE_HZ
    return OwnTrack(times, exp_rotation(values[:, 3:]), values[:, :3] + [0.0, 0.0, 2.0])


def without(*lost: int) -> OwnTrack:
    return swing(np.delete(np.arange(120), lost))


def test_nothing_lost_is_none() -> None:
    assert not lost_frames(without()).losses


@pytest.mark.parametrize("count", [1, 2, 3, 7, 12])
def test_frames_lost_at_one_place_are_counted(count) -> None:
    found = lost_frames(without(*range(60, 60 + count)))
    assert found.losses == (Loss(59, (count,)),)
    assert not found.unclear


def test_frames_lost_at_several_places() -> None:
    found = lost_frames(without(30, 64, 65, 95))
    assert found.losses == (Loss(29, (1,)), Loss(62, (2,)), Loss(91, (1,)))


def test_frames_lost_close_together() -> None:
    found = lost_frames(without(60, 64, 69))
    assert found.losses == (Loss(59, (1,)), Loss(62, (1,)), Loss(66, (1,)))


@pytest.mark.parametrize(("frames", "refused"), [((7, 8, 20, 21), False), ((6, 8, 9, 10), True)])
def test_frames_on_end_that_contradict(frames, refused) -> None:
    fit = stub(contradicting=((), frames))
    views = [stub(camera=stub(name=name)) for name in ("left", "right")]
    said = "right contradicts the others from frame 8 on .* 3 frames"
    with pytest.raises(DataError, match=said) if refused else nullcontext():
        refuse_contradicting(views, fit)


def test_a_gap_in_the_stamps_is_none() -> None:
    track = without(60, 61)
    times = track.times_s + 2 / RATE_HZ * (np.arange(118) >= 60)
    assert not lost_frames(OwnTrack(times, track.rotations, track.positions_m)).losses


def test_a_wrong_pose_and_a_knock_are_none() -> None:
    track = without()
    places = track.positions_m.copy()
    places[40, 2] += 0.02
    places[80:] += np.outer(track.times_s[80:] - track.times_s[80], [0.1, 0.0, 0.05])
    assert not lost_frames(OwnTrack(track.times_s, track.rotations, places)).losses


def test_what_hangs_at_rest_before_its_release_lost_nothing() -> None:
    track = without()
    places, turns = track.positions_m.copy(), track.rotations.copy()
    places[:40] = places[40] + 1e-4 * np.random.default_rng(1).normal(size=(40, 3))
    turns[:40] = turns[40]
    assert not lost_frames(OwnTrack(track.times_s, turns, places)).losses


@pytest.mark.parametrize(("frames", "enough"), [(42, True), (39, False)])
def test_few_frames_tell_nothing(frames, enough) -> None:
    assert (counted(np.arange(frames) / RATE_HZ) is not None) == enough


@pytest.mark.parametrize(("off", "regular"), [(0.065, True), (0.078, False)])
def test_stamps_lie_at_whole_steps(off, regular) -> None:
    steps = np.ones(99)
    steps[::3] += off
    assert (counted(np.cumsum(steps) / RATE_HZ) is not None) == regular


@pytest.mark.parametrize(("share", "regular"), [(0.07, True), (0.13, False)])
def test_most_of_them(share, regular) -> None:
    steps = np.ones(100)
    steps[: int(100 * share)] += 0.5
    assert (counted(np.cumsum(steps) / RATE_HZ) is not None) == regular


@pytest.mark.parametrize(
    ("least", "most", "strained"),
    [(2.2, 6.9, True), (1.8, 6.9, False), (2.2, 6.2, False), (np.inf, 9.0, False)],
)
def test_a_step_strains_all_stretches_about_it(least, most, strained) -> None:
    assert bool(is_strained(np.array([least]), np.array([most]))[0]) == strained


@pytest.mark.parametrize(
    ("margin", "fit", "counts"),
    [(17.0, 2.8, (1,)), (15.0, 2.8, (0, 1)), (17.0, 3.2, None)],
)
def test_how_sure_a_count_is(monkeypatch, margin, fit, counts) -> None:
    told = {0: (margin, 1.0), 1: (0.0, fit)}
    monkeypatch.setattr(module, "unlikeliness", lambda n, v, f, pattern, b: told[pattern[-1] - 7])
    ways = [(), ((3, 1),)]
    found = likeliest(np.arange(8), np.zeros((8, 6)), np.arange(8), ways, np.zeros(0, dtype=int))
    assert (None if found is None else found.counts) == counts


def test_more_than_twenty_are_not_asked_for() -> None:
    assert max(count for ((_, count),) in list(ways_to_lose([5]))[1:]) == 20


@pytest.mark.parametrize(("frames", "told"), [(36, True), (34, False)])
def test_a_covariance_needs_stretches(frames, told) -> None:
    values = np.random.default_rng(0).normal(size=(frames, 6))
    numbers, none = np.arange(frames), np.zeros(0, dtype=int)
    found = unlikeliness(numbers, values, np.arange(16), np.arange(16), none)
    assert (found is not None) == told
