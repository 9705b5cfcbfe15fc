"""A fit's unknowns by name: what a refit with fewer or more effects starts from."""

from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.known_values import with_known, without_effect
from freeswing.ident.diagnose.refit import BY_LENGTHS, _joined
from freeswing.ident.likelihood.blocks import (
    INERTIA,
    PAYLOADS,
    STARTS,
    columns_of,
    each_run,
    effect_blocks,
    effect_values,
    free_of,
    model_unknowns,
    state_of,
    with_effect_values,
)
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_swings import ONWARD, Swings
from freeswing.ident.likelihood.joint_problem import State
from freeswing.ident.likelihood.payload_runs import Loads
from freeswing.ident.likelihood.samples_and_noise import prepare
from freeswing.ident.likelihood.unknowns import Gaussian
from freeswing.ident.runs import Payload
from tests.ident.swings import TRUE_INERTIA, paper_model, recorded, swing

EFFECTS = ("harmonic_force", "translational_drag")


@pytest.fixture(scope="module")
def found():
    """One step from near the truth: a run alone, one with a payload, two effects."""
    motions = [swing(k, duration_s=0.6) for k in (2, 3)]
    payloads = (None, Payload(1.0, np.array([0.2, 0.1, 0.0])))
    runs = [
        recorded(motion, f"run-{k}", payload=payload)
        for k, (motion, payload) in enumerate(zip(motions, payloads, strict=True))
    ]
    model = build_model(paper_model().robot, EFFECTS)
    samples = [prepare(run, (0.0, 0.6)) for run in runs]
    starts = np.array([np.concatenate([m.zetas[0], m.rates[0]]) for m in motions])
    own = np.arange(1.0, 1.0 + 2 * len(model.own_values)).reshape(2, -1) * 1e-3
    loads = Loads.of(payloads)
    state = State(
        TRUE_INERTIA, model.start_values, starts, np.ones(2), own_values=own, loads=np.zeros(7)
    )
    free = np.ones(9 + len(model.parameters) + loads.count, dtype=bool)
    free[columns_of(model, "translational_drag")[0]] = False
    unknowns = model_unknowns(model, loads, state, free)
    return fit(Swings(model, tuple(samples), np.ones(2)), unknowns, replace(ONWARD, steps=1))


def test_the_blocks_are_the_vectors(found):
    unknowns = found.unknowns
    assert unknowns.names == (
        INERTIA,
        EFFECTS[0],
        each_run(EFFECTS[0]),
        EFFECTS[1],
        PAYLOADS,
        STARTS,
    )
    assert unknowns.block(INERTIA).value.tolist() == found.inertia.tolist()
    for name in EFFECTS:
        where = found.model.place_of(name)
        assert unknowns.block(name).value.tolist() == found.values[where].tolist()
        assert unknowns.columns(name).tolist() == columns_of(found.model, name).tolist()
        assert (
            unknowns.block(name).mask.tolist() == found.free[columns_of(found.model, name)].tolist()
        )
    assert found.std(PAYLOADS).tolist() == found.stds[-7:].tolist()
    assert found.covariance_of(INERTIA).tolist() == found.covariance[:9, :9].tolist()
    joint = found.covariance_of(PAYLOADS, INERTIA)
    assert joint[:7, 7:].tolist() == found.covariance[-7:, :9].tolist()
    white = float(sum(np.sum(run**2) for run in found.residuals))
    assert 0.0 < white <= found.cost, (white, found.cost)
    starts = [np.concatenate([m.zetas[0], m.rates[0]]).tolist() for m in found.motions]
    assert unknowns.value(STARTS).tolist() == starts
    own = np.array([m.values[found.model.own_values] for m in found.motions])
    assert unknowns.block(each_run(EFFECTS[0])).value.tolist() == own.tolist()


def test_nothing_is_lost_where_an_effect_leaves(found):
    """Payloads stay, and so does what each run has for itself of another effect."""
    fewer = without_effect(found.model, EFFECTS[1])
    left = state_of(found.unknowns.without(EFFECTS[1]), fewer, found.scales)
    assert np.abs(found.value(PAYLOADS)).max() > 0.0, "the payloads have been fitted"
    np.testing.assert_array_equal(left.loads, found.value(PAYLOADS))  # pyright: ignore[reportArgumentType]
    assert left.values.tolist() == found.values[found.model.place_of(EFFECTS[0])].tolist()
    own = found.value(each_run(EFFECTS[0]))
    assert own.any()
    np.testing.assert_array_equal(left.own_values, own)  # pyright: ignore[reportArgumentType]
    none = found.unknowns.without(EFFECTS[0], each_run(EFFECTS[0]))
    bare = state_of(none, without_effect(found.model, EFFECTS[0]), found.scales)
    assert bare.own_values is not None
    assert bare.own_values.shape == (2, 0)
    np.testing.assert_array_equal(bare.loads, found.value(PAYLOADS))  # pyright: ignore[reportArgumentType]
    assert bare.values.tolist() == found.values[found.model.place_of(EFFECTS[1])].tolist()


