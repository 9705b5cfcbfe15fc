"""Lasting errors of features: how large they are, and what they do to poses."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from freeswing.cdpr.rotation import exp_rotation
from freeswing.vision.untagged.feature_bias import FeatureBias, Placed, feature_bias

NAMES = ("a", "b", "c")
POINTS = 200


def slopes(rng: np.random.Generator) -> np.ndarray:
    """Of points in cameras that look along directions 22 degrees apart, 2 m away, (3, n, 2, 3)."""
    found = []
    for angle in (-0.38, 0.0, 0.38):
        turn = exp_rotation(np.array([0.0, angle, 0.0]))
        found.append(np.tile(0.5 * turn[:2], (POINTS, 1, 1)))
    return np.array(found) * rng.uniform(0.9, 1.1, (3, POINTS, 1, 1))


def seen(bias: np.ndarray, by_place: np.ndarray, frames: int, noise: float) -> Iterator[Placed]:
    """Residuals about points that fit biased features, frames one after the other."""
    rng = np.random.default_rng(8)
    normal = np.einsum("cnia,cnib->nab", by_place, by_place)
    moved = np.linalg.solve(normal, np.einsum("cnia,cni->na", by_place, bias)[..., None])[..., 0]
    left = bias - np.einsum("cnia,na->cni", by_place, moved)
    for _ in range(frames):
        for camera in range(3):
            off = left[camera] + noise * rng.normal(size=(POINTS, 2))
            yield Placed(camera, np.arange(POINTS), off, by_place[camera])


def test_the_size_of_lasting_errors_comes_out() -> None:
    """200 points of three cameras, 3 numbers each beyond their place: known to 3 %."""
    rng = np.random.default_rng(3)
    by_place = slopes(rng)
    bias = 2e-4 * rng.normal(size=(3, POINTS, 2))
    found = feature_bias(seen(bias, by_place, 40, 1e-4), NAMES, POINTS)
    assert found.size == pytest.approx(2e-4, rel=0.1)
    moved = np.einsum("cnai,cni->na", found.pull, bias)
    normal = np.einsum("cnia,cnib->nab", by_place, by_place)
    wanted = np.linalg.solve(normal, np.einsum("cnia,cni->na", by_place, bias)[..., None])[..., 0]
    np.testing.assert_allclose(moved, wanted, atol=1e-9)


@pytest.mark.parametrize(("frames", "known"), [(9, False), (10, True)])
def test_a_mean_over_few_frames_tells_nothing_that_lasts(frames, known) -> None:
    rng = np.random.default_rng(3)
    bias = 2e-4 * rng.normal(size=(3, POINTS, 2))
    found = feature_bias(seen(bias, slopes(rng), frames, 1e-5), NAMES, POINTS)
    assert (found.size > 0.0) == known


def test_an_error_moves_a_pose_by_itself_and_by_its_point() -> None:
    """One instant by plain sums: features move, points follow by `pull`, the pose by both."""
    rng = np.random.default_rng(5)
    cameras, points, m = 2, 7, 12
    bias = FeatureBias(NAMES[:2], 1.0, rng.normal(size=(cameras, points, 3, 2)))
    which = np.concatenate([rng.permutation(points), rng.permutation(points)[:5]])
    camera = np.repeat([0, 1], [points, 5])
    jacobian, gain = rng.normal(size=(m, 2, 6)), rng.normal(size=(m, 6, 2))
    rotation = exp_rotation(np.array([0.3, -0.2, 0.9]))
    found = bias._of_one(gain, jacobian, rotation, which, camera)
    error = rng.normal(size=(cameras, points, 2))
    moved = [sum(bias.pull[c, p] @ error[c, p] for c in range(cameras)) for p in range(points)]
    wanted = np.zeros(6)
    for o in range(m):
        by_point = jacobian[o, :, :3] @ rotation @ moved[which[o]]
        wanted += gain[o] @ (error[camera[o], which[o]] - by_point)
    np.testing.assert_allclose(np.einsum("acni,cni->a", found, error), wanted, rtol=1e-10)
