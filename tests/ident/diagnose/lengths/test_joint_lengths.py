"""Joint model of lengths: wrong blocks found together, priors, honest sizes of slow errors."""

import numpy as np
import pytest

from freeswing.ident.diagnose.lengths.joint_lengths import (
    Blocks,
    honest_covariance,
    log_odds,
    normal_equations,
    solved,
    total,
)
from freeswing.ident.diagnose.lengths.length_noise import repetition, slow_size
from freeswing.ident.diagnose.lengths.length_rows import LengthRows, measured_rates
from freeswing.ident.diagnose.lengths.place_probabilities import set_probabilities

NOISE_M = 5e-5
BLOCKS = Blocks(
    {"first": np.array([0, 1]), "second": np.array([2, 3]), "stretch": np.array([4])},
    np.array([5e-4, 5e-4, 1e-3, 1e-3, 1e-3]),
    12.0 * np.array([5e-4, 5e-4, 1e-3, 1e-3, 1e-3]),
)


def session(truth, seed, slow=0.0, runs=8):
    """Runs of 100 blocks and 2 cables: lengths that unknowns, a constant and noise make."""
    rng = np.random.default_rng(seed)
    found = []
    for run in range(runs):
        shared = 0.2 * rng.normal(size=(100, 2, 5))
        own = np.broadcast_to(np.eye(2), (100, 2, 2))
        wave = np.sin(2 * np.pi * np.arange(100) / 25.0 + rng.uniform(0, 6, (2, 1))).T
        noise = NOISE_M * rng.normal(size=(100, 2)) + slow * rng.normal() * wave
        right = -shared @ truth + noise
        white = np.broadcast_to(NOISE_M**2 * np.eye(2), (100, 2, 2))
        unit = np.broadcast_to(1e-8 * np.eye(2), (100, 2, 2))
        found.append(LengthRows(f"run-{run}", own, shared, right, white, unit, 0.0))
    return found


def test_two_wrong_blocks_and_a_stretch_are_found_together_with_their_values():
    truth = np.array([5e-3, -2e-3, 6e-3, -9e-3, 8e-3])
    normal = normal_equations(session(truth, 1), BLOCKS.gross)
    chances = set_probabilities(normal, BLOCKS)
    assert max(chances, key=lambda one: chances[one]) == ("first", "second", "stretch"), chances
    found = solved(total(normal), BLOCKS.gross)
    off = (found.values - truth) / np.sqrt(np.diag(found.covariance))
    assert np.abs(off).max() < 4.0, off


def test_what_is_within_its_tolerance_is_not_wrong():
    truth = np.array([4e-4, -4e-4, 8e-4, -8e-4, 8e-4])
    normal = normal_equations(session(truth, 2), BLOCKS.gross)
    assert set_probabilities(normal, BLOCKS)[()] > 0.95
    assert log_odds(normal, BLOCKS, ("first",), "first") < 0.0


def test_blocks_that_no_run_shows_are_not_weighed():
    rows = session(np.zeros(5), 3)
    for one in rows:
        one.shared[:, :, 4] = 0.0
    normal = normal_equations(rows, BLOCKS.gross)
    assert all("stretch" not in wrong for wrong in set_probabilities(normal, BLOCKS))


def test_white_noise_alone_has_no_slow_errors_and_a_wave_has_its_size():
    clean = normal_equations(session(np.zeros(5), 4), BLOCKS.gross)
    assert clean.sizes.max() < 1.0, clean.sizes
    slow = normal_equations(session(np.zeros(5), 4, slow=5e-4), BLOCKS.gross)
    assert np.median(slow.sizes) > 5.0, slow.sizes


def test_slow_errors_are_never_smaller_than_the_least():
    rows = [
        LengthRows(o.run, o.own, o.shared, o.right, o.white, o.slow, 1.0)
        for o in session(np.zeros(5), 5)
    ]
    assert normal_equations(rows, BLOCKS.gross).sizes == pytest.approx(1.0)


