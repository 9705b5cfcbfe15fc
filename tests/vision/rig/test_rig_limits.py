"""From which numbers on a camera was moved, late or slow to read: both sides of each limit."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.rotation import exp_rotation, invert
from freeswing.vision.fuse.corner_noise import Noise
from freeswing.vision.fuse.fuse_cameras import Fit
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.rig.gross_faults import (
    Evidence,
    _size_of_tags,
    moved_too_far,
    refuse_disagreement,
    refuse_gross,
)
from freeswing.vision.rig.kept_clocks import with_kept_clocks
from freeswing.vision.rig.lag_accepted import Missed, _chosen, _needed, deviations_apart
from freeswing.vision.rig.lag_search import OwnTrack, _candidates, _correlations, _fitted
from freeswing.vision.rig.moved_cameras import repose_by_base_tags, was_moved
from freeswing.vision.rig.real_effects import LEAST_CLOCK_S, LEAST_LINE_S, is_real
from freeswing.vision.rig.rig_step import Finding
from freeswing.vision.rig.untied_cameras import is_sure, was_knocked
from tests.vision.scenes import camera, standing_tags


def stub(**attributes: Any) -> Any:
    """What has these attributes and stands for something that has more."""
    return SimpleNamespace(**attributes)


@pytest.mark.parametrize(("miss_px", "moved"), [(0.39, False), (0.41, True)])
def test_base_tags_that_lie_off(miss_px, moved) -> None:
    assert was_moved(np.array([0.01, miss_px, miss_px, miss_px, 50.0])) == moved


@pytest.mark.parametrize(
    ("value", "deviation", "least", "real"),
    [
        (-4.9e-5, 1e-6, LEAST_CLOCK_S, False),
        (-5.1e-5, 1e-6, LEAST_CLOCK_S, True),
        (2.9e-7, 1e-9, LEAST_LINE_S, False),
        (3.1e-7, 1e-9, LEAST_LINE_S, True),
        (5.9e-3, 1e-3, LEAST_CLOCK_S, False),
        (6.1e-3, 1e-3, LEAST_CLOCK_S, True),
    ],
)
def test_what_is_surely_not_zero(value, deviation, least, real) -> None:
    assert is_real(np.array([value]), np.array([deviation]), least).tolist() == [real]


@pytest.mark.parametrize(("apart_px", "knocked"), [(1.9, False), (2.1, True)])
def test_cameras_apart_by_more_than_calibrations_leave(apart_px, knocked) -> None:
    assert was_knocked(apart_px) == knocked


@pytest.mark.parametrize(("deviations", "sure"), [(5.8, False), (6.2, True)])
def test_a_change_of_pose_that_stands_out(deviations, sure) -> None:
    std = np.array([1e-3, 2e-3, 1e-3, 1e-4, 3e-4, 1e-4])
    change = deviations * std / np.sqrt(6.0)
    assert is_sure(change, np.diag(std**2)) == sure


VIEW = camera()


def place_by_tags(stated_m: list[float]) -> np.ndarray:
    """How far base tags move a camera of which one tag was surveyed 5 mm off, with deviations."""
    tags = np.array([tag.corners_platform_m for tag in standing_tags()])
    seen = VIEW.to_camera(tags)
    rays = (seen[..., :2] / seen[..., 2:]).reshape(-1, 8)
    surveyed = tags.copy()
    surveyed[2] += [0.005, 0.0, 0.0]
    watch = Watch((), np.zeros((0, 4, 3)), (("tag36h11", 0),) * 4, surveyed, (),
                  np.zeros((0, 3)), np.zeros(0), base_std_m=np.array(stated_m))  # fmt: skip
    piece = stub(things=np.arange(4), rays=rays)

    def view(own: Camera) -> Any:
        return stub(camera=own, pieces=lambda: [(0, piece)], believed=view)

    return repose_by_base_tags(view(VIEW), watch, 3e-4).position_base_m - VIEW.position_base_m


def test_a_base_tag_counts_as_its_stated_deviation_has_it() -> None:
    alike = np.linalg.norm(place_by_tags([]))
    assert np.linalg.norm(place_by_tags([np.nan] * 4)) == pytest.approx(alike)
    told = np.linalg.norm(place_by_tags([np.nan, np.nan, 0.02, np.nan]))
    assert told < 0.05 * alike, f"{1e3 * told:.3f} mm, unstated {1e3 * alike:.3f} mm"
    assert np.linalg.norm(place_by_tags([3e-4] * 4)) == pytest.approx(alike), "as where unstated"


def turned(angle_rad: float, shift_m: float) -> Camera:
    """The camera turned about a slanted axis and then moved in the base."""
    pose = VIEW.T_camera_base.copy()
    pose[:3, :3] = exp_rotation(angle_rad * np.array([0.6, 0.0, 0.8])) @ pose[:3, :3]
    place = VIEW.position_base_m + np.array([0.0, shift_m, 0.0])
    pose[:3, 3] = -pose[:3, :3] @ place
    return replace(VIEW, T_camera_base=pose)


@pytest.mark.parametrize(
    ("angle_rad", "shift_m", "far"),
    [(0.14, 0.0, False), (0.16, 0.0, True), (0.0, 0.19, False), (0.0, 0.21, True)],
)
def test_more_than_a_knock(angle_rad, shift_m, far) -> None:
    assert moved_too_far(VIEW, turned(angle_rad, shift_m)) == far


@pytest.mark.parametrize(
    ("floor_px", "lost", "refused"),
    [(0.9, 0, False), (1.1, 0, True), (0.1, 45, False), (0.1, 55, True)],
)
def test_cameras_that_still_do_not_agree(floor_px, lost, refused) -> None:
    """Floors in px, and how many of a hundred sightings contradict the other camera's."""
    views = [stub(camera=VIEW), stub(camera=replace(VIEW, name="cam1"))]
    rejected = {(0, 0): (lost, 0, 9.0)} if lost else {}
    fit = Fit(np.array([floor_px, 0.1]), np.zeros(2), np.zeros(2), np.array([100 - lost, 100]),
              rejected, (0.0, 1), Noise.unknown(2))  # fmt: skip
    with pytest.raises(DataError, match="camera cam0") if refused else nullcontext():
        refuse_disagreement(views, fit)


