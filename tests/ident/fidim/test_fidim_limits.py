"""What FIDIM and its judges decide, on both sides of every limit, on made numbers."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportOptionalCall=false

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.ident.fidim import fidim as module
from freeswing.ident.fidim import slack_runs, weighted_least_squares
from freeswing.ident.fidim.essential_parameters import near_zero
from freeswing.ident.fidim.total_least_squares import TotalLeastSquares
from freeswing.ident.judge.free_against_full import between_runs
from freeswing.ident.judge.physical_consistency import Consistency, least_moment, nearest_possible


def solved(**changes):
    """What the verdicts look at of a solution."""
    return SimpleNamespace(**({"cost_C": 5.0, "std_percent": np.zeros(9)} | changes))


@pytest.mark.parametrize(("cost", "said"), [(99.0, 0), (101.0, 1)])
def test_excitation_is_poor_above_a_hundred(cost, said):
    assert len(module._verdicts(solved(cost_C=cost), np.ones(9, dtype=bool))) == said


@pytest.mark.parametrize(("percent", "said"), [(9.5, 0), (10.5, 1)])
def test_a_parameter_is_well_identified_to_a_tenth(percent, said):
    found = solved(std_percent=np.full(9, percent))
    assert len(module._verdicts(found, np.ones(9, dtype=bool))) == said


@pytest.mark.parametrize(("share", "small"), [(0.095, True), (0.105, False)])
def test_a_value_is_near_zero_below_a_tenth_of_the_largest(share, small):
    values = np.array([1.0, share, 1.0, 2.0, 2.0, 2.0, 2.0 * share, 2.0, 2.0])
    assert near_zero(values).tolist() == [False, small, *[False] * 4, small, False, False]


@pytest.mark.parametrize(
    ("least", "second", "lost"), [(0.51, 1.0, True), (0.49, 1.0, False), (0.0, 0.9e-9, True)]
)
def test_rank_is_lost_where_the_least_values_are_alike(least, second, lost):
    """By less than a factor of two, or where the last but one is nothing beside the first."""
    values = np.r_[np.ones(8), second, least]
    seen = SimpleNamespace(singular_values=values, gap=second / max(least, 1e-300))
    assert TotalLeastSquares.loses_rank.fget(seen) == lost


def test_a_small_but_clear_direction_is_no_lost_rank():
    seen = SimpleNamespace(singular_values=np.r_[np.ones(8), 1.1e-9, 0.0], gap=np.inf)
    assert not TotalLeastSquares.loses_rank.fget(seen)


@pytest.mark.parametrize(("deviations", "refuted"), [(2.9, False), (3.1, True)])
def test_a_body_is_ruled_out_beyond_three_deviations(deviations, refuted):
    """Free, by the least moment; held, by what the holding costs."""
    assert Consistency(-deviations, 1.0).is_refuted == refuted
    assert Consistency(1.0, 1.0, cost=deviations**2).is_refuted == refuted


def test_two_runs_tell_no_spread_and_three_do():
    without = np.tile(np.arange(3.0)[:, None], (1, 9))
    assert between_runs(without[:2]).tolist() == [0.0] * 9
    assert (between_runs(without) > 0.5).all()


@pytest.mark.parametrize(("off", "slack"), [(1.9, []), (2.1, ["a"])])
def test_a_cable_pushes_where_all_within_two_deviations_say_so(monkeypatch, off, slack):
    """The estimate's first number is so many deviations below where the cable goes slack."""
    monkeypatch.setattr(slack_runs, "lowest_tension", lambda model, motion, one: (one[0], "1"))
    solution = SimpleNamespace(covariance=1e-4 * np.eye(9))
    inertias = slack_runs.within_reach(
        SimpleNamespace(solution=solution, values=np.r_[-0.01 * off, np.zeros(8)])
    )
    run = SimpleNamespace(name="a", full=True, run=SimpleNamespace(payload=None))
    found = slack_runs.slack_runs(None, SimpleNamespace(runs=[run]), inertias, True)
    assert list(found) == slack


def test_errors_of_the_equations_repeat_within_a_second(monkeypatch):
    """Errors that never change: their sum's variance grows by Bartlett's weights of a second."""
    n, period_s = 20000, 0.01
    W = np.zeros((n, 1, 10))
    W[:, 0, :2] = 1.0
    monkeypatch.setattr(weighted_least_squares, "_weights", lambda run, chi: np.ones((n, 1, 1)))
    run = SimpleNamespace(W=W, period_s=period_s)
    spread = weighted_least_squares._score_spread([run], np.eye(10)[0], np.zeros((10, 10)))
    assert spread[0, 0] * n == pytest.approx(1.0 / period_s, rel=0.03)


@pytest.mark.parametrize(("thick_mm", "kept"), [(0.95, False), (1.05, True)])
def test_a_body_is_a_millimetre_thick(thick_mm, kept):
    """Root mean square distance from a plane; a thinner one is made as thick as that."""
    x, y, z = 0.02, 0.03, (1e-3 * thick_mm) ** 2
    body = np.array([0.0, 0.0, 0.0, y + z, x + z, x + y, 0.0, 0.0, 0.0])
    found = nearest_possible(body, 1e-6 * np.eye(9))
    assert (found == body).all() == kept
    if not kept:
        assert np.sqrt(least_moment(found)[0]) == pytest.approx(1e-3, rel=0.03)
