"""Probabilities of gross blocks: closed form, honest where few runs say so, groups."""

import numpy as np
import pytest

from freeswing.ident.diagnose.lengths import place_probabilities
from freeswing.ident.diagnose.lengths.equilibria import Witness
from freeswing.ident.diagnose.lengths.joint_lengths import Blocks, Normal, solved, total
from freeswing.ident.diagnose.lengths.place_probabilities import (
    groups,
    mixed,
    probability,
    set_probabilities,
)
from freeswing.ident.diagnose.lengths.wrong_places import Kinematics, RunLengths, Way, WrongPlace

BLOCKS = Blocks(
    {"first": np.array([0, 1]), "second": np.array([2]), "third": np.array([3])},
    np.full(4, 1e-3),
    np.full(4, 12e-3),
)


def made(truth, noise_m=1e-3, runs=12, seed=0, rows=None):
    """Normal equations of runs that see all unknowns through two dozen numbers each."""
    rng = np.random.default_rng(seed)
    matrices, rights = [], []
    for run in range(runs):
        seen = rng.normal(size=(24, 4)) if rows is None else rows(rng)
        value = np.asarray(truth(run) if callable(truth) else truth)
        left = -seen @ value + noise_m * rng.normal(size=24)
        matrices.append(seen.T @ seen / noise_m**2)
        rights.append(seen.T @ left / noise_m**2)
    return Normal(np.array(matrices), np.array(rights), np.zeros(runs), (), np.ones(runs))


def test_evidence_is_that_of_the_linear_problem_itself(monkeypatch):
    normal = made(np.array([1e-3, 2e-3, -3e-3, 1e-3]), noise_m=8e-3)
    monkeypatch.setattr(place_probabilities, "DRAWS", 1)

    class Even:
        def dirichlet(self, alpha, draws):
            return np.full((draws, len(alpha)), 1.0 / len(alpha))

    monkeypatch.setattr(place_probabilities.np.random, "default_rng", lambda seed: Even())
    found = set_probabilities(normal, BLOCKS)
    odds = np.log(place_probabilities.CHANCE_OF_WRONG / (1.0 - place_probabilities.CHANCE_OF_WRONG))
    logs = {
        wrong: solved(total(normal), BLOCKS.spread(wrong)).log_evidence + odds * len(wrong)
        for wrong in found
    }
    none = logs[()]
    for wrong, log in logs.items():
        assert np.log(found[wrong] / found[()]) == pytest.approx(log - none, abs=1e-6), wrong


def test_what_all_runs_show_is_sure_and_what_is_within_tolerance_is_improbable():
    found = set_probabilities(made(np.array([8e-3, -6e-3, 5e-4, -5e-4])), BLOCKS)
    assert probability(found, ["first"]) > 0.99
    assert max(probability(found, ["second"]), probability(found, ["third"])) < 0.1
    assert groups(found, list(BLOCKS.columns)) == [("first",)]
    clean = set_probabilities(made(np.zeros(4)), BLOCKS)
    assert clean[()] > 0.85


def test_what_two_runs_of_twelve_say_is_not_sure():
    torn = made(lambda run: np.array([0.0, 0.0, 0.03 * (run < 2), 0.0]))
    whole = solved(total(torn), BLOCKS.spread(["second"]))
    none = solved(total(torn), BLOCKS.spread([]))
    assert whole.log_evidence - none.log_evidence > 10.0  # all runs at once would be sure
    assert probability(set_probabilities(torn, BLOCKS), ["second"]) < place_probabilities.ACCEPTED


def test_blocks_that_replace_each_other_are_one_group_and_the_mean_holds_both_ways():
    def alike(rng):
        seen = rng.normal(size=(24, 4))
        seen[:, 3] = seen[:, 2] + 0.02 * rng.normal(size=24)
        return seen

    normal = made(np.array([0.0, 0.0, 9e-3, 0.0]), noise_m=2e-3, rows=alike)
    found = set_probabilities(normal, BLOCKS)
    assert probability(found, ["second"]) < place_probabilities.ACCEPTED
    (group,) = groups(found, list(BLOCKS.columns))
    assert sorted(group) == ["second", "third"]
    both = mixed(normal, BLOCKS, found, group)
    assert both.values[2:].sum() == pytest.approx(9e-3, abs=1.5e-3)
    apart = np.sqrt(np.diag(both.covariance)[2:])
    assert apart.min() > 2e-3, apart  # each may be all of it or nothing
    along = np.sqrt(np.ones(2) @ both.covariance[2:, 2:] @ np.ones(2))
    assert along < 1e-3, along  # their sum is known


def test_runs_that_deserve_less_trust_are_named_and_both_places_are_told():
    sizes = {"run-1": 1.0, "run-2": 1.0, "run-3": 2.1, "run-4": 1.9}
    runs = tuple(RunLengths(name, 1e-4, 5e-5, size) for name, size in sizes.items())
    told = Kinematics((), {}, (*runs, RunLengths("run-5", 1e-4, 5e-5, 1.0)), {})
    (note,) = told.notes()
    assert "run-3" in note
    ways = (
        Way("attachment_offset:2", 0.8, np.array([1e-3]), np.array([2e-4]), "m"),
        Way("anchor_offset:2", 0.3, np.array([-4e-3]), np.array([1e-3]), "m"),
    )
    keys = tuple(way.key for way in ways)
    witness = Witness(np.zeros(2), np.ones(2), 0.5, 0.5)
    place = WrongPlace(keys, np.zeros(2), np.eye(2), ways, 0.99, -20.0, 1e-4, 5e-5, witness)
    assert "cannot tell attachment_offset:2 by 1.0 +- 0.2 mm (80 %)" in str(place)
    assert "or anchor_offset:2 by -4.0 +- 1.0 mm (30 %)" in str(place)


@pytest.mark.parametrize(
    ("first", "second", "both", "found"),
    [
        (0.96, 0.02, 0.0, [("first",)]),
        (0.94, 0.045, 0.0, []),
        (0.9, 0.055, 0.0, [("first", "second")]),
        (0.87, 0.07, 0.0, []),
        (0.6, 0.2, 0.2, [("first", "second")]),
    ],
)
def test_a_block_and_a_group_that_are_wrong_for_sure(first, second, both, found) -> None:
    """Sure is 95 %; what has less than 5 % replaces nothing."""
    none = 1.0 - first - second - both
    chances = {("first",): first, ("second",): second, ("first", "second"): both, (): none}
    assert groups(chances, ["first", "second"]) == found
