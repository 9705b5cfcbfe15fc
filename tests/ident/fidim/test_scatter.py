"""Scatter of FIDIM's solution by stretches, and shares of the weighted form."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.ident.fidim import bias
from freeswing.ident.fidim.bias import SETTLED, smoothing_bias
from freeswing.ident.fidim.scatter import scattered
from freeswing.ident.fidim.shares import Stack
from freeswing.ident.fidim.total_least_squares import least_by_noise, total_least_squares
from freeswing.ident.fidim.weighted_least_squares import (
    NoisyRegressor,
    weighing,
    weighted_fidim,
)
from tests.ident.swings import TRUE_INERTIA

ALL = np.ones(9, dtype=bool)
TIMES_S = np.arange(200) / 10.0


def drawn(rng: np.random.Generator, exact: np.ndarray, sizes: np.ndarray) -> tuple:
    """Deviations by eq. 33 and by stretches, and the values, of one draw of noise."""
    W = exact + 0.01 * sizes * rng.standard_normal(exact.shape)
    solution = total_least_squares(W.reshape(-1, 10))
    told = scattered(solution.covariance, Stack([W], ALL), [TIMES_S])
    return solution.std, np.sqrt(np.diag(told)), solution.values


def exact_equations(rng: np.random.Generator, loud: float) -> tuple[np.ndarray, np.ndarray]:
    """Equations of 20 s that hold, and their sizes: one second `loud` times as large as others."""
    sizes = np.ones((200, 1, 1))
    sizes[80:90] = loud
    exact = sizes * rng.standard_normal((200, 2, 10))
    exact[..., 0] -= exact @ np.append(1.0, TRUE_INERTIA)
    return exact, sizes


@pytest.mark.parametrize(("loud", "raised"), [(1.0, False), (30.0, True)])
def test_deviations_are_those_of_stretches_where_few_equations_outweigh_the_others(loud, raised):
    """A second thirty times as loud: the values scatter several times as far as eq. 33 says."""
    rng = np.random.default_rng(3)
    exact, sizes = exact_equations(rng, loud)
    draws = [drawn(rng, exact, sizes) for _ in range(40)]
    published, told, values = (np.array(one) for one in zip(*draws, strict=True))
    apart = values.std(axis=0)
    assert (np.median(apart / published.mean(axis=0)) > 2.0) == raised
    if raised:
        ratio = np.median(apart / np.sqrt(np.mean(told**2, axis=0)))
        assert 0.4 < ratio < 1.2, f"{ratio} of the told deviations"
    else:
        assert (told / published).mean() == pytest.approx(1.0, abs=0.1)


def noisy_run(rng: np.random.Generator) -> NoisyRegressor:
    """Equations with a third column ten times as noisy as the others, the noise told."""
    exact = exact_equations(rng, 1.0)[0]
    std = np.full(10, 0.01)
    std[3] = 0.1
    answers = np.broadcast_to(np.eye(20).reshape(20, 2, 10), (200, 20, 2, 10)) * 1.0
    W = exact + std * rng.standard_normal((200, 2, 10))
    covariances = np.broadcast_to(np.diag(np.tile(std, 2) ** 2), (200, 20, 20))
    return NoisyRegressor(W, answers, covariances, 0.1)


def test_the_weighted_form_held_as_it_is_gives_its_own_values():
    rng = np.random.default_rng(5)
    runs = [noisy_run(rng) for _ in range(3)]
    found = weighted_fidim(runs, TRUE_INERTIA)
    stack = Stack([run.W for run in runs], ALL, weighing(runs, found.values))
    assert stack.values[:9] == pytest.approx(found.values, rel=1e-6)
    assert stack.alone({k: run.W for k, run in enumerate(runs)}) == pytest.approx(stack.values)
    shorter = stack.alone({k: run.W[1:-1] for k, run in enumerate(runs)})[:9]
    assert np.abs((shorter - found.values) / np.sqrt(np.diag(found.covariance))).max() < 1.0
    without = stack.without_each(stack.rows)
    assert without.shape == (3, 9)
    assert np.isfinite(without).all()


def test_parts_without_which_rank_is_lost_have_no_number():
    rng = np.random.default_rng(6)
    stack = Stack([exact_equations(rng, 1.0)[0]], ALL)
    assert np.isnan(stack.without_each(stack.rows)).all()


def test_noise_of_all_columns_alike_gives_total_least_squares():
    rng = np.random.default_rng(7)
    rows = rng.standard_normal((60, 10))
    values, size = least_by_noise(rows, np.eye(10))
    solution = total_least_squares(rows)
    assert values == pytest.approx(solution.values, rel=1e-9)
    assert size == pytest.approx(solution.singular_values[-1] ** 2)
    with pytest.raises(ValueError, match="rank"):
        least_by_noise(np.zeros((20, 10)), np.eye(10))
    with pytest.raises(ValueError, match="noise explains nothing"):
        least_by_noise(rows, np.zeros((10, 10)))


@pytest.mark.parametrize(("size", "asked"), [(0.45, 1), (0.55, 3)])
def test_smoothing_is_asked_again_where_its_share_moves_by_half_a_scatter(monkeypatch, size, asked):
    """Smoothing that takes half of what lies beyond zero: the share is asked until it stays."""
    calls = []

    def halved(*given):
        calls.append(given[-1])
        return np.full(9, size) if len(calls) == 1 else np.full(9, 2.0 * size)

    monkeypatch.setattr(bias, "_smoothed_away", halved)
    stack = SimpleNamespace(values=np.zeros(9))
    found = smoothing_bias(None, [], False, None, stack, np.ones(9))
    assert len(calls) == asked, f"{SETTLED}"
    assert found.changes[0] == pytest.approx(np.full(9, size if asked == 1 else 2.0 * size))


def test_what_smoothing_left_is_found_by_asking_swings_nearer_to_the_platforms(monkeypatch):
    """It takes away eight tenths of a value: of 1.0 seen 5.0 were there, and noise added 0.3."""
    monkeypatch.setattr(bias, "_smoothed_away", lambda *given: -0.8 * given[-1])
    stack = SimpleNamespace(values=np.full(9, 1.3))
    found = smoothing_bias(None, [], False, None, stack, np.full(9, 1e-3), np.full(9, 0.3))
    assert found.changes[0] == pytest.approx(np.full(9, -4.0), rel=1e-6)


def test_swings_that_no_body_has_any_more_end_the_asking(monkeypatch):
    def once(*given):
        if given[-1][0] != 1.0:
            raise ValueError("no free swing")
        return np.full(9, -0.8)

    monkeypatch.setattr(bias, "_smoothed_away", once)
    stack = SimpleNamespace(values=np.ones(9))
    found = smoothing_bias(None, [], False, None, stack, np.full(9, 1e-3))
    assert found.changes[0] == pytest.approx(np.full(9, -0.8))
