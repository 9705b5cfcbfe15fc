"""Turns in which poses and their motion settle: with which noise each sighting is weighed."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from freeswing.vision.fuse import fuse_cameras
from freeswing.vision.fuse.corner_noise import Noise
from freeswing.vision.fuse.poses import Poses

TURNED_PX = 0.01


def test_what_turns_tags_is_told_once_all_is_settled_and_weighs_in_the_last_pass(
    monkeypatch,
) -> None:
    """Told under its own weights it hides: found and lost by turns, poses never settled."""
    n, weighed, told = 40, [], []

    class Sums:
        def __init__(self, noise: Noise) -> None:
            self.noise = noise

        def turned_px(self) -> np.ndarray:
            told.append(self.noise.turned_px.max())
            return np.full(2, 0.0 if self.noise.turned_px.any() else TURNED_PX)

    def solved(_run: Any, poses: Poses, noise: Noise, _parts: Any, *, kept: bool) -> tuple:
        weighed.append((noise.turned_px.max(), kept))
        start = np.where(poses.known[:, None], poses.positions_m, 1.0)
        turned = np.full((n, 1), noise.turned_px.max())
        places = 0.8 * start + np.sin(np.arange(3.0 * n)).reshape(n, 3) + turned
        found = Poses(
            poses.times_s, places, np.tile(np.eye(3), (n, 1, 1)), np.zeros((0, 6, 6)),
            np.ones(n, bool), np.zeros((n, 12)),
        )  # fmt: skip
        account: Any = SimpleNamespace(floors=lambda: np.full(2, 0.02), fit=lambda: "fit")
        return found, np.full(6, 1e-4), account

    monkeypatch.setattr(fuse_cameras, "NoiseSums", Sums)
    monkeypatch.setattr(fuse_cameras, "_solved", solved)
    watch: Any = None
    fuse_cameras.fuse([watch, watch], watch, np.arange(n) / 20.0)
    assert len(weighed) < 10, f"{len(weighed)} passes, settled after five or six"
    assert [size for size, _ in weighed] == [0.0] * (len(weighed) - 1) + [TURNED_PX]
    assert [kept for _, kept in weighed] == [False] * (len(weighed) - 1) + [True]
    assert told == [0.0], "once, by sightings that were weighed without it"
