"""A fit begins at the motions that a state brings along only where they are its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.free_motion import admissible_rates
from freeswing.ident.likelihood.blocks import model_unknowns
from freeswing.ident.likelihood.fit_swings import Swings
from freeswing.ident.likelihood.joint_problem import Problem, State
from freeswing.ident.likelihood.payload_runs import Loads
from freeswing.ident.likelihood.run_residuals import Samples
from tests.cdpr.model_cases import swing_start


def problem_and_state(tolerance_m: float = 1e-8) -> tuple[Problem, State]:
    model, inertia, zeta, rates = swing_start("bologna-4", ("translational_drag",))
    values = model.start_values
    times = np.linspace(0.0, 0.5, 20)
    samples = Samples(
        "one", times, ("x", "y"), np.zeros((20, 2)), np.tile(np.eye(2), (20, 1, 1)),
        np.zeros(2, dtype=int), None, 1.0, (0.0, 0.5),
    )  # fmt: skip
    problem = Problem(model, [samples], estimate_scales=False, tolerance_m=tolerance_m)
    speeds = admissible_rates(model, zeta, rates, inertia, values)
    start = np.concatenate([zeta, speeds])[None]
    return problem, problem.simulated(State(inertia, values, start, np.ones(2)))


def test_its_own_motions_stay() -> None:
    problem, state = problem_and_state()
    assert problem.begun(state).motions[0] is state.motions[0]


@pytest.mark.parametrize("what", ["start", "inertia", "values", "none", "tolerance", "model"])
def test_others_are_simulated(what: str) -> None:
    problem, state = problem_and_state()
    if what == "start":
        state = replace(state, starts=state.starts + 1e-5 * np.eye(12)[:1])
    elif what == "inertia":
        state = replace(state, inertia=state.inertia * 1.001)
    elif what == "values":
        state = replace(state, values=state.values + 0.01)
    elif what == "none":
        state = replace(state, motions=())
    elif what == "tolerance":
        problem.tolerance_m = 1e-12
    else:
        problem.model = replace(problem.model)
    before = state.motions
    found = problem.begun(state).motions
    assert len(found) == 1
    assert not before or found[0] is not before[0]
    np.testing.assert_array_equal(found[0].inertia, state.inertia)
    np.testing.assert_array_equal(found[0].values, state.values)


def test_motions_are_carried_into_a_model_that_adds_nothing_yet() -> None:
    _, state = problem_and_state()
    wider = build_model(state.motions[0].model.robot, ("translational_drag", "rotational_drag"))
    swings = Swings(state.motions[0].model, (), np.ones(2), state.motions)
    free = np.ones(9 + len(state.values) + 1, dtype=bool)
    nothing, there = (
        model_unknowns(wider, Loads.of([None]), replace(state, values=values), free)
        for values in (np.append(state.values, 0.0), np.append(state.values, 0.05))
    )
    carried = swings.under(wider, nothing, 1e-8)
    assert carried.model is wider
    assert carried.motions[0].model is wider
    assert carried.motions[0].accelerations is state.motions[0].accelerations
    assert swings.under(wider, there, 1e-8).motions == ()
