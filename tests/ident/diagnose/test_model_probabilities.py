"""Probabilities of rival models: noise, many unknowns, leads of one run, unknown discrepancies."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.ident.diagnose.model_probabilities import (
    CHANCE_OF_EFFECT,
    LeftOut,
    Rival,
    log_evidence,
    log_predictive,
    model_probabilities,
    numbers_taken,
)

RUNS, SAMPLES = 7, 300
COUNTS = np.full(RUNS, float(SAMPLES))
MANY, FEW = np.full(RUNS, 200.0), np.full(RUNS, 20.0)


def rivals(seed, columns, truth, share=None):
    """No effect, and one effect with some unknowns in each place of `columns`.

    Args:
        seed: of the noise.
        columns: how many unknowns each model has, of a prior of one each.
        truth: value of all unknowns of the first model, in each run (RUNS,) or in all.
        share: how much of the first model's column the second one's holds.
    """
    rng = np.random.default_rng(seed)
    seen = [rng.normal(size=(RUNS, SAMPLES, n)) / np.sqrt(SAMPLES) * 30.0 for n in columns]
    if share is not None:
        seen[1] = share * seen[0] + np.sqrt(1.0 - share**2) * seen[1]
    size = np.broadcast_to(truth, RUNS)[:, None]
    right = rng.normal(size=(RUNS, SAMPLES)) - size * seen[0].sum(axis=2)
    found = []
    for values in (np.zeros((RUNS, SAMPLES, 0)), *seen):
        together = np.concatenate([values, right[..., None]], axis=2)
        n = values.shape[2]
        prior = np.column_stack([np.eye(n), np.zeros(n)])
        triangles = np.asarray(np.linalg.qr(together, mode="r"))
        found.append(Rival(triangles, prior, int(n > 0)))
    return found


def test_what_no_run_shows_keeps_its_odds():
    none, one = rivals(1, (3,), 0.0)
    blind = Rival(one.triangles * np.array([0.0, 0.0, 0.0, 1.0]), one.prior, 1)
    shares = model_probabilities([none, blind], COUNTS, MANY)
    assert shares.sum() == pytest.approx(1.0)
    assert shares[1] == pytest.approx(CHANCE_OF_EFFECT, rel=0.02)


def test_twelve_unknowns_do_not_win_by_their_number():
    worst = max(
        model_probabilities(rivals(seed, (12, 1), 0.0), COUNTS, MANY)[1:].max()
        for seed in range(12)
    )
    assert worst < 0.2, worst


def test_what_all_runs_show_is_sure_and_what_one_shows_is_not():
    shared = model_probabilities(rivals(2, (1,), 0.12), COUNTS, MANY)
    assert shared[1] > 0.99, shared
    one_run = np.where(np.arange(RUNS) == 3, 0.6, 0.0)
    of_one = model_probabilities(rivals(2, (1,), one_run), COUNTS, MANY)
    assert 0.05 < of_one[1] < 0.95, of_one


def test_two_causes_that_look_alike_share_and_one_that_does_not_is_told_apart():
    alike = model_probabilities(rivals(3, (1, 1), 0.2, share=0.999), COUNTS, MANY)
    assert alike[0] < 1e-3
    assert alike[1:].min() > 0.1, alike
    apart = model_probabilities(rivals(3, (1, 1), 0.2, share=0.5), COUNTS, MANY)
    assert apart[1] > 0.99, apart


def test_ways_that_were_tried_beside_it_count_against_a_model():
    none, one = rivals(4, (1,), 0.1)
    tried = Rival(one.triangles, one.prior, 1, np.log(400.0))
    every = np.ones((1, RUNS))
    lead = log_evidence(one, COUNTS, MANY, every) - log_evidence(none, COUNTS, MANY, every)
    fewer, more = (model_probabilities([none, m], COUNTS, MANY)[1] for m in (tried, one))
    assert fewer < more, lead


def test_evidence_is_the_integral_over_the_unknown():
    _, one = rivals(5, (1,), 0.05)
    weights = np.ones((1, RUNS))
    grid = np.linspace(-1.0, 1.0, 4001)
    rows = np.column_stack([grid, np.ones(len(grid))])
    squares = np.einsum("ga,rka,rkb,gb->gr", rows, one.triangles, one.triangles, rows)
    counts = squares.min(axis=0) + 50.0  # below the noise, where the density is exactly Gaussian
    density = log_predictive(squares, counts, MANY).sum(axis=1) - 0.5 * grid**2
    density[(squares > counts).any(axis=1)] = -np.inf
    top = density.max()
    whole = top + np.log(np.exp(density - top).sum() * (grid[1] - grid[0]) / np.sqrt(2 * np.pi))
    found = log_evidence(one, counts, MANY, weights)[0]
    assert found == pytest.approx(whole, abs=0.05)


def test_at_the_noise_half_the_squares_count_and_above_it_their_ratio():
    at_noise = log_predictive(COUNTS + 0.2, COUNTS, FEW) - log_predictive(COUNTS, COUNTS, FEW)
    assert at_noise == pytest.approx(np.full(RUNS, -0.1), rel=0.03)
    below = log_predictive(COUNTS - 8.0, COUNTS, FEW) - log_predictive(COUNTS, COUNTS, FEW)
    assert below == pytest.approx(np.full(RUNS, 4.0))
    far = log_predictive(200 * COUNTS, COUNTS, FEW) - log_predictive(100 * COUNTS, COUNTS, FEW)
    assert far == pytest.approx(np.full(RUNS, -10.0 * np.log(2.0)), rel=0.02)


def predicted(squares, wider: float = 0.0) -> Any:
    return SimpleNamespace(held_out=squares, wider=np.full(len(squares), wider))


def test_no_single_run_decides_for_all_of_those_left_out() -> None:
    """A day in the laboratory: stretch takes most of five runs, and one stands 180 times the noise.

    In sums of squares the gain was within the scatter from run to run.
    """
    counts, independent = np.full(6, 3592.0), np.full(6, 40.0)
    before = counts * np.array([6.6, 183.2, 40.4, 242.5, 48.9, 172.1])
    after = counts * np.array([2.8, 302.2, 19.4, 23.9, 19.1, 23.4])
    runs = LeftOut(predicted(before), counts, independent, 0.005)
    gains, squares = runs.gains(predicted(after)), before - after
    scatter = np.sqrt(6.0) * np.array([gains.std(ddof=1), squares.std(ddof=1)])
    assert gains.sum() > 2.0 * scatter[0], gains
    assert squares.sum() < 2.0 * scatter[1], squares
    assert runs.share(predicted(after)) == pytest.approx(0.7, abs=0.1)


@pytest.mark.parametrize("size", [0.01, 1.0, 1e3])
def test_the_share_of_runs_that_are_alike_is_that_of_their_excess(size: float) -> None:
    counts = np.full(4, 1000.0)
    runs = LeftOut(predicted((1.0 + size) * counts), counts, np.full(4, 50.0), 0.005)
    assert runs.share(predicted((1.0 + 0.3 * size) * counts)) == pytest.approx(0.7, rel=1e-9)


def test_what_a_prediction_leaves_open_is_charged_whatever_the_run_leaves() -> None:
    """By the logarithm of how much wider it is: at the noise and far above it."""
    counts, wider = np.full(4, 1000.0), 3.0
    for size in (1.0, 100.0):
        runs = LeftOut(predicted(size * counts), counts, np.full(4, 50.0), 0.005)
        assert runs.gains(predicted(size * counts, wider)) == pytest.approx(np.full(4, -1.5))


def test_one_effect_in_thirty_is_there_beforehand():
    none, one = rivals(1, (3,), 0.0)
    blind = Rival(one.triangles * np.array([0.0, 0.0, 0.0, 1.0]), one.prior, 1)
    assert 28.0 < 1.0 / model_probabilities([none, blind], COUNTS, MANY)[1] < 32.0


def rival_of(columns, right, stds, effects):
    """A model of these columns (RUNS, SAMPLES, n), their unknowns known to `stds` beforehand."""
    together = np.concatenate([columns, right], axis=2)
    prior = np.column_stack([np.diag(1.0 / np.asarray(stds)), np.zeros(len(stds))])
    return Rival(np.asarray(np.linalg.qr(together, mode="r")), prior, effects)


def feigned(seed: int, size: float) -> list[list[Rival]]:
    """An error that all runs share does nearly what an effect does: nothing there, and the effect.

    First for those who know of the error, then for those who do not.
    """
    rng = np.random.default_rng(seed)
    effect = rng.normal(size=(RUNS, SAMPLES, 1)) / np.sqrt(SAMPLES) * 30.0
    error = effect + 0.05 * rng.normal(size=effect.shape)
    right = rng.normal(size=(RUNS, SAMPLES, 1)) - size * error
    both = np.concatenate([effect, error], axis=2)
    known = [rival_of(error, right, [0.5], 0), rival_of(both, right, [1.0, 0.5], 1)]
    return [known, [rival_of(effect[..., :0], right, [], 0), rival_of(effect, right, [1.0], 1)]]


def chi_square(rival: Rival) -> float:
    """Of the first unknown, by all runs together."""
    rows = np.vstack([*rival.triangles, rival.prior])
    curves = rows[:, :-1].T @ rows[:, :-1]
    value = np.linalg.solve(curves, rows[:, :-1].T @ rows[:, -1])[0]
    return float(value**2 / np.linalg.inv(curves)[0, 0])


def test_what_an_error_of_all_poses_feigns_is_not_there() -> None:
    """Those who do not know of the error are sure."""
    for seed, size in enumerate((0.1, 0.3, 0.6)):
        known, blind = feigned(seed, size)
        assert model_probabilities(known, COUNTS, MANY)[1] < 0.1
        assert model_probabilities(blind, COUNTS, MANY)[1] > 0.95


def test_nothing_is_accepted_that_its_own_values_do_not_show() -> None:
    """Evidence charges an unknown for what it might have been: it never asks less than they do."""
    told = []
    for seed in range(60):
        for fewer, more in (*feigned(seed, 0.01 * seed), rivals(seed, (1,), 0.003 * seed)):
            chance = model_probabilities([fewer, more], COUNTS, MANY)[1]
            told.append((chance, chi_square(more)))
    sure = [square for chance, square in told if chance > 0.95]
    assert len(sure) > 10, told
    assert min(sure) > 3.84, told


def of_few_numbers(beside: int, left: float) -> np.ndarray:
    """Chances of nothing and of one effect, of a discrepancy that is two numbers in each run.

    The effect leaves this share of it. Unknowns beside it have taken as many numbers more, each
    known to a thousandth of what it may be.
    """
    rng, size = np.random.default_rng(1), SAMPLES + beside
    rows = np.zeros((RUNS, size, beside + 1))
    rows[:, 2:SAMPLES, -1] = rng.normal(size=(RUNS, SAMPLES - 2))
    rows[:, :2, -1] = 1e4 * rng.normal(size=(RUNS, 2))
    rows[:, SAMPLES:, :beside] = 1e7 * np.eye(beside)
    fewer = rows.copy()
    fewer[:, :2, -1] *= left
    prior = np.column_stack([np.eye(beside), np.zeros(beside)])
    models = [
        Rival(np.asarray(np.linalg.qr(one, mode="r")), prior, effects)
        for effects, one in enumerate((rows, fewer))
    ]
    return model_probabilities(models, COUNTS, np.full(RUNS, 2.0))


def test_numbers_that_told_the_inertia_count_too() -> None:
    """Nine of 23 numbers: a model that leaves a quarter of the rest is not charged for the nine.

    A tether that left a thousandth in runs left out had 5e-4 beside nothing.
    """
    alone, beside = (np.log(np.divide(*of_few_numbers(n, 0.7)[::-1])) for n in (0, 9))
    assert abs(beside - alone) < 0.3, (alone, beside)


def test_unknowns_that_no_run_tells_have_taken_nothing() -> None:
    blind = Rival(np.zeros((RUNS, 4, 4)), np.eye(4)[:3], 0)
    assert numbers_taken(blind, COUNTS, MANY) == pytest.approx(0.0)
    seen = Rival(np.tile(np.diag([1e3, 1e3, 0.0, 1.0]), (RUNS, 1, 1)), np.eye(4)[:3], 0)
    assert numbers_taken(seen, COUNTS, MANY) == pytest.approx(2.0, abs=1e-3)
