"""Frames lost while the stamps were counted on, by one camera's own poses, and each limit."""

from __future__ import annotations

from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.rotation import exp_rotation
from freeswing.vision.rig.gross_faults import refuse_contradicting
from freeswing.vision.rig.lag_search import OwnTrack
from freeswing.vision.rig.lost import kinks
from freeswing.vision.rig.lost.lost_frames import (
    Loss,
    Told,
    counted,
    is_far_from_ends,
    likeliest,
    lost_frames,
    ways_to_lose,
)
from freeswing.vision.rig.lost.usual_stretches import Stretches, is_strained

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


@pytest.mark.parametrize(("every", "count"), [(5, 0), (5, 3), (4, 1)])
def test_a_film_of_which_every_so_many_frames_is_a_copy(every: int, count: int) -> None:
    """No six frames stand on end: noise had been NaN with a warning, and nothing was told."""
    frames = np.arange(160)
    kept = frames[(frames % every != every - 1) & ~((frames >= 60) & (frames < 60 + count))]
    stamps = kept - np.where(kept >= 60 + count, count, 0)
    track = swing(kept)
    found = lost_frames(OwnTrack(stamps / RATE_HZ, track.rotations, track.positions_m))
    assert [loss.frames for loss in found.losses] == ([(count,)] if count else [])


def test_of_stretches_that_are_all_of_their_own_nothing_is_told() -> None:
    """A gap in the stamps every few frames: none lies to its neighbours as twenty others do."""
    kept = np.cumsum(np.random.default_rng(2).choice([1, 1, 1, 1, 2], size=90))
    track = swing(kept)
    found = lost_frames(OwnTrack(kept / RATE_HZ, track.rotations, track.positions_m))
    assert not found.losses


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


def nothing_lost(seed: int, happens: str) -> OwnTrack:
    """A swing to which something happens between two frames: let go, kicked, or held in a hand."""
    rng = np.random.default_rng(seed)
    since = np.arange(120) / RATE_HZ - rng.uniform(1.2, 4.5)
    free = np.maximum(since, 0.0)[:, None]
    turns = 2 * np.pi * np.array([0.8, 1.3, 1.45])
    shapes = 0.1 * rng.normal(size=(3, 6)) + 0.05
    if happens == "kick":
        values = np.cos(since[:, None] * turns + turns) @ shapes
        values += np.sin(free * turns) @ rng.normal(scale=rng.choice([0.1, 0.03]), size=(3, 6))
    else:
        values = np.cos(free * turns + rng.choice([0.0, 1.0])) @ shapes
    if happens == "hand":
        tremors = np.sin(2 * np.pi * np.minimum(since, 0.0)[:, None] * rng.uniform(1, 6, size=5))
        values += tremors @ rng.normal(size=(5, 6)) * 4.0 * NOISE
    values += NOISE * rng.normal(size=values.shape)
    times = np.arange(120) / RATE_HZ
    return OwnTrack(times, exp_rotation(values[:, 3:]), values[:, :3] + [0.0, 0.0, 2.0])


@pytest.mark.parametrize("happens", ["release", "kick"])
@pytest.mark.parametrize("seed", range(10))
def test_what_is_let_go_or_knocked_lost_nothing(seed, happens) -> None:
    found = lost_frames(nothing_lost(seed, happens))
    assert (found.losses, found.unclear) == ((), ())


@pytest.mark.slow
@pytest.mark.parametrize("happens", ["release", "kick", "hand"])
@pytest.mark.parametrize("seed", range(60))
def test_what_is_let_go_or_knocked_anywhere_lost_nothing(seed, happens) -> None:
    found = lost_frames(nothing_lost(seed, happens))
    assert (found.losses, found.unclear) == ((), ())


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
    monkeypatch.setattr(Stretches, "unlikeliness", lambda s, f, pattern: told[pattern[-1] - 7])
    stretches = Stretches(np.arange(8), np.zeros((8, 6)), np.zeros(0, dtype=int))
    found = likeliest(stretches, np.arange(8), [(), ((3, 1),)])
    assert (None if found is None else found.counts) == counts


def test_more_than_twenty_are_not_asked_for() -> None:
    assert max(count for ((_, count),) in list(ways_to_lose([5]))[1:]) == 20


@pytest.mark.parametrize(("frames", "told"), [(36, True), (34, False)])
def test_a_covariance_needs_stretches(frames, told) -> None:
    values = np.random.default_rng(0).normal(size=(frames, 6))
    stretches = Stretches(np.arange(frames), values, np.zeros(0, dtype=int))
    found = stretches.unlikeliness(np.arange(16), np.arange(16))
    assert (found is not None) == told


@pytest.mark.parametrize(
    ("after", "count", "far"),
    [(5, 3, True), (5, 4, False), (15, 4, False), (16, 4, True), (103, 4, True), (104, 4, False),
     (60, 19, True), (60, 20, False)],
)  # fmt: skip
def test_more_than_three_need_frames_to_both_sides(after, count, far) -> None:
    told = Told(((after, count),), (count,), 99.0, frozenset(), 0.0)
    assert is_far_from_ends(told, 120) == far


def test_three_at_each_of_two_places_and_no_more() -> None:
    ways = [one for one in ways_to_lose([5, 6]) if len(one) == 2]
    assert max(ways) == ((5, 3), (6, 3))


@pytest.mark.parametrize(("steps", "three"), [(4, False), (5, True), (14, True), (15, False)])
def test_three_places_are_told_apart_within_fourteen_steps(steps, three) -> None:
    assert any(len(one) == 3 for one in ways_to_lose(list(range(steps)))) == three


def test_covariances_of_a_film_do_not_grow_with_it(monkeypatch) -> None:
    made = []
    usual = Stretches._made
    monkeypatch.setattr(Stretches, "_made", lambda s, p: made.append(tuple(p)) or usual(s, p))
    numbers = []
    for frames in (120, 1200):
        made.clear()
        assert not lost_frames(swing(np.arange(frames))).losses
        numbers.append(len(made))
    assert numbers[0] == numbers[1] <= 6, numbers


@pytest.mark.parametrize(("frames", "most"), [(1010, 995), (1030, 508)])
def test_a_covariance_is_made_of_a_thousand_stretches_at_most(frames, most) -> None:
    values = np.random.default_rng(0).normal(size=(frames, 6))
    stretches = Stretches(np.arange(frames), values, np.zeros(0, dtype=int))
    assert len(stretches.compared(np.arange(16))) == most


@pytest.mark.parametrize(("apart", "kink"), [(3.9, True), (4.1, False)])
def test_motions_that_meet_are_a_kink(monkeypatch, apart, kink) -> None:
    found = (np.full((1, 6), np.sqrt(apart)), np.ones(1))
    monkeypatch.setattr(kinks, "_apart", lambda stretches, before, after: found)
    monkeypatch.setattr(Stretches, "unlikeliness", lambda s, f, pattern: (0.0, 1.0))
    stretches = Stretches(np.arange(40), np.zeros((40, 6)), np.zeros(0, dtype=int))
    assert kinks.is_kink(stretches, [20]) == kink
