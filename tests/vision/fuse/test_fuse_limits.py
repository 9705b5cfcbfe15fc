"""Which sightings a fit takes and what it calls noise: both sides of each limit."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.measured.pose_errors import TERMS, PoseErrors
from freeswing.cdpr.rotation import transform
from freeswing.vision.fuse import tag_layout
from freeswing.vision.fuse.calibration_share import RunShare, common_errors
from freeswing.vision.fuse.corner_noise import Noise
from freeswing.vision.fuse.fuse_cameras import _Account
from freeswing.vision.fuse.pose_kernels import Linear
from freeswing.vision.untagged.still_pose import still_pose
from tests.vision.scenes import camera

FOCAL = 100.0


def stub(**attributes: Any) -> Any:
    """What has these attributes and stands for something that has more."""
    return SimpleNamespace(**attributes)


def account(scores, miss_px=0.0, noise_px=0.0) -> _Account:
    """A pass over one camera's sightings of one tag, all alike but for their scores."""
    n = len(scores)
    block = stub(
        camera_of=np.zeros(n, int), counts=np.full(n, 4), things=np.zeros(n, int),
        frames=np.arange(n), starts=np.array([0, n]),
        covariances=np.tile(np.eye(8) * (noise_px / FOCAL) ** 2, (n, 1, 1)),
    )  # fmt: skip
    camera = stub(focal_px=np.array([FOCAL, FOCAL]))
    made = _Account(Noise.unknown(1))
    solved = stub(scores=np.array(scores), known=np.ones(1, bool))
    linear = stub(residuals=np.full((n, 8), miss_px / FOCAL), places=np.ones((n, 4, 3)))
    made.add(block, [stub(camera=camera)], solved, linear)
    return made


@pytest.mark.parametrize(("score", "used"), [(14.5, 1), (17.5, 0)])
def test_a_sighting_far_from_the_others_is_left_out(score, used) -> None:
    """Scores are mean squares of whitened residuals: 16 is four deviations in all eight numbers."""
    found = account([score]).fit()
    assert found.used.tolist() == [used]
    assert len(found.rejected) == 1 - used, found.rejected


@pytest.mark.parametrize(("excess_px", "floor_px"), [(0.0017, 0.002), (0.0022, 0.0023)])
def test_a_floor_is_never_below_what_corners_can_be_found_to(excess_px, floor_px) -> None:
    floors = account([1.0] * 20, miss_px=excess_px).floors()
    assert floors[0] == pytest.approx(floor_px, rel=0.03), floors


@pytest.mark.parametrize(("share", "modes"), [(0.9e-4, 1), (1.1e-4, 2)])
def test_causes_that_are_a_trace_of_the_variance_are_dropped(share, modes) -> None:
    independent = np.zeros((2, 6, TERMS))
    independent[0, 0, 0], independent[1, 1, 0] = np.sqrt(1.0 - share), np.sqrt(share)
    errors = PoseErrors(np.zeros(3), np.eye(3), independent)
    (found,) = common_errors([RunShare(np.ones(6), errors, np.eye(TERMS))])
    assert found is not None
    assert len(found.modes) == modes


def pulled_m(off_sigmas: float) -> float:
    """How far one of 200 points, off by so many deviations of a pixel, pulls the pose with it."""
    view, home = camera(), transform(np.eye(3), np.zeros(3))
    points = np.random.default_rng(4).uniform(-0.3, 0.3, (200, 3))
    pixels = view.project(view.to_camera(points))
    pixels[0, 0] += off_sigmas
    found, _ = still_pose([view], np.zeros(200, np.int64), points, pixels, np.ones(200), home)
    return float(np.linalg.norm(found[:3, 3]))


def test_a_sighting_beyond_three_deviations_weighs_less() -> None:
    """In root mean square of its two numbers, with the square of what is beyond."""
    for rms, weight in ((2.85, 1.0), (3.15, (3.0 / 3.15) ** 4)):
        share = pulled_m(np.sqrt(2.0) * rms) / pulled_m(1.0) / (np.sqrt(2.0) * rms)
        assert share == pytest.approx(weight, rel=0.05), f"{rms}: {share:.3f}"


@pytest.mark.parametrize(("off", "counts"), [(19.5, True), (20.5, False)])
def test_a_tag_twenty_deviations_off_says_nothing_of_the_layout(monkeypatch, off, counts) -> None:
    """One of two tags seen by two cameras."""
    n = 4
    jacobians = np.random.default_rng(2).standard_normal((n, 8, 6))
    residuals = np.zeros((n, 8))
    residuals[0] = off
    linear = Linear(residuals, jacobians, np.zeros((n, 8)), np.ones((n, 4, 3)))
    monkeypatch.setattr(tag_layout, "linearised", lambda *_: linear)
    monkeypatch.setattr(tag_layout, "whitened", lambda *_: np.tile(np.eye(8), (n, 1, 1)))
    block = stub(starts=np.array([0, n]), first=0, things=np.array([0, 1, 0, 1]))
    poses = stub(known=np.ones(1, bool), rotations=np.eye(3)[None])
    watch = stub(tags=range(2), tag_corners_m=np.random.default_rng(3).random((2, 4, 3)))
    normal, right = np.zeros((12, 12)), np.zeros(12)
    tag_layout._add_block(block, poses, [], watch, Noise.unknown(1), normal, right)
    assert bool(np.abs(right).max() > 1e-9) == counts
