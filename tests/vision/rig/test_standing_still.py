"""Platforms that stand still tell no clock, and small swings do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.rotation import exp_rotation
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.rig.correct_rig import correct_rig
from freeswing.vision.rig.standing_still import stands_still
from tests.vision.rig.made_views import MODES, Recorded, damped, made_views


def smaller(share: float):
    """The swing of the made views with so much of its size."""
    return damped(
        [(hz, tuple(share * np.array(a)), tuple(share * np.array(b))) for hz, a, b in MODES]
    )


@pytest.mark.parametrize("seed", [5, 6, 7])
def test_a_platform_at_rest_tells_no_clock(tmp_path: Path, seed: int) -> None:
    """Clocks of 0.5 and 0.9 s and jitter of 0.2 s had been told of noise, sure to 0.01 s."""
    views, watch = made_views(
        tmp_path, (Recorded(), Recorded()), seconds=5.0, motion=smaller(0.0), seed=seed
    )
    found = correct_rig(views, watch, 1e-3)
    assert found.findings == ()
    assert found.remarks == ()


def test_a_swing_of_a_millimetre_tells_a_late_camera(tmp_path: Path) -> None:
    views, watch = made_views(
        tmp_path, (Recorded(), Recorded(late_s=0.02)), seconds=5.0, motion=smaller(0.1)
    )
    (found,) = correct_rig(views, watch, 1e-3).findings
    assert found.effect == "clock_offset"
    (_, offset_s, std_s) = found.parameters[0]
    assert abs(offset_s - 0.02) < 4.0 * std_s < 0.004


def poses(course: float, size: float) -> Poses:
    """2000 poses whose successive differences have so much of twice their variance."""
    rng = np.random.default_rng(1)
    along = 1.0 - 0.5 * course
    noise = rng.normal(size=(2000, 6))
    walk = np.zeros_like(noise)
    for k in range(1, len(walk)):
        walk[k] = along * walk[k - 1] + np.sqrt(1.0 - along**2) * noise[k]
    walk *= 1e-3 * size / walk.std(axis=0)
    covariances = np.tile(1e-6 * np.eye(6), (len(walk), 1, 1))
    return Poses(
        np.arange(len(walk)) / 30.0,
        walk[:, :3],
        exp_rotation(walk[:, 3:]),
        covariances,
        np.ones(len(walk), dtype=bool),
        np.zeros((len(walk), 12)),
    )


@pytest.mark.parametrize(
    ("course", "size", "still"),
    [(2.0, 1.0, True), (1.6, 1.0, True), (1.4, 1.0, False), (2.0, 2.8, True), (2.0, 3.2, False)],
)
def test_what_stands_still(course: float, size: float, still: bool) -> None:
    assert stands_still(poses(course, size)) == still
