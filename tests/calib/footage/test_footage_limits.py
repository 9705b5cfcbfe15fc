"""What is a copy, what is torn, which rate is meant: both sides of each limit, on made frames."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.calib.footage import copied_frames, first_frames
from freeswing.calib.footage.container_times import evened
from freeswing.calib.footage.copied_frames import largest_shift_px, with_copies
from freeswing.calib.footage.frame_times import _from_container
from freeswing.calib.footage.interlacing import comb_ratio
from freeswing.cdpr.files.documents import DataError


def grey(value: float, size: int = 32) -> np.ndarray:
    return np.full((size, size), value, dtype=np.uint8)


@pytest.mark.parametrize(("change", "is_copy"), [(14, True), (16, False)])
def test_a_copy_changes_by_less_than_a_seventh_of_its_neighbours(change, is_copy) -> None:
    """What is around changes by 100 grey values."""
    values = (0, 100, 100 + change, 200 + change)
    told = list(with_copies((k, "", grey(value)) for k, value in enumerate(values)))
    assert told[2][1] == is_copy


@pytest.mark.parametrize(("elsewhere", "is_copy"), [(130, False), (140, True)])
def test_what_is_around_is_looked_at_whole_where_it_decides(
    monkeypatch, elsewhere, is_copy
) -> None:
    """The first tile changes by enough to be no copy; another one decides what is a copy."""
    monkeypatch.setattr(copied_frames, "largest_shift_px", lambda *_: 0.0)
    monkeypatch.setattr(copied_frames, "tile_shift_px", lambda *_: 0.0)
    images = [grey(0), grey(0), grey(20), grey(20)]
    for image, more in zip(images, (0, 1, 1, 0), strict=True):
        image[:16] += np.uint8(40 * more)
        image[16:] += np.uint8(elsewhere * more)
    told = list(with_copies((k, "", image) for k, image in enumerate(images)))
    assert [copy for _, copy in told] == [False, False, is_copy, False]


@pytest.mark.parametrize(("usual", "is_copy"), [(2.8, False), (3.2, True)])
def test_where_nothing_moves_nothing_is_a_copy(monkeypatch, usual, is_copy) -> None:
    changes = iter([usual, 0.01, usual])
    monkeypatch.setattr(copied_frames, "largest_change", lambda *_: (next(changes), (0, 0)))
    told = list(with_copies((k, "", grey(0)) for k in range(4)))
    assert told[2][1] == is_copy


@pytest.mark.parametrize(("shift_px", "is_copy"), [(0.07, True), (0.09, False)])
def test_edges_of_a_copy_stand_still(monkeypatch, shift_px, is_copy) -> None:
    monkeypatch.setattr(copied_frames, "largest_shift_px", lambda *_: shift_px)
    told = list(with_copies((k, "", grey(value)) for k, value in enumerate((0, 100, 101, 201))))
    assert told[2][1] == is_copy


@pytest.mark.parametrize(("slope", "told"), [(7, False), (9, True)])
def test_only_edges_tell_a_shift(slope, told) -> None:
    """A ramp of so many grey values a pixel, gone by one pixel."""
    before = np.tile(50 + slope * np.arange(16), (16, 1)).astype(np.uint8)
    shift = largest_shift_px(before, (before + slope).astype(np.uint8))
    assert shift == pytest.approx(1.0 if told else 0.0)


@pytest.mark.parametrize(("change", "moved"), [(22, False), (27, True)])
def test_an_edge_that_passes_changes_a_pixel(change, moved) -> None:
    assert np.isfinite(comb_ratio(grey(0), grey(change))) == moved


@pytest.mark.parametrize(("columns", "told"), [(18, False), (23, True)])
def test_too_little_motion_tells_no_comb(columns, told) -> None:
    """Ten rows of so many pixels moved."""
    image = grey(0, 64)
    image[10:20, :columns] = 200
    assert np.isfinite(comb_ratio(grey(0, 64), image)) == told


def looked_at(monkeypatch, ratio: float) -> first_frames.Condition:
    frames = (((k, "", grey(0)), False) for k in range(1000))
    monkeypatch.setattr(first_frames, "read_frames", lambda _: None)
    monkeypatch.setattr(first_frames, "with_copies", lambda _: frames)
    monkeypatch.setattr(first_frames, "comb_ratio", lambda *_: ratio)
    return first_frames.condition_of(SimpleNamespace())


@pytest.mark.parametrize(("ratio", "torn"), [(1.0, False), (1.2, True)])
def test_combs_bend_more_from_row_to_row(monkeypatch, ratio, torn) -> None:
    """Pure noise has one; twelve pairs of frames with motion are looked at."""
    found = looked_at(monkeypatch, ratio)
    assert found.is_torn == torn
    assert found.frames == 1 + 12


def container(rate_hz: float, stated_hz: float):
    shown = SimpleNamespace(rate_hz=rate_hz, missing=0, times_s=np.arange(3) / rate_hz)
    recording = SimpleNamespace(path=Path("a.mp4"), images=(), name="a")
    return _from_container(recording, shown, stated_hz)


@pytest.mark.parametrize(("off", "remarks"), [(0.9e-4, 0), (1.1e-4, 1)])
def test_rates_apart_by_a_millimetre_at_a_metre_a_second_are_named(off, remarks) -> None:
    assert len(container(30.0, 30.0 / (1.0 + off)).remarks) == remarks


@pytest.mark.parametrize(("ratio", "refused"), [(1.018, 0), (1.022, 1), (1.8, 1), (2.0, 0)])
def test_two_rates_are_one_or_one_is_played_slowly(monkeypatch, ratio, refused) -> None:
    monkeypatch.setattr("freeswing.calib.footage.frame_times.stamp_file", lambda _: Path("a.csv"))
    with pytest.raises(DataError, match="one of them is wrong") if refused else nullcontext():
        container(30.0, 30.0 / ratio)


@pytest.mark.parametrize(("ticks", "even"), [(0.55, True), (0.65, False)])
def test_an_even_beat_written_in_ticks(ticks, even) -> None:
    times = np.arange(100) / 30.0
    off = ticks * 1e-3 * np.tile([1.0, -1.0], 50)
    assert evened(times + off, 1e-3)[2] == even


@pytest.mark.parametrize(("share", "even"), [(0.45, True), (0.55, False)])
def test_a_coarse_tick_tells_no_beat(share, even) -> None:
    assert evened(np.arange(100) / 30.0, share / 30.0)[2] == even
