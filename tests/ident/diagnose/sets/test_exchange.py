"""A place held against sets of places that may be wrong instead: what is told of them."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.ident.diagnose import decision as rules
from freeswing.ident.diagnose.answer.deviations import with_ways
from freeswing.ident.diagnose.answer.final_verdicts import final_verdicts, rivals_of
from freeswing.ident.diagnose.decision import Candidate, Decision
from freeswing.ident.diagnose.search import Round
from freeswing.ident.diagnose.sets import exchange as room
from freeswing.ident.diagnose.sets.exchange import decisions, leading, sentence
from freeswing.ident.diagnose.sets.ways import Exchange, Way
from freeswing.main import main
from tests.oracle.recorded.sessions import make_session

WHOLE = ("anchor_offset",)
PAIR = ("anchor_offset:1", "cable_length_bias")
AXES = ("anchor_offset:1", "pulley_axis")
NUMBERS = {WHOLE: 9, PAIR: 6, AXES: 9}


@pytest.mark.parametrize(
    ("chances", "leader"),
    [
        ({WHOLE: 0.74, PAIR: 0.26}, PAIR),
        ({WHOLE: 0.76, PAIR: 0.24}, WHOLE),
        ({WHOLE: 0.3, AXES: 0.7}, AXES),
    ],
)
def test_of_sets_about_as_probable_the_one_of_fewest_numbers_leads(chances, leader) -> None:
    assert leading(chances, NUMBERS) == leader


def fit(name: str) -> SimpleNamespace:
    return SimpleNamespace(name=name)


def told(*ways: tuple[tuple[str, ...], float]) -> Exchange:
    rest = 1.0 - sum(chance for _, chance in ways)
    others = tuple(Way(places, chance, fit("other")) for places, chance in ways)
    return Exchange(PAIR, rest, (fit("one"), fit("both")), others)


def words() -> Decision:
    """All anchors were found: the others were told beside them."""
    names = ("anchor_offset", "cable_length_bias", "pulley_axis", "tether")
    found = [Candidate(name, "rejected", -10.0, 0.5, (), "") for name in names[1:]]
    first = Candidate("anchor_offset", "accepted", -90.0, 1.0, (), "removes all", 1.0)
    return Decision((first, *found), fit("all"), "anchor_offset", ("anchor_offset",))


def verdicts(exchange: Exchange) -> tuple[dict[str, Candidate], dict[str, tuple[str, ...]]]:
    before, rounds = fit("before"), []
    for one in decisions(words(), exchange):
        rounds.append(Round(before, one))
        before = rounds[-1].after
    last = final_verdicts(rounds, ("anchor_offset", "cable_length_bias"), {}, ())
    return {one.effect: one for one in last}, rivals_of(rounds)


def test_a_set_that_leads_stands_in_the_place_of_what_was_found() -> None:
    exchange = told()
    found = decisions(words(), exchange)
    assert [one.key for one in found] == ["anchor_offset:1", "cable_length_bias"]
    assert [one.winner for one in found] == [*exchange.fits]
    last, rivals = verdicts(exchange)
    assert last["anchor_offset"].verdict == last["cable_length_bias"].verdict == "accepted"
    assert last["pulley_axis"].verdict == "rejected"
    assert rivals["cable_length_bias"] == ("cable_length_bias",)
    assert sentence(exchange) == ""


def test_what_replaces_a_part_of_the_set_is_told_beside_that_part() -> None:
    last, rivals = verdicts(told((AXES, 0.2)))
    assert last["anchor_offset"].confounded_with == ()
    assert last["anchor_offset"].probability == pytest.approx(1.0)
    assert last["cable_length_bias"].verdict == "confounded"
    assert last["cable_length_bias"].confounded_with == ("pulley_axis",)
    assert last["cable_length_bias"].probability == pytest.approx(0.8)
    assert last["pulley_axis"].verdict == "confounded"
    assert rivals["cable_length_bias"] == ("cable_length_bias", "pulley_axis")
    assert rivals["anchor_offset"] == ("anchor_offset",)
    said = sentence(told((AXES, 0.2)))
    assert "anchor_offset 1 with cable_length_bias (80 %)" in said
    assert "anchor_offset 1 with pulley_axis (20 %)" in said


def test_all_of_a_kind_may_replace_a_part_beside_one_of_that_kind() -> None:
    """Further anchors may be displaced, and lengths told right."""
    last, rivals = verdicts(told((WHOLE, 0.3)))
    assert last["cable_length_bias"].confounded_with == ("anchor_offset",)
    assert rivals["cable_length_bias"] == ("cable_length_bias", "anchor_offset")
    assert last["anchor_offset"].verdict == "accepted"


def stub(inertia: float, std: float, effects: tuple[str, ...], anchor: float) -> SimpleNamespace:
    """A fit of a nine and, where it has an anchor, its offset."""
    values = {"inertia": np.full(9, inertia), "anchor_offset": np.array([anchor])}
    size = 9 + len(effects)
    return SimpleNamespace(
        model=SimpleNamespace(effects=effects),
        free=np.ones(size, bool),
        covariance=np.eye(size) * std**2,
        value=values.__getitem__,
        unknowns=SimpleNamespace(columns=lambda *names: np.arange(9 + len(names) - 1)),
    )


@pytest.mark.parametrize("chance", [0.1, 0.5])
def test_deviations_hold_what_other_ways_make_of_it(chance: float) -> None:
    """Inertia by 3 and an anchor by 2, each way known to 1, the other one to 2."""
    anchor = ("anchor_offset",)
    stands, other = stub(0.0, 1.0, anchor, 0.0), stub(3.0, 2.0, anchor, 2.0)
    ways = (Way(AXES, chance, SimpleNamespace(fit=other)),)
    exchange = Exchange(PAIR, 1.0 - chance, (SimpleNamespace(fit=stands),), ways)
    wider = with_ways(stands.covariance, stands, exchange)
    of_inertia = 1.0 + chance * (9.0 + 3.0)
    assert np.diag(wider) == pytest.approx([of_inertia] * 9 + [1.0 + chance * (4.0 + 3.0)])
    without = Exchange(PAIR, 1.0, exchange.fits, ())
    np.testing.assert_array_equal(with_ways(stands.covariance, stands, without), np.eye(10))


@pytest.mark.parametrize(("mine", "others"), [(1.0, np.inf), (np.inf, np.inf), (np.inf, 1.0)])
def test_what_runs_leave_open_counts_by_its_values_alone(mine: float, others: float) -> None:
    """All deviations had been NaN where one of both fits lacks rank."""
    stands, other = stub(0.0, 1.0, (), 0.0), stub(3.0, 1.0, (), 0.0)
    for one, variance in ((stands, mine), (other, others)):
        np.fill_diagonal(one.covariance, variance)
    exchange = Exchange(
        (), 0.9, (SimpleNamespace(fit=stands),), (Way(AXES, 0.1, SimpleNamespace(fit=other)),)
    )
    wider = with_ways(stands.covariance, stands, exchange)
    assert np.diag(wider) == pytest.approx([mine + 0.1 * 9.0] * 9)


def test_an_anchor_that_another_way_does_not_have_keeps_its_deviation() -> None:
    stands, other = stub(0.0, 1.0, ("anchor_offset",), 5.0), stub(1.0, 1.0, (), 0.0)
    ways = (Way(("marker_offset",), 0.5, SimpleNamespace(fit=other)),)
    exchange = Exchange(PAIR, 0.5, (SimpleNamespace(fit=stands),), ways)
    wider = with_ways(stands.covariance, stands, exchange)
    assert np.diag(wider) == pytest.approx([1.5] * 9 + [1.0])


@pytest.mark.parametrize(("chance", "said"), [(0.047, []), (0.053, [("cable_length_bias",)])])
def test_what_is_not_sure_enough_to_be_named_counts(monkeypatch, chance, said) -> None:
    """Lengths told wrong had 0.66 and axes 0.30: inertia was told 5 deviations off."""
    monkeypatch.setattr(rules, "plausible", lambda one, _: one.complaints)
    tried = {
        "cable_length_bias": SimpleNamespace(complaints=[]),
        "rotational_drag": SimpleNamespace(complaints=["a drag that drives"]),
    }
    found = rules._unsure(fit("now"), tried, {"cable_length_bias": chance, "rotational_drag": 0.9})
    ways = found.ways if found else ()
    assert [way.places for way in ways] == said


def test_what_is_not_named_is_said() -> None:
    ways = (Way(("cable_length_bias",), 0.66, fit("bias")),)
    assert "cable_length_bias (66 %)" in sentence(Exchange((), 0.34, (fit("now"),), ways))


def test_forces_are_not_held_against_sets_of_places() -> None:
    nothing = SimpleNamespace()
    assert room.exchange(nothing, nothing, "gravity_tilt", [], np.ones(2), dict) is None


@pytest.mark.slow
def test_one_anchor_and_lengths_told_wrong_are_named_not_all_anchors(tmp_path: Path) -> None:
    """Three cables by x, y, chi; all anchors together follow them at the noise."""
    effects = {"anchor_offset": "medium", "cable_length_bias": "medium"}
    truth = make_session(tmp_path / "s", 23, "three-cable", effects, pose=False)
    asked = [word for name in effects for word in ("--only", name)]
    assert main(["diagnose", str(tmp_path / "s"), *asked]) == 0
    document = json.loads((tmp_path / "s" / "results" / "diagnosis.json").read_text())
    named = {one["effect"]: one for one in document["accepted"]}
    assert set(named) == set(effects)
    cable = next(e["cable"] for e in truth.scene.record if e["effect"] == "anchor_offset")
    assert all(f"_{cable + 1}_" in p["name"] for p in named["anchor_offset"]["parameters"])
    true = [*truth.body.com_m, *truth.body.specific_inertia_m2]
    z = [
        (p["value"] - v) / p["std"] for p, v in zip(document["parameters_after"], true, strict=True)
    ]
    assert np.abs(z).max() < 3.0, np.round(z, 1)
