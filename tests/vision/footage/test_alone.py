"""What one of several cameras recorded alone is left out of a run's poses."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.vision.fuse.poses import Poses
from freeswing.vision.recorded_alone import recorded_by_two


def poses_of(count: int) -> Poses:
    times = np.arange(count) / 30.0
    turns = np.tile(np.eye(3), (count, 1, 1))
    blank = np.zeros((count, 6, 6))
    return Poses(
        times, np.zeros((count, 3)), turns, blank, np.ones(count, bool), np.zeros((count, 12))
    )


def camera(low: int, high: int) -> SimpleNamespace:
    """Frames low to high, one in five lost, a quarter of a frame late."""
    frames = np.setdiff1d(np.arange(low, high), np.arange(low + 2, high - 1, 5))
    return SimpleNamespace(middle_times=lambda: (frames + 0.25) / 30.0)


@pytest.mark.parametrize(("started", "left_out"), [(96, 96), (104, 0)])
def test_what_one_camera_recorded_alone_is_left_out_of_a_longer_run(started, left_out) -> None:
    """Half of the samples at least remain; frames that a camera lost change nothing."""
    poses, said = recorded_by_two(poses_of(200), [camera(0, 200), camera(started, 200)])
    assert int((~poses.known).sum()) == left_out
    assert poses.known[104:].all()
    assert bool(said) == bool(left_out)
    assert f"{left_out} of 200 samples" in "".join(said) or not left_out


def test_a_single_camera_is_all_there_is() -> None:
    poses, said = recorded_by_two(poses_of(50), [camera(0, 50)])
    assert poses.known.all()
    assert said == ()
