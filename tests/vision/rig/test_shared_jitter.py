"""Stamps that all cameras have wrong alike: no camera tells of them, the platform's motion does."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.rotation import log_rotation
from freeswing.vision.fuse.motion.motion_from_poses import LeftOut
from freeswing.vision.fuse.poses import Poses, unknown_poses
from freeswing.vision.rig.correct_rig import correct_rig
from freeswing.vision.rig.stamp_jitter import along_the_motion_s, widened_along
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


def late_poses(late_s: float, std_s: float, count: int = 100) -> Poses:
    """Poses that lie as far before as behind the others' motion, claimed to some of their way."""
    left = np.where(np.arange(count) % 2, 1.0, -1.0)[:, None] * late_s * SPEED
    course: Any = SimpleNamespace(
        left_out=lambda: LeftOut(left, np.zeros(count)), deviations=np.ones(6)
    )
    return replace(
        unknown_poses(np.arange(count) / 20.0),
        known=np.ones(count, dtype=bool),
        motions=np.tile(np.append(SPEED, np.zeros(6)), (count, 1)),
        covariances=np.tile(std_s**2 * np.diag(6.0 * SPEED**2), (count, 1, 1)),
        course=course,
    )


@pytest.mark.parametrize(("times", "told"), [(0.96 * 1.932, False), (1.04 * 1.932, True)])
def test_it_has_to_stand_out_of_what_is_claimed(times, told) -> None:
    """Of a hundred poses a variance by the median is known to 23 %: four of these."""
    poses = late_poses(np.sqrt(times) * 1e-3 / 1.4826, 1e-3)
    found = along_the_motion_s(poses)
    assert found == pytest.approx(1e-3 * np.sqrt(times - 1.0) if told else 0.0, rel=0.01)


def test_what_it_moves_poses_by_is_added() -> None:
    poses = widened_along(late_poses(0.0, 1e-3), 2e-3)
    more = poses.covariances - late_poses(0.0, 1e-3).covariances
    assert more == pytest.approx(np.tile(4e-6 * np.outer(SPEED, SPEED), (100, 1, 1)))