def evidence(angle_rad: float, ratios) -> tuple[list[Evidence], list[np.ndarray]]:
    """Cameras 1 m apart, seen from the first by a platform whose size is wrong."""
    poses, told = [np.eye(4)], []
    for k, ratio in enumerate(ratios, start=1):
        pose = np.eye(4)
        pose[:3, 3] = [-1.0, 0.1 * k, 0.0]
        poses.append(pose)
        seen = invert(pose)
        seen[:3, :3] = exp_rotation(np.array([0.0, 0.0, angle_rad])) @ seen[:3, :3]
        seen[:3, 3] /= ratio
        told.append(Evidence(0, k, seen))
    return told, poses


@pytest.mark.parametrize(
    ("angle_rad", "ratios", "named"),
    [
        (0.045, (2.0, 2.0), True),
        (0.055, (2.0, 2.0), False),
        (0.0, (2.0, 2.055), True),
        (0.0, (2.0, 2.068), False),
        (0.0, (1.027, 1.027), False),
        (0.0, (1.034, 1.034), True),
        (0.0, (2.8, 2.8), True),
        (0.0, (3.2, 3.2), False),
        (0.0, (0.32, 0.32), True),
        (0.0, (0.28, 0.28), False),
    ],
)
def test_one_factor_for_all_distances_is_a_wrong_size(angle_rad, ratios, named) -> None:
    assert (_size_of_tags(*evidence(angle_rad, ratios)) is not None) == named


@pytest.mark.parametrize(("known_m", "kept"), [(0.085, 0), (0.095, 1)])
def test_cameras_that_see_the_platform_apart(monkeypatch, known_m, kept) -> None:
    """Free of base tags; three times the pair's own miss of 1 cm is allowed on top of 6 cm."""
    monkeypatch.setattr("freeswing.vision.rig.gross_faults._by_base_tags", lambda *_: [])
    pair = stub(known_m=known_m, miss_m=0.01, T_first_second=np.eye(4))
    views = [stub(camera=VIEW), stub(camera=replace(VIEW, name="cam1"))]
    with pytest.raises(DataError, match="one of them moved") if kept else nullcontext():
        refuse_gross(views, stub(), {(0, 1): pair})


@pytest.mark.parametrize(("apart_s", "written"), [(0.9e-3, True), (1.1e-3, False)])
def test_a_clock_that_is_the_cameras_own(apart_s, written) -> None:
    seen = {"a": ("cam0",), "b": ("cam0",)}
    clock = {
        run: (Finding("clock_offset", "cam0", (("offset_s", value, 1e-6),)),)
        for run, value in (("a", 0.01), ("b", 0.01 + apart_s))
    }
    (kept,), _ = with_kept_clocks([VIEW], seen, clock)
    assert (kept.clock_offset_s != 0.0) == written


@pytest.mark.parametrize(("sigmas", "needed"), [(3.9, False), (4.1, True)])
def test_when_a_start_is_looked_for(sigmas, needed) -> None:
    assert _needed(stub(at_zero_sigmas=sigmas)) == needed


def test_starts_are_compared_frame_by_frame() -> None:
    """What noise does to both cancels: a tenth more variance stands out of 100 frames."""
    rng = np.random.default_rng(4)
    noise = rng.chisquare(8, 100) / 8.0
    more = 0.1 + 0.1 * rng.normal(size=100)
    best = Missed(0.02, dict(enumerate(noise)))
    rival = Missed(0.021, dict(enumerate(noise + more)))
    told = deviations_apart(best, rival)
    assert 7.0 < told < 13.0, told
    apart = Missed(0.021, {k + 1000: v for k, v in rival.squares_px2.items()})
    told = deviations_apart(best, apart)
    assert 0.6 < told < 0.8, told
    assert deviations_apart(best, Missed(float("inf"), {})) == float("inf")


