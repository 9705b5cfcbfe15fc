"""Stamps that all cameras have wrong alike: no camera tells of them, the platform's motion does."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.cdpr.rotation import exp_rotation, log_rotation
from freeswing.demo.truth import Swing, demo_swings
from freeswing.vision.fuse.motion.motion_from_poses import Missed
from freeswing.vision.fuse.poses import Poses, motions_of, unknown_poses, with_course
from freeswing.vision.rig.correct_rig import correct_rig
from freeswing.vision.rig.shared_jitter import (
    SharedJitter,
    along_the_motion,
    robust_variance,
    widened_along,
)
from tests.vision.rig import made_views as made
from tests.vision.rig.made_views import SWING, Recorded, made_views

JITTER_S = 1e-3
SPEED = np.array([0.3, 0.1, -0.2, 0.1, 0.2, 0.5])


def errors_in_claims(folder, monkeypatch, jitter_s: float) -> tuple[np.ndarray, tuple[str, ...]]:
    """Rms errors of poses in what is claimed, where frames come late alike and stamps are even."""
    late = jitter_s * np.random.default_rng(3).standard_normal(1000)
    even = made.frame_times

    def uneven(own, seconds, rng):
        numbers, taken, stamps, copy = even(own, seconds, rng)
        return numbers, taken + late[numbers], stamps, copy

    monkeypatch.setattr(made, "frame_times", uneven)
    views, watch = made_views(folder, (Recorded(), Recorded()), seconds=4.0)
    found = correct_rig(views, watch, 1e-3)
    poses = found.poses
    places, turns = SWING(poses.times_s)
    turned = log_rotation(poses.rotations @ np.swapaxes(turns, 1, 2))
    error = np.concatenate([poses.positions_m - places, turned], axis=1)
    claimed = np.diagonal(poses.covariances, axis1=1, axis2=2)
    return np.sqrt(np.mean(error**2 / claimed, axis=0)), found.remarks


def test_even_stamps_of_frames_that_come_unevenly_are_told(tmp_path, monkeypatch) -> None:
    """4 to 5 times what was claimed; both cameras see the platform at the same times."""
    errors, said = errors_in_claims(tmp_path, monkeypatch, JITTER_S)
    assert np.all((errors > 0.6) & (errors < 1.4)), errors
    assert any("in all cameras alike: their deviations" in text for text in said), said


def test_even_frames_are_left_as_they_are(tmp_path, monkeypatch) -> None:
    errors, said = errors_in_claims(tmp_path, monkeypatch, 0.0)
    assert np.all((errors > 0.7) & (errors < 1.3)), errors
    assert said == ()


def test_one_camera_has_none_that_is_alike(tmp_path) -> None:
    views, watch = made_views(tmp_path, (Recorded(jitter_s=2e-3), Recorded()), seconds=3.0)
    (said,) = correct_rig(views[:1], watch, 1e-3).remarks
    assert "ms (standard deviation): their deviations count it" in said


STD_M = 1e-5
RATE_HZ = 30.0


def swung(
    jitter_s: float,
    fast_m: float = 0.0,
    share: float = 0.0,
    way: tuple[float, float, float] = (0.6, 0.8, 0.0),
) -> Poses:
    """Poses of a swing of 50 mm at 1.3 Hz and an oscillation at a share of the frame rate."""
    rng, count = np.random.default_rng(8), 240
    stamps = np.arange(count) / RATE_HZ
    t = stamps + jitter_s * rng.standard_normal(count)
    along = 0.05 * np.sin(8.2 * t) + fast_m * np.sin(2.0 * np.pi * share * RATE_HZ * t)
    places = along[:, None] * np.array(way) + STD_M * rng.standard_normal((count, 3))
    poses = replace(
        unknown_poses(stamps),
        positions_m=places,
        rotations=np.tile(np.eye(3), (count, 1, 1)),
        covariances=np.tile(STD_M**2 * np.eye(6), (count, 1, 1)),
        known=np.ones(count, dtype=bool),
    )
    poses = with_course(poses, np.full(6, STD_M))
    return replace(poses, motions=motions_of(poses))


@pytest.mark.parametrize("jitter_s", [3e-4, 1e-3, 3e-3])
def test_jitter_of_all_stamps_is_told(jitter_s) -> None:
    found = along_the_motion(swung(jitter_s))
    assert found.std_s == pytest.approx(jitter_s, rel=0.15)
    assert not found.at_most


def test_even_frames_have_none() -> None:
    assert along_the_motion(swung(0.0)) == SharedJitter(0.0)


@pytest.mark.parametrize(("share", "slow"), [(0.225, True), (0.275, False)])
def test_a_motion_below_a_quarter_of_the_frame_rate_hides_nothing(share, slow) -> None:
    """Half a millimetre at 6.8 Hz of 30, or at 8.3."""
    found = along_the_motion(swung(5e-4, 5e-4, share))
    assert found.at_most != slow
    assert found.std_s == pytest.approx(5e-4, rel=0.3)


@pytest.mark.parametrize(("share", "told"), [(0.37, False), (0.41, True)])
def test_a_motion_below_four_tenths_of_the_frame_rate_is_none(share, told) -> None:
    """60 um at 11 Hz of 30 are 0.2 ms of a swing's way; at 12 Hz nothing tells that from jitter."""
    found = along_the_motion(swung(0.0, 6e-5, share))
    assert (found.std_s > 0.0) == told, found