def test_a_candidate_comes_before_the_payloads(found):
    """Masks and values follow the model's order, wherever a block was joined."""
    values = np.zeros(3 * found.model.robot.n_cables)
    model, unknowns = _joined(found.model, found.unknowns, "anchor_offset:2", values, 2)
    assert model.effects == (*EFFECTS, "anchor_offset")
    free = free_of(unknowns, model)
    assert len(free) == 9 + len(model.parameters) + 7
    assert free[: 9 + len(found.values)].tolist() == found.free[: 9 + len(found.values)].tolist()
    assert free[columns_of(model, "anchor_offset")].sum() == 3
    state = state_of(unknowns, model, found.scales)
    assert len(state.values) == len(model.parameters)
    np.testing.assert_array_equal(state.loads, found.value(PAYLOADS))  # pyright: ignore[reportArgumentType]
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


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (lambda u: u.known(INERTIA, Gaussian(np.zeros(9), np.ones(9), "a guess")), "prior"),
        (lambda u: u.held(STARTS), "mask"),
        (lambda u: u.exchanged(replace(u.block(INERTIA), low=np.zeros(9))), "bounds"),
        (lambda u: u.joined(replace(u.block(INERTIA), name="sway")), "sway"),
        (lambda u: u.without(EFFECTS[1]), EFFECTS[1]),
    ],
)
def test_what_would_not_be_heard_is_refused(found, changed, said):
    with pytest.raises(ValueError, match=said):
        fit(found.swings, changed(found.unknowns), replace(ONWARD, steps=1))


def test_other_values_of_effects_leave_all_else(found):
    values = np.arange(1.0, 1.0 + len(found.values))
    told = with_effect_values(found.unknowns, found.model, values)
    assert effect_values(told, found.model).tolist() == values.tolist()
    assert free_of(told, found.model).tolist() == found.free.tolist()
    for name in (INERTIA, each_run(EFFECTS[0]), PAYLOADS, STARTS):
        assert told.value(name).tolist() == found.value(name).tolist()


def test_all_that_runs_share_is_held_and_their_own_is_not(found):
    held = found.unknowns.all_held()
    assert not free_of(held, found.model).any()
    assert all(block.mask.all() for block in held.own)


def test_what_a_block_knows_is_heard(found):
    """Drag that is known to be nothing stays so; where nothing is known it moves farther."""
    name = EFFECTS[1]
    start = found.unknowns.estimating(name, np.array([True, False]))
    known = Gaussian(np.array([0.0, 0.5]), np.array([1e-9, 0.5]), "a wind tunnel")
    asked = (start.known(name, known), start, start.known(name, None))
    told, usual, free = (fit(found.swings, one, replace(ONWARD, steps=4)) for one in asked)
    rates = [abs(float(one.value(name)[0])) for one in (told, usual, free)]
    assert rates[0] < 1e-8 < rates[1] < rates[2], rates
    stds = [float(one.std(name)[0]) for one in (told, usual, free)]
    assert stds[0] < 1.01e-9 * told.enlargement < stds[1] < stds[2], stds
    prior = told.unknowns.block(name).prior
    assert prior is not None
    assert prior.source == "a wind tunnel"
    assert free.unknowns.block(name).prior is None


def test_what_is_known_jointly_is_a_matter_of_the_unknowns(found):
    """The model's joint Gaussian and the same said of the blocks: the same fit, bit for bit."""
    model, size = found.model, len(found.values)
    spread = np.array([p.prior_std for p in model.parameters])
    chosen = np.array([size - 2, size - 1])
    covariance = np.outer(spread[chosen], spread[chosen]) * np.array([[1.0, 0.9], [0.9, 1.0]])
    told = with_known(model, chosen, model.start_values[chosen], covariance, BY_LENGTHS)
    asked = found.unknowns.estimating(EFFECTS[1], np.ones(2, dtype=bool))
    by_model = with_effect_values(asked, told, found.values)
    by_hand = asked.known_together(model.effects, told.correlations)
    assert by_model.correlations is not None
    np.testing.assert_array_equal(by_model.correlations, by_hand.correlations)
    fits = [
        fit(replace(found.swings, model=told, motions=()), by_model, replace(ONWARD, steps=2)),
        fit(replace(found.swings, motions=()), by_hand, replace(ONWARD, steps=2)),
    ]
    np.testing.assert_array_equal(fits[0].values, fits[1].values)
    np.testing.assert_array_equal(fits[0].covariance, fits[1].covariance)
    alone = fit(replace(found.swings, motions=()), asked, replace(ONWARD, steps=2))
    # Where the drag's centre is told by its rate alone: conditioning of Gaussians.
    known, told_of = spread[chosen], fits[1].std(EFFECTS[1]) / np.sqrt(fits[1].enlargement)
    left = known[1] * np.sqrt(1.0 - 0.9**2 + (0.9 * told_of[0] / known[0]) ** 2)
    assert told_of[1] == pytest.approx(left, rel=0.02)
    alone = alone.std(EFFECTS[1])[1] / np.sqrt(alone.enlargement)
    assert alone == pytest.approx(known[1], rel=0.02)
    assert fits[1].unknowns.correlations is not None