def test_a_frame_that_a_rival_misses_by_far_does_not_speak_for_it() -> None:
    """Thirty times the others' difference in one of 100 frames: seen between rendered phones."""
    rng = np.random.default_rng(5)
    best = Missed(0.02, dict(enumerate(5e-4 * rng.chisquare(8, 100) / 8.0)))
    rival = Missed(
        0.035, {k: v + 1.5e-3 * rng.uniform(0.5, 1.5) for k, v in best.squares_px2.items()}
    )
    told = deviations_apart(best, rival)
    astray = Missed(0.035, {**rival.squares_px2, 50: 0.063})
    assert told > 20.0, told
    assert deviations_apart(best, astray) > 0.9 * told
    assert deviations_apart(rival, best) == pytest.approx(-told)


def test_a_start_that_ends_where_the_best_does_is_no_rival() -> None:
    view = stub(camera=VIEW, believed=lambda camera: camera)
    pair = stub(lag_s=1.0, decided_m=0.01, at_zero_m=0.04, rivals=[(1.07, 0.011), (2.0, 0.012)])
    ends = iter((1.02, 1.021, 2.0))

    def misfit(known, new):
        return Missed(0.1, dict.fromkeys(range(50), 0.01), next(ends))

    lag, _, _, sure = _chosen(pair, view, view, misfit)
    assert lag == 1.0
    assert sure == 0.0  # the third fits as well and is another start


@pytest.mark.parametrize(
    ("miss_m", "at_zero_m", "tried"), [(0.029, 0.1, 2), (0.031, 0.1, 1), (0.031, 0.029, 2)]
)
def test_other_starts_that_are_tried_in_earnest(miss_m, at_zero_m, tried) -> None:
    """As stamped, too."""
    view = stub(camera=VIEW, believed=lambda camera: camera)
    pair = stub(lag_s=1.0, decided_m=0.01, at_zero_m=at_zero_m, rivals=[(2.0, miss_m)])
    asked = []

    def misfit(known, new):
        asked.append(new)
        return Missed(0.1 * len(asked), dict.fromkeys(range(50), 0.01 * len(asked)))

    _chosen(pair, view, view, misfit)
    assert len(asked) == tried


def speeds_of(times_s: np.ndarray) -> np.ndarray:
    turn = np.sin(3.1 * times_s) + 0.6 * np.sin(5.7 * times_s + 1.0)
    return np.stack([2.0 + turn, 2.0 - turn**2], axis=1)


@pytest.mark.parametrize(("lag_s", "looked_at"), [(9.2, True), (10.8, False)])
def test_cameras_are_started_within_ten_seconds(lag_s, looked_at) -> None:
    whole = np.arange(0.0, 30.0, 0.1)
    part = np.arange(13.0, 17.0, 0.1) - lag_s
    lags, _ = _correlations((whole, speeds_of(whole)), (part, speeds_of(part + lag_s)), 0.1)
    assert bool((np.abs(lags - lag_s) < 0.06).any()) == looked_at


@pytest.mark.parametrize(("overlap_s", "enough"), [(0.9, False), (1.1, True)])
def test_records_share_a_second(overlap_s, enough) -> None:
    """At 100 Hz, seen at the lag of zero."""
    first, second = np.arange(0.0, 5.0, 0.01), np.arange(5.0 - overlap_s, 9.0, 0.01)
    lags, _ = _correlations((first, speeds_of(first)), (second, speeds_of(second)), 0.01)
    assert bool((np.abs(lags) < 1e-6).any()) == enough


@pytest.mark.parametrize(("below", "kept"), [(0.22, 2), (0.28, 1)])
def test_lags_that_correlate_nearly_as_well(below, kept) -> None:
    scores = np.array([0.0, 0.9, 0.1, 0.9 - below, 0.0])
    assert len(_candidates(np.arange(5.0), scores)) == kept


@pytest.mark.parametrize(("share", "enough"), [(0.46, False), (0.56, True)])
def test_records_share_half_of_the_shorter(share, enough) -> None:
    """A platform that turns and shifts, seen from one place by two cameras."""

    def track(times_s):
        turns = exp_rotation(np.outer(np.sin(times_s), [0.3, 0.1, 0.2]))
        places = np.stack([np.sin(times_s), np.cos(times_s), 0.1 * times_s], axis=1)
        return OwnTrack(times_s, turns, places)

    first = track(np.arange(0.0, 10.0, 0.05))
    second = track(np.arange(10.0 - 10.0 * share, 20.0 - 10.0 * share, 0.05))
    assert (_fitted(first, second, 0.0, np.eye(4)) is not None) == enough
