"""Copies of the sample before, points between two, and fills of gaps: left out and named."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.cdpr.measured.held_doubled_wild import sound_samples
from freeswing.cdpr.measured.repeated_and_interpolated import interpolated, repeated
from freeswing.cdpr.measured.trajectory import Trajectory

COUNT = 600
TIMES = np.arange(COUNT) / 100.0
POSE = ("x", "y", "z", "phi", "theta", "chi")


def poses(step: float = 1e-9, seed: int = 0) -> np.ndarray:
    """A swing with noise, printed to a step, (600, 6)."""
    rates = np.array([3.0, 4.0, 6.1, 2.2, 5.0, 1.7])
    waves = 0.1 * np.sin(rates * TIMES[:, None] + np.arange(6.0))
    noisy = waves + 1e-4 * np.random.default_rng(seed).normal(size=waves.shape)
    return np.round(noisy / step) * step


def sound(values: np.ndarray, times: np.ndarray = TIMES) -> Trajectory:
    return sound_samples(Trajectory(times, POSE, values))


@pytest.mark.parametrize("every", [3, 8, 200])
def test_copies_are_left_out_and_named(every) -> None:
    values = poses()
    copies = np.arange(every, COUNT, every)
    values[copies] = values[copies - 1]
    found = sound(values)
    assert np.flatnonzero(~found.is_known).tolist() == copies.tolist()
    assert found.notes == (
        f"{len(copies)} samples repeat the one before to the last digit, the first at "
        f"{every / 100:.2f} s: copies, which lag; they are left out",
    )


def test_numbers_so_coarse_that_chance_repeats_them_stay() -> None:
    values = poses(step=0.01)
    assert (np.diff(values, axis=0) == 0.0).all(axis=1).sum() > 5
    assert sound(values).notes == ()


@pytest.mark.parametrize(("by_chance", "is_copy"), [(0.95e-4, True), (1.05e-4, False)])
def test_so_many_copies_by_chance(by_chance, is_copy) -> None:
    """One coordinate of 101 samples that steps by 1, and once by what chance asks for."""
    steps = np.ones(100)
    steps[10], steps[50] = by_chance / 101.0, 0.0
    values = np.concatenate([[0.0], np.cumsum(steps)])[:, None]
    assert np.flatnonzero(repeated(values)).tolist() == ([51] if is_copy else [])


def drawn(times_each: int, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The swing at a higher rate, straight from sample to sample."""
    at = np.arange((COUNT - 1) * times_each + 1) / times_each
    lines = np.stack([np.interp(at, np.arange(COUNT), column) for column in values.T], axis=1)
    return lines, at / 100.0


@pytest.mark.parametrize("times_each", [2, 3, 5])
def test_what_was_drawn_between_samples_is_left_out(times_each) -> None:
    values = poses()
    found = sound(*drawn(times_each, values))
    assert np.abs(found.values - values).max() < 1e-12
    assert f"{100 * times_each} Hz interpolated from 100 Hz" in found.notes[0]


def test_copies_between_which_lines_were_drawn_are_found_too() -> None:
    values = poses()
    copies = np.arange(8, COUNT, 8)
    values[copies] = values[copies - 1]
    found = sound(*drawn(2, values))
    known = found.is_known
    assert np.abs(np.diff(found.times_s[known]).min() - 0.01) < 1e-9
    assert known.sum() == COUNT - len(copies)


@pytest.mark.parametrize(("share", "is_drawn"), [(0.37, True), (0.33, False)])
def test_so_many_on_lines_are_a_raised_rate(share, is_drawn) -> None:
    values = poses()
    for k in range(1, 2 * round(share * (COUNT - 2)), 2):
        values[k] = 0.5 * (values[k - 1] + values[k + 1])
    assert (interpolated(Trajectory(TIMES, POSE, values)) is not None) == is_drawn


@pytest.mark.parametrize(("off", "is_drawn"), [(0.17, True), (0.185, False)])
def test_so_far_off_the_line_is_measured(off, is_drawn) -> None:
    """Every second one off by `off` of what 90 % are off by before: 0.145 and 0.156 of it after."""
    values = np.zeros((COUNT, 1))
    values[::2, 0] = 10.0 * np.arange(COUNT // 2) + np.tile([0.0, 2.0], COUNT // 4)
    values[1:-1:2] = 0.5 * (values[:-2:2] + values[2::2])
    usual = np.percentile(np.abs(np.convolve(values[:, 0], [-0.5, 1.0, -0.5], "valid")), 90.0)
    values[1:-1:2] += off * usual
    assert (interpolated(Trajectory(TIMES, ("x",), values)) is not None) == is_drawn


@pytest.mark.parametrize(("share", "is_pattern"), [(0.028, True), (0.038, False)])
def test_a_pattern_holds_where_nearly_all_follow_it(share, is_pattern) -> None:
    """Each measured sample that is put on a line takes its two neighbours off theirs."""
    values = poses()
    values, times = drawn(2, values)
    for k in np.arange(10, 10 + 4 * round(share * len(values)), 4):
        values[k] = 0.5 * (values[k - 1] + values[k + 1])
    found = interpolated(Trajectory(times, POSE, values))
    assert found is not None
    assert bool(np.array_equal(found, np.arange(len(values)) % 2 == 1)) == is_pattern


@pytest.mark.parametrize(("count", "is_drawn"), [(21, False), (23, True)])
def test_few_samples_are_not_looked_at(count, is_drawn) -> None:
    values, times = drawn(2, poses())
    few = Trajectory(times[:count], POSE, values[:count])
    assert (interpolated(few) is not None) == is_drawn


def test_a_platform_at_rest_without_noise_is_not_interpolated() -> None:
    values = poses()
    values[:400] = values[400]
    assert interpolated(Trajectory(TIMES, POSE, values)) is None


@pytest.mark.parametrize("length", [2, 4, 6, 15])
def test_what_fills_a_gap_goes_with_its_first_sample(length) -> None:
    """Poses of the origin while markers were hidden, as some programs write them."""
    values = poses() + 1.0
    values[300 : 300 + length] = 0.0
    found = sound(values)
    assert np.flatnonzero(~found.is_known).tolist() == list(range(300, 300 + length))
    assert "1 times a sample that stands far from those around is repeated" in found.notes[-1]
    assert "3.00 s: it fills a gap and is left out" in found.notes[-1]
