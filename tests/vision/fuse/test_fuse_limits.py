"""Which sightings a fit takes and what it calls noise: both sides of each limit."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.measured.pose_errors import TERMS, PoseErrors
from freeswing.vision.fuse.calibration_share import RunShare, common_errors
from freeswing.vision.fuse.fuse_cameras import _Account
from freeswing.vision.fuse.noise import Noise

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
    (found,) = common_errors([RunShare(np.ones(6), errors, np.ones(TERMS))])
    assert found is not None
    assert len(found.modes) == modes
