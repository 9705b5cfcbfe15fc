"""What corners err by, told from residuals: made noise of known parts."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.vision.fuse.corner_noise import (
    Noise,
    NoiseSums,
    alike,
    least_sizes,
    surely_turned,
    turns_of,
    whitened,
)

FOCAL, INSTANTS, TAGS = 500.0, 150, 5


def stub(**attributes: Any) -> Any:
    """What has these attributes and stands for something that has more."""
    return SimpleNamespace(**attributes)


def sightings(seed: int) -> tuple[Any, list, np.ndarray]:
    """Tags of two cameras, a little turned, the corners' pixel noise, and slopes by the pose."""
    rng = np.random.default_rng(seed)
    n = INSTANTS * TAGS
    square = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
    angle = rng.uniform(-0.2, 0.2, n)
    turn = np.stack([np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)], axis=1)
    rays = 0.03 * square @ np.swapaxes(turn.reshape(n, 2, 2), 1, 2) + rng.normal(size=(n, 1, 2)) / 9
    block = stub(
        camera_of=np.tile([0, 0, 0, 1, 1], INSTANTS), counts=np.full(n, 4), things=np.zeros(n, int),
        starts=np.arange(0, n + 1, TAGS), rays=rays.reshape(n, 8),
        covariances=np.eye(8) * rng.uniform(0.5, 2.0, n)[:, None, None] * (0.004 / FOCAL) ** 2,
    )  # fmt: skip
    slopes = rng.normal(size=(n, 8, 6))
    slopes[:, :, :2] += 2.0 * np.tile(np.eye(2), (4, 1))
    views = [stub(camera=stub(focal_px=np.full(2, FOCAL)))] * 2
    return block, views, slopes


def found_turns(floor_px, turned_px, seed=0, weights: Noise | None = None) -> np.ndarray:
    """What residuals of a least-squares fit tell of noise that has these parts."""
    block, views, slopes = sightings(seed)
    rng = np.random.default_rng(seed + 1)
    n = len(slopes)
    pixel = np.sqrt(np.diagonal(block.covariances, axis1=1, axis2=2)) * rng.normal(size=(n, 8))
    own = np.array(floor_px)[block.camera_of, None] / FOCAL * rng.normal(size=(n, 8))
    sizes = np.array(turned_px)[block.camera_of, None] / FOCAL * rng.normal(size=(n, 2))
    errors = pixel + own + np.einsum("nij,nj->ni", turns_of(block.rays), sizes)
    weights = weights or Noise.unknown(2)
    white = whitened(block, weights, views)
    by_pose = white @ slopes
    residuals, covariances = np.zeros((n, 8)), np.zeros((INSTANTS, 6, 6))
    for k in range(INSTANTS):
        mine = slice(TAGS * k, TAGS * (k + 1))
        flat = by_pose[mine].reshape(-1, 6)
        covariances[k] = np.linalg.inv(flat.T @ flat)
        missed = np.einsum("nij,nj->ni", white[mine], errors[mine]).ravel()
        residuals[mine] = errors[mine] - slopes[mine] @ (covariances[k] @ flat.T @ missed)
    sums = NoiseSums(weights)
    linear = stub(residuals=residuals, jacobians=slopes)
    sums.add(block, views, np.ones(n, dtype=bool), linear, covariances)
    return sums.turned_px()


def test_what_turns_tags_is_told_from_what_puts_corners_off() -> None:
    """Two cameras of different noise, weighed by a noise ten times what there is."""
    found = np.mean([found_turns((0.01, 0.02), (0.012, 0.02), seed) for seed in range(4)], axis=0)
    np.testing.assert_allclose(found, [0.012, 0.02], rtol=0.15)


def test_white_noise_turns_nothing() -> None:
    """Footage that nothing squeezed keeps the weights that it had."""
    for seed in range(12):
        found = found_turns((0.01, 0.003), (0.0, 0.0), seed)
        assert (found == 0.0).all(), (seed, found)


@pytest.mark.parametrize(("sigmas", "sure"), [(3.6, False), (4.5, True)])
def test_a_variance_that_may_be_chance_is_none(sigmas, sure) -> None:
    assert surely_turned(np.array([sigmas]), np.ones(1)).tolist() == [sure]


@pytest.mark.parametrize(("turned_px", "sure"), [(0.0015, False), (0.005, True)])
def test_what_may_be_chance_is_not_taken(turned_px, sure) -> None:
    """The variance of 750 tags with corners 0.01 px off is told to (0.0024 px)^2."""
    assert (found_turns((0.01, 0.01), (turned_px, turned_px), 3) > 0.0).all() == sure


def test_turned_tags_count_as_many_times_as_err_alike() -> None:
    block, views, _ = sightings(0)
    noise = Noise(np.full(2, 0.01), np.full(2, 0.02))
    whole = np.linalg.inv(np.swapaxes(white := whitened(block, noise, views), 1, 2) @ white)
    turns = turns_of(block.rays)
    plain = block.covariances + np.eye(8) * (0.01 / FOCAL) ** 2
    more = 16.0 * (0.02 / FOCAL) ** 2 * turns @ np.swapaxes(turns, 1, 2)
    np.testing.assert_allclose(whole, plain + more, rtol=1e-6, atol=1e-14)


def test_what_turns_one_cameras_tags_counts_in_all() -> None:
    assert alike(np.array([0.0, 0.01, 0.004])).tolist() == [0.01] * 3
    assert alike(np.zeros(2)).tolist() == [0.0, 0.0]


def test_sizes_are_never_negative() -> None:
    shares = np.array([[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(least_sizes(shares, np.array([5.0, 4.0, 0.0])), [2.0, 1.0, 0.0])
    np.testing.assert_allclose(least_sizes(shares, np.array([4.0, -1.0, 0.0])), [2.0, 0.0, 0.0])
