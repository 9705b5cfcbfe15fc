"""What a joint problem follows of a step, and where it leaves off."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.ident.likelihood.joint_problem import Problem, State
from freeswing.ident.likelihood.samples_and_noise import prepare
from tests.ident.swings import TRUE_INERTIA, paper_model, recorded, swing


@pytest.fixture(scope="module")
def problem() -> tuple[Problem, State]:
    """Two runs of 0.6 s, from an inertia that is a little off."""
    motions = [swing(k, duration_s=0.6) for k in (2, 3)]
    samples = [prepare(recorded(one, f"run-{k}"), (0.0, 0.6)) for k, one in enumerate(motions)]
    starts = np.array([np.concatenate([one.zetas[0], one.rates[0]]) for one in motions])
    found = Problem(paper_model(), samples)
    state = State(1.02 * TRUE_INERTIA, np.zeros(0), starts, np.ones(2))
    return found, found.simulated(state)


def test_a_step_that_costs_more_than_it_may_is_none(problem: tuple[Problem, State]) -> None:
    joint, state = problem
    linear = joint.linear(state)
    step = joint.step(state, linear, 0.0)
    free = joint.moved(state, step, linear.surroundings)
    assert free is not None
    cost = joint.cost(free)
    within = joint.moved(state, step, linear.surroundings, cost)
    assert within is not None
    np.testing.assert_array_equal(within.starts, free.starts)
    assert joint.moved(state, step, linear.surroundings, cost * (1.0 - 1e-9)) is None


def test_no_run_is_followed_once_the_others_cost_too_much(
    problem: tuple[Problem, State], monkeypatch: pytest.MonkeyPatch
) -> None:
    joint, state = problem
    linear = joint.linear(state)
    step = joint.step(state, linear, 0.0)
    seen: list[int] = []
    followed = Problem._followed

    def counted(self: Problem, of: State, run: int, *rest: object):
        seen.append(run)
        return followed(self, of, run, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(Problem, "_followed", counted)
    assert joint.moved(state, step, linear.surroundings, 1e-9) is None
    assert seen == [0]