@pytest.fixture(scope="module")
def demo() -> dict[str, Swing]:
    names = ("swing-01", "swing-02", "swing-03", "check-01")
    return {one.name: one for one in demo_swings(np.random.default_rng(1), 4.6, names=names)}


def filmed(swing: Swing, jitter_s: float, rate_hz: float = RATE_HZ) -> Poses:
    """Poses of one of the demonstration's swings as its cameras tell them."""
    rng = np.random.default_rng(4)
    stamps = 0.2 + np.arange(round(4.2 * rate_hz)) / rate_hz
    late = stamps + jitter_s * rng.standard_normal(len(stamps))
    true = Trajectory(late, POSE_COORDINATES, swing.motion.at(late)[0])
    turns = exp_rotation(3e-5 * rng.standard_normal((len(stamps), 3)))
    std = np.repeat([STD_M, 3e-5], 3)
    poses = replace(
        unknown_poses(stamps),
        positions_m=true.values[:, :3] + STD_M * rng.standard_normal((len(stamps), 3)),
        rotations=turns @ true.rotations(),
        covariances=np.tile(np.diag(std**2), (len(stamps), 1, 1)),
        known=np.ones(len(stamps), dtype=bool),
    )
    poses = with_course(poses, std)
    return replace(poses, motions=motions_of(poses))


@pytest.mark.parametrize("name", ["swing-01", "swing-02", "swing-03"])
def test_swings_near_a_singularity_are_told_none_that_is_not_there(demo, name) -> None:
    """0.2 ms and more had been told of the first two."""
    assert along_the_motion(filmed(demo[name], 0.0)) == SharedJitter(0.0)
    found = along_the_motion(filmed(demo[name], 1e-3))
    assert found.std_s == pytest.approx(1e-3, rel=0.3), found


def test_a_swing_as_fast_as_the_frames_hides_what_is_counted(demo) -> None:
    """Its tenth harmonic is as high as half of 30 Hz: 0.8 ms had been told."""
    assert along_the_motion(filmed(demo["check-01"], 0.0)).std_s < 3e-4
    assert along_the_motion(filmed(demo["check-01"], 0.0, 60.0)) == SharedJitter(0.0)
    found = along_the_motion(filmed(demo["check-01"], 5e-4))
    assert found.std_s == pytest.approx(5e-4, rel=0.3), found


