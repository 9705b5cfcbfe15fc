"""What the diagnosis of driven robots decides, on both sides of every limit, without any fit."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.ident.drive.diagnose import diagnose as module
from freeswing.ident.drive.joint import Problem
from freeswing.ident.drive.trust import is_untold
from freeswing.ident.drive.unknowns import Asked


class Fit(SimpleNamespace):
    """A model that was fitted: its BIC beside the one below, and its held-out residual."""

    def bic_beside(self, _):
        return self.bic


def named(label):
    return SimpleNamespace(label=label, effect=label, part="", groups=("a number",))


def fit_of(label, bic=-100.0, times_noise=1.0):
    return Fit(
        candidate=named(label),
        bic=bic,
        times_noise=times_noise,
        chi_square=1.0,
        n=1,
        given=SimpleNamespace(model=None),
        found=SimpleNamespace(asked=None),
    )


def climbed(monkeypatch, fits, gain=100.0, base_noise=10.0):
    """Whether the search took the best of some fits, what it says of each, and how many it made."""
    by_label = {fit.candidate.label: fit for fit in fits}
    told = tuple(
        SimpleNamespace(candidate=fit.candidate, gain=gain, seen=True, why="", values=None)
        for fit in fits
    )
    made = []

    def with_candidate(_session, _base, one, _starts):
        made.append(one.candidate.label)
        return by_label[one.candidate.label]

    for name, value in {
        "Problem": lambda *_: SimpleNamespace(normal=lambda _: None, seen=None, k=0),
        "_point": lambda *_: None,
        "jump_start": lambda *_: {},
        "candidates": lambda *_: (),
        "screen": lambda *_: told,
        "with_candidate": with_candidate,
        "settled": lambda _, fit: fit,
    }.items():
        monkeypatch.setattr(module, name, value)
    search = module._Search(None, [fit_of("", times_noise=base_noise)])
    took = module._climb(search, None)
    return took, {name: one.verdict for name, one in search.verdicts.items()}, made


@pytest.mark.parametrize(("gain", "count"), [(9.5, 0), (10.5, 1)])
def test_a_candidate_is_worth_ten_of_bic(monkeypatch, gain, count):
    assert len(climbed(monkeypatch, [fit_of("a")], gain)[2]) == count


@pytest.mark.parametrize(("bic", "took"), [(-9.5, False), (-10.5, True)])
def test_an_effect_is_worth_ten_of_bic_beside_the_model_without_it(monkeypatch, bic, took):
    assert climbed(monkeypatch, [fit_of("a", bic)])[0] == took


@pytest.mark.parametrize(("behind", "took"), [(11.5, False), (12.5, True)])
def test_a_rival_is_twelve_of_bic_behind(monkeypatch, behind, took):
    found = climbed(monkeypatch, [fit_of("a", -100.0), fit_of("b", -100.0 + behind)])
    assert found[0] == took
    assert (found[1]["a"] == "confounded") != took


def test_four_candidates_are_fitted_a_round(monkeypatch):
    made = climbed(monkeypatch, [fit_of(label) for label in "abcdef"])[2]
    assert len(made) == 4, made


def test_four_effects_are_looked_for(monkeypatch):
    rounds = []
    for name, value in {
        "_base": lambda *_: fit_of(""),
        "_drop_what_became_idle": lambda _: None,
        "_judged": lambda search: search,
        "_climb": lambda *_: rounds.append(1) or True,
    }.items():
        monkeypatch.setattr(module, name, value)
    for name in ("_clear_of_slack", "refitted"):
        monkeypatch.setattr(module, name, lambda first, _=None: first, raising=False)
    module.diagnose_drive(None, lambda *_: None)
    assert len(rounds) == 4


@pytest.mark.parametrize(
    ("before", "after", "rival", "accepted", "left"),
    [
        (2.0, 1.45, np.inf, True, False),  # at its noise
        (2.0, 1.55, np.inf, False, True),
        (10.0, 4.9, np.inf, True, True),  # half of what was there
        (10.0, 5.1, np.inf, False, True),
        (100.0, 10.0, 20.5, True, True),  # half of what a rival leaves
        (100.0, 10.0, 19.5, False, True),
    ],
)
def test_a_cause_leaves_noise_or_half_and_half_of_any_rival(before, after, rival, accepted, left):
    ladder = [fit_of("", times_noise=before), fit_of("a", times_noise=after)]
    found = module._judged(module._Search(None, ladder, leads=[rival]))
    assert bool(found.accepted) == accepted
    assert found.unexplained == left


def test_numbers_go_so_far_from_where_they_start():
    """Lengths by a factor of three, what is dynamic by a thousand."""
    groups = [SimpleNamespace(members=(name,)) for name in "ab"]
    numbers = SimpleNamespace(names=("a", "b"))
    problem = SimpleNamespace(
        size=2,
        k=2,
        start=lambda: np.array([3.0, 2.0]),
        asked=Asked(tuple(groups), 1),
        given=SimpleNamespace(model=SimpleNamespace(numbers=numbers, index="ab".index)),
    )
    low, high = Problem.bounds(problem)
    np.testing.assert_allclose(low, [1.0, 0.002])
    np.testing.assert_allclose(high, [9.0, 2000.0])


@pytest.mark.parametrize(("std", "lost"), [(0.29, False), (0.31, True), (np.inf, True)])
def test_a_number_is_determined_to_three_tenths(std, lost):
    assert is_untold(std, -1.0) == lost