def test_one_spoiled_run_weighs_less_and_the_others_as_before():
    rows = session(np.zeros(5), 10)
    rng = np.random.default_rng(11)
    rows[3].right[...] += 5e-3 * np.cumsum(rng.normal(size=(100, 2)), axis=0) / 10.0
    sizes = normal_equations(rows, BLOCKS.gross).sizes
    assert sizes[3] > 10.0 * np.delete(sizes, 3).max(), sizes


def test_the_size_that_makes_what_is_left_a_noise_of_one():
    rng = np.random.default_rng(6)
    rows = session(np.zeros(5), 6)
    left = [3e-4 * rng.normal(size=(100, 2)) for _ in rows]
    size = slow_size(rows, left, 1600.0)
    assert size == pytest.approx(np.sqrt(3e-4**2 - NOISE_M**2) / 1e-4, rel=0.1)
    assert slow_size(rows, [0.1 * one for one in left], 1600.0) == 0.0


def test_repetition_is_one_for_white_noise_and_large_for_one_line():
    rng = np.random.default_rng(7)
    assert repetition([rng.normal(size=(400, 2)) for _ in range(5)]) == pytest.approx(1.0, abs=0.1)
    line = np.sin(2 * np.pi * np.arange(400) / 40.0)[:, None]
    assert repetition([line]) > 50.0


def test_runs_that_disagree_widen_the_posterior_and_runs_that_agree_do_not():
    rows = session(np.zeros(5), 8)
    normal = normal_equations(rows, BLOCKS.gross)
    found = solved(total(normal), BLOCKS.gross)
    agreed = honest_covariance(normal, BLOCKS.gross, found)
    ratio = np.sqrt(np.diag(agreed) / np.diag(found.covariance))
    assert ratio.min() > 0.999, ratio
    assert ratio.max() < 2.5, ratio
    for k, one in enumerate(rows):
        one.right[...] -= one.shared @ ((-1.0) ** k * np.array([3e-3, 0.0, 0.0, 0.0, 0.0]))
    torn = normal_equations(rows, BLOCKS.gross)
    found = solved(total(torn), BLOCKS.gross)
    between = np.sqrt(honest_covariance(torn, BLOCKS.gross, found)[0, 0])
    assert between == pytest.approx(3e-3 / np.sqrt(8), rel=0.4), between


def test_too_few_samples_are_refused():
    rows = session(np.zeros(5), 9, runs=1)
    short = [
        LengthRows("r", o.own[:2], o.shared[:2], o.right[:2], o.white[:2], o.slow[:2], 0.0)
        for o in rows
    ]
    with pytest.raises(ValueError, match="too few samples"):
        normal_equations(short, BLOCKS.gross)


def test_below_the_least_size_runs_that_leave_more_than_usual_weigh_less_in_proportion():
    rows = [
        LengthRows(o.run, o.own, o.shared, o.right, o.white, o.slow, 10.0)
        for o in session(np.zeros(5), 12)
    ]
    rows[2].right[...] *= 4.0
    rows[4].right[...] *= 1.8
    rows[5].right[...] *= 1.35
    sizes = normal_equations(rows, BLOCKS.gross).sizes
    assert sizes[2] == pytest.approx(40.0, rel=0.2), sizes
    assert sizes[4] == pytest.approx(17.0, rel=0.1), sizes
    assert np.delete(sizes, [2, 4]) == pytest.approx(10.0), sizes


def test_rates_are_those_of_the_samples_through_gaps_and_noise():
    times = np.delete(np.arange(0.0, 4.0, 0.01), np.r_[100:112, 250])
    noise = 1e-4 * np.random.default_rng(13).normal(size=(len(times), 2))
    values = 0.1 * np.sin(np.outer(times, [4.0, 6.0])) + noise
    rates = measured_rates(times, values)
    true = 0.1 * np.cos(np.outer(times, [4.0, 6.0])) * [4.0, 6.0]
    assert np.sqrt(np.mean((rates - true) ** 2)) < 4e-3  # of 0.35 m/s
