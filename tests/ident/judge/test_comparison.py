"""Free against full: differences that vary from run to run count as such."""

import numpy as np
import pytest

from freeswing.ident.estimate import fidim_entry
from freeswing.ident.fidim.fidim import fidim
from freeswing.ident.fidim.fidim_stage import _as_runs_say
from freeswing.ident.judge.free_against_full import between_runs, compare

ALL = np.ones(9, dtype=bool)


def test_a_difference_that_one_run_brings_is_no_disagreement_of_the_models():
    rng = np.random.default_rng(3)
    each = 0.1 * rng.normal(size=(10, 9))
    each[4, 5] += 30.0
    whole = each.mean(axis=0)
    without = np.array([np.delete(each, k, axis=0).mean(axis=0) for k in range(10)])
    between = between_runs(without)
    assert between == pytest.approx(each.std(axis=0, ddof=1) / np.sqrt(10))
    free, std = np.ones(9), np.full(9, 0.05)
    before = compare(free, std, free + whole, std, ALL)
    after = compare(free, std, free + whole, std, ALL, between)
    assert before[5].z > 30.0
    assert after[5].z == pytest.approx(1.0, abs=0.1)
    assert [row.z for row in after[:5]] == pytest.approx([row.z for row in before[:5]])


def test_too_few_runs_or_runs_that_do_not_do_alone_say_nothing():
    assert not between_runs(np.ones((2, 9))).any()
    assert not between_runs(np.full((5, 9), np.nan)).any()


def test_fidim_without_each_run_is_fidim_of_the_others():
    rng = np.random.default_rng(4)
    chi = np.concatenate([[1.0], rng.normal(size=9)])
    runs = []
    for _ in range(4):
        W = rng.normal(size=(40, 2, 10))
        W -= (W @ chi)[..., None] * chi / (chi @ chi)
        runs.append(W + 1e-3 * rng.normal(size=W.shape))
    found = fidim(runs)
    for k in range(4):
        rest = fidim(runs[:k] + runs[k + 1 :])
        assert found.without_run[k] == pytest.approx(rest.values, rel=1e-9)
    assert np.isnan(fidim(runs[:1]).without_run).all()


def test_deviations_are_those_between_runs_where_the_models_errors_repeat():
    """Each run sees inertias of its own: scatter within runs says nothing of that."""
    rng = np.random.default_rng(5)
    truth = rng.normal(size=9)

    def entry(apart: float):
        runs = []
        for _ in range(12):
            chi = np.append(1.0, truth + apart * rng.normal(size=9))
            W = rng.normal(size=(200, 2, 10))
            W -= (W @ chi)[..., None] * chi / (chi @ chi)
            runs.append(W + 1e-4 * rng.normal(size=W.shape))
        raw = fidim(runs)
        entry = fidim_entry(raw, (), ())
        return raw, _as_runs_say(entry, raw.solution.covariance, raw.without_run)

    raw, told = entry(0.05)
    assert (told.std > 2.0 * raw.std).all()
    assert np.abs((told.values - truth) / told.std).max() < 3.0
    assert "runs say apart" in told.notes[-1]
    raw, told = entry(0.0)
    assert told.std == pytest.approx(raw.std, rel=0.5)