@pytest.mark.parametrize("tied", [0.0, 0.99])
def test_what_is_sharp_across_the_motion_makes_no_jitter_of_it(tied) -> None:
    """0.2 mm aside at 12 Hz of 30 are 0.4 ms, where errors along the motion go with those aside."""
    poses = swung(0.0, way=(1.0, 0.0, 0.0))
    aside = 2e-4 * np.sin(2.0 * np.pi * 0.405 * np.arange(len(poses.times_s)))
    covariances = poses.covariances.copy()
    covariances[:, 0, 1] = covariances[:, 1, 0] = tied * STD_M**2
    places = poses.positions_m + aside[:, None] * np.array([0.0, 1.0, 0.0])
    poses = replace(poses, positions_m=places, covariances=covariances)
    poses = with_course(poses, np.full(6, STD_M))
    poses = replace(poses, motions=motions_of(poses))
    assert along_the_motion(poses) == SharedJitter(0.0)


def late_poses(late_s: float, std_s: float, count: int = 100, whole_s: float = 0.0) -> Poses:
    """Poses that lie so far before or behind the others' motion, claimed to some of their way.

    Between all frequencies `whole_s` instead, where it is told. Half the numbers are free.
    """
    sign = np.where(np.arange(count) % 2, 1.0, -1.0)[:, None]

    def missed(low: float, high: float) -> Missed:
        size_s = whole_s if whole_s and high - low > 0.2 else late_s
        return Missed(sign * size_s * np.sqrt(0.5) * SPEED, np.full(count, 0.5))

    course: Any = SimpleNamespace(
        missed=missed, deviations=np.ones(6), spectrum=SimpleNamespace(too_fast_hz=None)
    )
    return replace(
        unknown_poses(np.arange(count) / 20.0),
        known=np.ones(count, dtype=bool),
        motions=np.tile(np.append(SPEED, np.zeros(6)), (count, 1)),
        covariances=np.tile(std_s**2 * np.diag(6.0 * SPEED**2), (count, 1, 1)),
        course=course,
    )


STUDENT = np.sqrt(50.0 / 48.0)  # what fifty numbers let expect of the next
ALIKE = robust_variance(np.ones(100))
"""The variance of values that all are one is not one: normal ones have larger ones among them."""


@pytest.mark.parametrize(("times", "told"), [(0.93 * 1.6, False), (1.07 * 1.6, True)])
def test_it_has_to_stand_out_of_what_is_claimed(times, told) -> None:
    """A variance by fifty numbers is known to a fifth: three of these."""
    found = along_the_motion(late_poses(np.sqrt(times / ALIKE) * 1e-3, 1e-3))
    expected = 1e-3 * np.sqrt(times - 1.0) * STUDENT
    assert found.std_s == pytest.approx(expected if told else 0.0, rel=0.01)


@pytest.mark.parametrize(("times", "at_most"), [(0.93 * 1.85, False), (1.07 * 1.85, True)])
def test_more_where_motions_are_slower_is_motion(times, at_most) -> None:
    late_s = 1e-3 / np.sqrt(ALIKE)
    found = along_the_motion(late_poses(late_s, 1e-5, whole_s=np.sqrt(times) * late_s))
    assert found.at_most == at_most
    expected = 1e-3 * STUDENT * (1.0 if at_most else np.sqrt(times))
    assert found.std_s == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(("count", "told"), [(19, False), (20, True)])
def test_twenty_poses_tell(count, told) -> None:
    assert (along_the_motion(late_poses(5e-3, 1e-4, count)).std_s > 0.0) == told


def test_what_lies_far_off_counts_no_more() -> None:
    """Of values that all are one the deviation is 1.13; one and a half of it are 1.70."""

    def with_one(size: float) -> float:
        return robust_variance(np.append(np.ones(200), size))

    assert with_one(1.76) == pytest.approx(with_one(50.0), rel=1e-6)
    assert with_one(1.65) < 0.9995 * with_one(50.0)
    normal = np.random.default_rng(1).standard_normal(20000)
    assert robust_variance(normal) == pytest.approx(1.0, rel=0.03)


def test_what_it_moves_poses_by_is_added() -> None:
    poses = widened_along(late_poses(0.0, 1e-3), 2e-3)
    more = poses.covariances - late_poses(0.0, 1e-3).covariances
    assert more == pytest.approx(np.tile(4e-6 * np.outer(SPEED, SPEED), (100, 1, 1)))
