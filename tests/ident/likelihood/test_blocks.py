"""A fit's unknowns by name: what a refit with fewer or more effects starts from."""

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.known_values import with_known, without_effect
from freeswing.ident.diagnose.refit import BY_LENGTHS, _joined
from freeswing.ident.likelihood.blocks import (
    INERTIA,
    PAYLOADS,
    columns_of,
    each_run,
    effect_blocks,
    free_of,
)
from freeswing.ident.likelihood.fit_swings import fit
from freeswing.ident.likelihood.joint_problem import State
from freeswing.ident.likelihood.raw_samples import prepare
from freeswing.ident.runs import Payload
from tests.ident.swings import TRUE_INERTIA, paper_model, recorded, swing

EFFECTS = ("harmonic_force", "translational_drag")


@pytest.fixture(scope="module")
def found():
    """One step from near the truth: a run alone, one with a payload, two effects."""
    motions = [swing(k, duration_s=0.6) for k in (2, 3)]
    payloads = (None, Payload(1.0, [0.2, 0.1, 0.0]))
    runs = [
        recorded(motion, f"run-{k}", payload=payload)
        for k, (motion, payload) in enumerate(zip(motions, payloads, strict=True))
    ]
    model = build_model(paper_model().robot, EFFECTS)
    samples = [prepare(run, run.window_s) for run in runs]
    starts = np.array([np.concatenate([m.zetas[0], m.rates[0]]) for m in motions])
    own = np.arange(1.0, 1.0 + 2 * len(model.own_values)).reshape(2, -1) * 1e-3
    state = State(
        TRUE_INERTIA, model.start_values, starts, np.ones(2), own_values=own, loads=np.zeros(7)
    )
    free = np.ones(9 + len(model.parameters), dtype=bool)
    free[columns_of(model, "translational_drag")[0]] = False
    return fit(model, samples, state, free, estimate_scales=False, grow=False, steps=1)


def test_the_blocks_are_the_vectors(found):
    unknowns = found.unknowns
    assert unknowns.names == (
        INERTIA,
        EFFECTS[0],
        each_run(EFFECTS[0]),
        EFFECTS[1],
        PAYLOADS,
    )
    assert unknowns.block(INERTIA).value.tolist() == found.inertia.tolist()
    for name in EFFECTS:
        where = found.model.place_of(name)
        assert unknowns.block(name).value.tolist() == found.values[where].tolist()
        assert unknowns.columns(name).tolist() == columns_of(found.model, name).tolist()
        assert (
            unknowns.block(name).mask.tolist() == found.free[columns_of(found.model, name)].tolist()
        )
    assert unknowns.block(PAYLOADS).value.tolist() == found.loads.tolist()
    assert found.std_of(PAYLOADS).tolist() == found.std[-len(found.loads) :].tolist()
    assert found.covariance_of(INERTIA).tolist() == found.covariance[:9, :9].tolist()
    solution = found.solution
    assert solution.covariance_of(PAYLOADS, INERTIA).tolist() == (
        found.covariance_of(PAYLOADS, INERTIA).tolist()
    )
    assert solution.std(PAYLOADS).tolist() == found.std_of(PAYLOADS).tolist()
    white = float(sum(np.sum(run**2) for run in solution.residuals))
    assert 0.0 < white <= solution.cost == found.cost, (white, solution.cost)
    assert (solution.rank, solution.stop) == (found.rank, found.stop)
    own = np.array([m.values[found.model.own_values] for m in found.motions])
    assert unknowns.block(each_run(EFFECTS[0])).value.tolist() == own.tolist()


def test_nothing_is_lost_where_an_effect_leaves(found):
    """Payloads stay, and so does what each run has for itself of another effect."""
    fewer = without_effect(found.model, EFFECTS[1])
    left = found.unknowns.without(EFFECTS[1])
    state = found.start_of(left, fewer, found.scales)
    assert state.loads.tolist() == found.loads.tolist()
    assert np.abs(state.loads).max() > 0.0, "the payloads have been fitted"
    assert state.values.tolist() == found.values[found.model.place_of(EFFECTS[0])].tolist()
    assert state.own_values.tolist() == found.state.own_values.tolist()
    none = found.unknowns.without(EFFECTS[0], each_run(EFFECTS[0]))
    bare = found.start_of(none, without_effect(found.model, EFFECTS[0]), found.scales)
    assert bare.own_values.shape == (2, 0)
    assert bare.loads.tolist() == found.loads.tolist()
    assert bare.values.tolist() == found.values[found.model.place_of(EFFECTS[1])].tolist()


def test_a_candidate_comes_before_the_payloads(found):
    """Masks and values follow the model's order, wherever a block was joined."""
    values = np.zeros(3 * found.model.robot.n_cables)
    model, unknowns = _joined(found.model, found.unknowns, "anchor_offset:2", values, 2)
    assert model.effects == (*EFFECTS, "anchor_offset")
    free = free_of(unknowns, model)
    assert len(free) == 9 + len(model.parameters)
    assert free[: 9 + len(found.values)].tolist() == found.free[: 9 + len(found.values)].tolist()
    assert free[columns_of(model, "anchor_offset")].sum() == 3
    state = found.start_of(unknowns, model, found.scales)
    assert len(state.values) == len(model.parameters)
    assert state.loads.tolist() == found.loads.tolist()
    again, more = _joined(model, unknowns, "anchor_offset:1", values, 2)
    assert again is model
    assert free_of(more, model)[columns_of(model, "anchor_offset")].sum() == 6


def test_what_is_known_says_by_whom(found):
    """An effect that the lengths have settled is told by the source of its prior alone."""
    model = build_model(paper_model().robot, ("anchor_offset",))
    nothing = np.zeros(len(model.parameters))
    block = effect_blocks(model, "anchor_offset", nothing, nothing == 0.0, np.zeros((1, 0)))[0]
    assert block.prior is not None
    assert "plausible" in block.prior.source
    places = np.arange(3)
    spread = np.array([p.prior_std for p in model.parameters[:3]])
    # The very mean and deviation that the plausible range gives: it is known all the same.
    known = with_known(model, places, np.zeros(3), np.diag(spread**2), BY_LENGTHS)
    block = effect_blocks(known, "anchor_offset", nothing, nothing == 0.0, np.zeros((1, 0)))[0]
    assert block.prior is not None
    assert block.prior.source == BY_LENGTHS
    assert [bool(p.source) for p in known.parameters[:4]] == [True, True, True, False]
