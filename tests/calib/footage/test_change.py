"""Changes between frames: compiled sums against the same by whole arrays."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.calib.footage.copied_frames import largest_change, largest_shift_px, tile_shift_px
from freeswing.calib.footage.interlacing import comb_ratio


@pytest.mark.parametrize("shape", [(64, 96), (75, 101)])
def test_sums_are_those_of_whole_arrays(shape) -> None:
    random = np.random.default_rng(4)
    before, image = random.integers(0, 256, (2, *shape)).astype(np.uint8)
    height, width = (size // 16 * 16 for size in shape)
    change = np.abs(image.astype(int) - before.astype(int))[:height:2, :width:2]
    tiles = change.reshape(height // 16, 8, width // 16, 8).sum(axis=(1, 3))
    most, where = tiles.max() / 64, np.unravel_index(tiles.argmax(), tiles.shape)
    assert largest_change(before, image) == (most, where)
    row = 2
    least, where = tiles[row].max() / 64, (row, tiles[row].argmax())
    assert largest_change(before, image, least, row) == (least, where), "ended there"
    now = image.astype(int)
    moved = np.abs(now - before)[2:-2] > 24
    near = np.abs(2 * now[2:-2] - now[1:-3] - now[3:-1])[moved].sum()
    far = np.abs(2 * now[2:-2] - now[:-4] - now[4:])[moved].sum()
    assert comb_ratio(before, image) == pytest.approx(near / far, rel=1e-12)


@pytest.mark.parametrize("place", [(0, 0), (1, 2), (3, 5)])
def test_a_tiles_edges_are_those_of_the_whole_picture(place) -> None:
    """All else stands still, and has no edges."""
    random = np.random.default_rng(5)
    before = np.full((70, 100), 90, np.uint8)
    tile = tuple(slice(16 * at + 1, 16 * at + 15) for at in place)
    before[tile] = random.integers(0, 256, (14, 14))
    image = before.copy()
    image[tile] = np.roll(before[tile], 1, axis=1)
    whole = largest_shift_px(before, image)
    assert whole > 0.1
    assert tile_shift_px(before, image, place) == pytest.approx(whole, rel=1e-5)
    assert tile_shift_px(before, image, (2, 0)) == 0.0


def test_little_motion_tells_nothing_of_combs() -> None:
    before = np.full((40, 40), 90, np.uint8)
    image = before.copy()
    image[10:20, 10:29] = 200
    assert np.isnan(comb_ratio(before, image)), "190 pixels moved"
    image[10:20, 10:31] = 200
    assert np.isfinite(comb_ratio(before, image)), "210 pixels moved"
