"""Bright dots followed, told apart, and made into signals."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from freeswing.vision.planar.dots import Spots, followed, moving, named
from freeswing.vision.planar.two_dots import COLUMNS, channel_block, dot_signals

FOCAL_PX = 500.0


def spots_of(points: np.ndarray, lamp: bool, hidden: slice) -> tuple[Spots, np.ndarray]:
    """Dots that turn about the middle (and a lamp beside them), in mixed order; yaw."""
    rng = np.random.default_rng(2)
    chi = 0.2 * np.sin(np.arange(200) * 0.11)
    frames, rays = [], []
    for k, turn in enumerate(chi):
        z = (points[:, 0] + 1j * points[:, 1]) * np.exp(1j * turn)
        there = np.column_stack([z.real, -z.imag])
        there = np.vstack([there, [[0.3, 0.3]]]) if lamp else there
        kept = [d for d in range(len(there)) if not (d == 0 and k in range(200)[hidden])]
        for d in rng.permutation(kept):
            frames.append(k)
            rays.append(there[d] + rng.normal(0.0, 2e-5, 2))
    covariances = np.tile(4e-10 * np.eye(2), (len(frames), 1, 1))
    return Spots(np.array(frames), np.array(rays), covariances), chi


@pytest.mark.parametrize("lamp", [False, True])
def test_two_dots_become_two_signals_of_yaw(lamp: bool) -> None:
    """Hidden for ten frames one dot is found again; a lamp that stands still is none."""
    points = np.array([[-0.2, 0.02], [0.17, -0.01]])
    spots, chi = spots_of(points, lamp, slice(60, 70))
    dots = moving(followed(spots, len(chi)), spots, 2)
    told = dot_signals(named(dots, spots, np.array([[-1.0, 0.0], [1.0, 0.0]]), 1.0), spots, 500.0)
    known = np.isfinite(told.values_px).all(axis=1)
    assert (~known).sum() == 10
    for k, arm in enumerate((0.2, 0.17)):
        seen = told.values_px[known, k] - told.values_px[known, k].mean()
        share = np.corrcoef(seen, np.sin(chi[known]))[0, 1]
        assert abs(share) > 0.99, share
        assert np.ptp(seen) == pytest.approx(FOCAL_PX * arm * np.ptp(np.sin(chi)), rel=0.03)
    assert told.std_px[known].max() == pytest.approx(0.01, rel=0.01)


def test_three_dots_are_named_by_their_places() -> None:
    """In any order, by the triangle that they make."""
    points = np.array([[-0.2, 0.02], [0.17, -0.01], [0.05, 0.15]])
    spots, chi = spots_of(points, False, slice(0, 0))
    dots = named(followed(spots, len(chi)), spots, points, 1.0)
    middles = np.array([spots.rays[dot].mean(axis=0) for dot in dots]) * [1.0, -1.0]
    assert np.abs(middles - points).max() < 0.02, middles


def test_the_block_for_the_session_file_is_read_as_two_channels() -> None:
    """What is printed can be pasted."""
    told = tomllib.loads(channel_block())["channels"]
    assert [one["column"] for one in told] == list(COLUMNS)
    assert all(one["order"] == 3 for one in told)
