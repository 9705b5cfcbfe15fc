"""Pieces of sightings on disk: only what tracking itself writes is taken up again."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.vision.look.pieces import MOST_PIECE_BYTES, Piece, is_whole, save_piece


@pytest.fixture
def members(tmp_path: Path) -> dict[str, np.ndarray]:
    """What a piece of two frames and three sightings holds."""
    rng = np.random.default_rng(1)
    piece = Piece(
        np.arange(2), np.array([0.0, 0.1]), np.zeros(2, dtype=np.int64), np.full((2, 12), np.nan),
        np.array([0, 0, 1]), np.array([0, 1, 0]), rng.normal(size=(3, 8)),
        rng.normal(size=(3, 8, 8)), rng.normal(size=(3, 4)), rng.normal(size=(3, 2)),
    )  # fmt: skip
    follower = SimpleNamespace(past=[(0.1, (np.eye(3), np.zeros(3)))], base_rays={}, before={0: (1.0, 2.0, 3.0, 4.0)}, misses=0, count=2)  # fmt: skip # noqa: E501
    save_piece(tmp_path / "whole.npz", piece, follower)  # pyright: ignore[reportArgumentType]
    assert is_whole(tmp_path / "whole.npz")
    with np.load(tmp_path / "whole.npz") as data:
        return dict(data)


def _saved(folder: Path, members: dict[str, np.ndarray], packed: bool = False) -> Path:
    path = folder / "piece.npz"
    (np.savez_compressed if packed else np.savez)(path, **members)
    return path


@pytest.mark.parametrize("name", ["rays", "past_times", "counters"])
def test_a_missing_member_is_made_again(tmp_path, members, name) -> None:
    del members[name]
    assert not is_whole(_saved(tmp_path, members))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("rays", np.zeros((2, 8))),
        ("stamps_s", np.array([0.0, np.nan])),
        ("frame_of", np.array([0, 0, 2])),
        ("status", np.array(["a", "b"])),
        ("before", np.zeros((1, 3))),
    ],
)
def test_a_misshapen_member_is_made_again(tmp_path, members, name, value) -> None:
    assert not is_whole(_saved(tmp_path, {**members, name: value}))


def test_a_packed_or_overlarge_piece_is_never_unpacked(tmp_path, members) -> None:
    assert not is_whole(_saved(tmp_path, members, packed=True))
    bomb = {**members, "more": np.zeros(MOST_PIECE_BYTES + 1, dtype=np.uint8)}
    path = _saved(tmp_path, bomb, packed=True)
    assert path.stat().st_size < 2**20
    assert not is_whole(path)
