"""Slackness is concluded only from an inertia that the swings determine."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from types import SimpleNamespace

import numpy as np

from freeswing.ident.fidim import slack_runs


def raw(std):
    values = np.arange(1.0, 10.0)
    solution = SimpleNamespace(covariance=np.diag(np.full(9, std**2)))
    return SimpleNamespace(values=values, solution=solution)


def slack_with(monkeypatch, std, limit):
    """Runs called slack where a cable pushes as long as the first parameter is below a limit."""

    def lowest(model, motion, inertia):
        return inertia[0] - limit, "2"

    monkeypatch.setattr(slack_runs, "lowest_tension", lowest)
    run = SimpleNamespace(name="swing", full=object(), free=None, run=SimpleNamespace(payload=None))
    prepared = SimpleNamespace(runs=(run,))
    return slack_runs.slack_runs(None, prepared, slack_runs.within_reach(raw(std)), True)


def test_a_sure_inertia_makes_runs_slack_and_an_unsure_one_does_not(monkeypatch):
    assert "cable 2 goes slack" in slack_with(monkeypatch, 0.01, 1.5)["swing"]
    assert slack_with(monkeypatch, 0.3, 1.5) == {}
    assert slack_with(monkeypatch, 0.01, 0.5) == {}


def test_two_deviations_either_way_along_every_axis_are_within_reach():
    found = slack_runs.within_reach(raw(0.5))
    assert found.shape == (19, 9)
    assert np.abs(found - found[0]).max() == np.float64(1.0)
