"""What the rules of the diagnosis decide on made-up scores: both sides of each limit."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false

from __future__ import annotations

from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.ident.diagnose import (
    backward_removal,
    decision,
    declared_model,
    diagnose,
    outstanding_runs,
    refit,
)
from freeswing.ident.diagnose import unexplained as rest
from freeswing.ident.diagnose.decision import (
    Decision,
    _ahead,
    _complaint,
    _winner,
    left_out,
    promising,
    runs_worse,
    settles,
)
from freeswing.ident.diagnose.leave_one_out import Score

NOTHING = np.zeros(0)


def score(held_out, cost: float = 0.0) -> Score:
    squares = np.asarray(held_out, dtype=float)
    return Score(NOTHING, NOTHING, NOTHING, cost, squares, np.zeros(len(squares)), 0)


def fitted(held_out, cost: float = 0.0, count: float = 4.0) -> SimpleNamespace:
    """A fit as the rules see it: left-out squares by run, cost, number of samples."""
    known = score(held_out, cost)
    counts = np.full(len(known.held_out), count / len(known.held_out))
    held_out, evidence = float(known.held_out.sum()), SimpleNamespace(counts=counts)
    return SimpleNamespace(score=known, held_out=held_out, evidence=evidence, fit=counts)


@pytest.fixture(autouse=True)
def plain(monkeypatch):
    """Effects are names, each with two unknowns for all runs; all values are plausible.

    What is missing moves all numbers of a run.
    """
    monkeypatch.setattr(decision, "independent_numbers", lambda counts, _: counts)
    monkeypatch.setattr(decision, "plausible", lambda *_: [])
    monkeypatch.setattr(decision, "included", lambda *_: 1.0)
    monkeypatch.setattr(decision, "unknowns", lambda current, key: (2, 0))
    monkeypatch.setattr(decision, "effect_of", lambda key: key)
    monkeypatch.setattr(decision, "lengths_off", lambda _: False)


@pytest.mark.parametrize(("chance", "passes"), [(0.94, False), (0.96, True)])
def test_an_effect_is_there_rather_than_nothing(monkeypatch, chance, passes) -> None:
    monkeypatch.setattr(decision, "included", lambda *_: chance)
    before, after = fitted([100.0] * 4, 1e4), fitted([10.0] * 4, 0.0)
    text = _complaint(before, after, "effect", np.ones(2), later=False)
    assert (text == "") == passes
    assert passes or "not sure: with probability 0.94" in text, text


@pytest.mark.parametrize(("below", "passes"), [(0.09, True), (0.11, False)])
def test_runs_that_are_predicted_better_than_their_noise_lack_nothing(below, passes) -> None:
    count = 1e4
    before = fitted([count * (1.0 - below) / 4] * 4, 1e4, count)
    after = fitted([count * 0.5 / 4] * 4, 0.0, count)
    text = _complaint(before, after, "effect", np.ones(2), later=False)
    assert (text == "") == passes, text
    assert passes or "11 % below their noise" in text, text


def of_runs(gains) -> str:
    """The complaint on a candidate that changes the left-out runs' squares by these."""
    gains = np.asarray(gains, dtype=float)
    count = 100.0 * len(gains)
    before = fitted(np.full(len(gains), 100.0), 1e4, count)
    return _complaint(before, fitted(100.0 - gains, 0.0, count), "effect", np.ones(2), later=False)


@pytest.mark.parametrize(("worse", "passes"), [(4, True), (5, False)])
def test_a_quarter_of_the_runs_may_get_worse(worse, passes) -> None:
    text = of_runs([100.0] * (16 - worse) + [-20.0] * worse)
    assert (text == "") == passes, text


@pytest.mark.parametrize(
    ("runs", "worse", "passes"), [(15, 2, True), (20, 3, False), (21, 3, True)]
)
def test_a_gain_that_one_run_brings_and_others_contradict(runs, worse, passes) -> None:
    """Within its own scatter 15 % of the runs suffice to doubt it."""
    text = of_runs([1000.0] + [1.0] * (runs - worse - 1) + [-60.0] * worse)
    assert (text == "") == passes, text
    assert passes or "within the scatter" in text, text


@pytest.mark.parametrize(
    ("own", "mean_gain", "held_out", "worse"),
    [
        (-9.3, 0.0, 1000.0, 0),
        (-10.7, 0.0, 1000.0, 1),
        (-9.3, 100.0, 0.0, 0),
        (-10.7, 100.0, 0.0, 1),
    ],
)
def test_a_run_loses_what_counts(own, mean_gain, held_out, worse) -> None:
    """Beside its own squares a hundredth, beside the mean gain a tenth."""
    others = np.full(9, (10.0 * mean_gain - own) / 9.0)
    before = score(np.full(10, held_out))
    assert runs_worse(np.append(others, own), before) == worse


@pytest.mark.parametrize(
    ("excess", "gain", "passes"),
    [(0.0047, 0.23, False), (0.0047, 0.27, True), (0.02, 0.23, False), (0.02, 0.27, True)],
)
def test_a_further_effect_must_be_worth_its_place(excess, gain, passes) -> None:
    count = 1e6
    before = fitted([count * (1.0 + excess) / 4] * 4, 1e6, count)
    removed = gain * max(excess, 0.005) * count
    after = fitted([(count * (1.0 + excess) - removed) / 4] * 4, 0.0, count)
    text = _complaint(before, after, "effect", np.ones(2), later=True)
    assert (text == "") == passes, text
    assert _complaint(before, after, "effect", np.ones(2), later=False) == ""


@pytest.mark.parametrize("off", [False, True])
def test_lengths_that_are_off_are_not_settled_at_the_noise(monkeypatch, off) -> None:
    """A bias of 2 mm beside a displaced anchor: 51 of 20 500 squares, in 21 stated lengths."""
    monkeypatch.setattr(decision, "lengths_off", lambda _: off)
    count = 1e6
    before = fitted([count / 4] * 4, 1e6, count)
    winner = Decision((), before, "effect", ("effect",))
    assert settles(winner, fitted([count] * 4, 1e6, count), np.ones(2))
    assert settles(winner, before, np.ones(2)) != off


def test_an_excess_counts_as_half_a_per_cent_at_least() -> None:
    """A gain is a share of the excess; below that it would be a share of nothing."""
    count = 1e6
    noise = np.array([count])
    before = fitted([count * 1.0042], 0.0, count)
    assert left_out(before, np.ones(2)).share(score(noise)) == pytest.approx(0.84, abs=0.01)
    wider = fitted([count * 1.0057], 0.0, count)
    assert left_out(wider, np.ones(2)).share(score(noise)) == pytest.approx(1.0, abs=0.01)


def ranked(gains: dict[str, float], tried=(), later=False) -> list[str]:
    """Who is fitted next, of candidates that promise these gains by both measures."""
    count = 4.0
    before = fitted([1000.0], 1000.0, count)
    price = 2.0 * float(np.log(count))
    linear = {name: score([1000.0 - gain], 1000.0 - gain - price) for name, gain in gains.items()}
    return promising(before, linear, 1.0, np.ones(2), tried, later)


@pytest.mark.parametrize(("share", "chosen"), [(0.47, ["best"]), (0.53, ["best", "other"])])
def test_at_first_those_nearly_as_good(share, chosen) -> None:
    assert ranked({"best": 100.0, "other": 100.0 * share}) == chosen


@pytest.mark.parametrize(("gain", "chosen"), [(9.3, []), (10.7, ["other"])])
def test_later_all_that_promise_anything(gain, chosen) -> None:
    assert ranked({"best": 100.0, "other": gain}, tried=("best",)) == chosen


@pytest.mark.parametrize(("gain", "chosen"), [(46.0, []), (54.0, ["other"])])
def test_what_promises_little_of_the_excess_is_no_further_effect(gain, chosen) -> None:
    """Of an excess of a thousand a twentieth; where nothing was found yet it is fitted too."""
    gains = {"best": 100.0, "other": gain}
    assert ranked(gains, tried=("best",), later=True) == chosen
    assert ranked(gains, tried=("best",)) == ["other"]


def test_all_that_are_nearly_as_good_at_once_then_four_at_a_time() -> None:
    """The true one of eight kinds of loss may come last by the linear screen."""
    gains = {f"e{k}": 100.0 - k for k in range(8)}
    assert len(ranked(gains)) == 8
    assert len(ranked(gains, tried=("e0",))) == 4


@pytest.mark.parametrize(
    ("share", "left", "settled"),
    [(0.72, 0.1, False), (0.78, 0.1, True), (0.5, 0.0047, True), (0.5, 0.0053, False)],
)
def test_whether_what_won_may_be_the_cause(share, left, settled) -> None:
    """It explains three quarters of the excess, or reaches the noise nearly."""
    count = 1e6
    winner = fitted([count * (1.0 + left)], 0.0, count)
    before = fitted([count * (1.0 + left / (1.0 - share))], 0.0, count)
    assert settles(Decision((), winner, "effect", ("effect",)), before, np.ones(2)) == settled


def group_of(lead: float, chance: float) -> tuple[str, ...]:
    """The group of a best fit and of one behind by `lead` in left-out squares, so probable."""
    count = 12e3
    before, best = fitted([1000.0] * 12, 1e4, count), fitted([500.0] * 12, 100.0, count)
    passed = {"best": best, "one": fitted(500.0 + np.full(12, lead / 12), 99.0, count)}
    chances = {"best": 1.0 - chance, "one": chance}
    return _winner(passed, chances, before, left_out(before, np.ones(2)))[1]


@pytest.mark.parametrize(
    ("lead", "chance", "told_apart"),
    [(11.2, 0.0, False), (12.8, 0.0, True), (500.0, 0.055, False), (500.0, 0.045, True)],
)
def test_leads_that_are_none(lead, chance, told_apart) -> None:
    """Twelve in squares of left-out runs, or what is more probable than 5 %."""
    assert group_of(lead, chance) == (("best",) if told_apart else ("best", "one"))


@pytest.mark.parametrize(("lead", "leads"), [(11.2, "one"), (12.8, "best")])
def test_fewer_unknowns_lead_only_where_runs_left_out_are_predicted_as_well(
    monkeypatch, lead, leads
) -> None:
    """A constant force with 0.26 left nine times the noise where a tether with 0.74 left 0.17."""
    monkeypatch.setattr(decision, "unknowns", lambda _, key: ({"best": 8, "one": 3}[key], 0))
    assert group_of(lead, 0.6)[0] == leads


@pytest.mark.parametrize(("lead", "is_ahead"), [(11.2, False), (12.8, True)])
def test_who_left_out_runs_speak_for_is_told_where_a_likelier_one_leads(lead, is_ahead) -> None:
    count = 12e3
    before, best = fitted([1000.0] * 12, 1e4, count), fitted([500.0] * 12, 100.0, count)
    passed = {"best": best, "one": fitted(500.0 + np.full(12, lead / 12), 99.0, count)}
    runs = left_out(before, np.ones(2))
    assert (_ahead("one", passed, runs) == ("best", best)) == is_ahead
    assert _ahead("best", passed, runs) is None
    assert _ahead("", {}, runs) is None


@pytest.mark.parametrize(("chance", "leads"), [(0.74, "best"), (0.76, "one")])
def test_the_likelier_of_a_group_leads(chance, leads) -> None:
    """A third as probable it still leads by its prediction; below, by nothing."""
    assert group_of(11.2, chance)[0] == leads


@pytest.mark.parametrize(("excess", "believed"), [(0.47, True), (0.53, False)])
def test_the_nearest_is_not_the_cause_where_much_is_left(monkeypatch, excess, believed) -> None:
    count = 1e4
    monkeypatch.setattr(diagnose, "_share_explained", lambda *_: 0.5)
    monkeypatch.setattr(diagnose, "unexplained", lambda *_: rest.Unexplained(False, ""))
    monkeypatch.setattr(diagnose, "effect_of", lambda key: key)
    last, first = fitted([count * (1.0 + excess)], 0.0, count), fitted([3 * count], 0.0, count)
    last.fit = first.fit = None
    won = SimpleNamespace(
        decision=SimpleNamespace(winner=last, key="drag"), by_lengths=False, before=first
    )
    search = SimpleNamespace(rounds=[won], noise_scales=np.ones(2))
    notes: list[str] = []
    found, _, _ = diagnose._believed(search, last, [], True, notes)
    assert (found is last) == believed
    assert bool(notes) != believed, notes


def left(monkeypatch, power: float, colour: float, floor: float = 0.561) -> bool:
    """Whether residuals of this power and this low-frequency power are called unexplained."""
    white = np.full((100, 1), np.sqrt(power))
    spectrum = np.concatenate([np.full(50, colour), np.full(150, floor)])
    monkeypatch.setattr(rest, "residuals", lambda *_: white)
    monkeypatch.setattr(rest, "mean_log_spectrum", lambda *_: (np.linspace(0, 19.9, 200), spectrum))
    monkeypatch.setattr(rest, "too_small", lambda *_: False)
    monkeypatch.setattr(rest, "predicted", lambda *_: np.zeros((100, 6)))
    monkeypatch.setattr(rest, "_follows", lambda *_: {"time": 1.0})
    monkeypatch.setattr(rest, "_hint", lambda *_: [])
    monkeypatch.setattr(rest, "common_frequencies", lambda *_: (1.0,))
    samples = SimpleNamespace(
        coordinates=("x",), times_s=np.arange(100), columns=[0], values=np.zeros((100, 1))
    )
    fit = SimpleNamespace(motions=[None], samples=[samples])
    return rest.unexplained(fit, [], True, np.ones(2)).present


@pytest.mark.parametrize(
    ("power", "colour", "present"),
    [(1.14, 3.0, False), (1.16, 3.0, True), (2.0, 1.55, False), (2.0, 1.65, True)],
)
def test_a_residual_that_noise_does_not_leave(monkeypatch, power, colour, present) -> None:
    assert left(monkeypatch, power, colour) == present


@pytest.mark.parametrize(("floor", "present"), [(0.36, False), (0.34, True), (5.0, False)])
def test_noise_that_was_taken_for_larger_hides_no_colour(monkeypatch, floor, present) -> None:
    """Power 1.0 at low frequencies, beside white noise of 0.56 where the noise is as told."""
    assert left(monkeypatch, 2.0, 1.0, floor) == present


@pytest.mark.parametrize(("share", "terms"), [(0.027, 1), (0.033, 2)])
def test_a_hint_is_worth_three_per_cent(share, terms) -> None:
    columns = np.eye(4)[:, :2]
    right = np.array([np.sqrt(1.0 - share), np.sqrt(share), 0.0, 0.0])
    assert len(rest._greedy(right, columns, ["a", "b"])) == terms


@pytest.mark.parametrize(("powers", "tempered"), [((1.0, 1.0, 3.8), 1.0), ((1.0, 1.0, 4.4), 1.05)])
def test_a_run_that_stands_out(monkeypatch, powers, tempered) -> None:
    """Four times the median power is what one run may weigh."""
    monkeypatch.setattr(outstanding_runs, "residual_powers", lambda *_: np.array(powers))
    monkeypatch.setattr(outstanding_runs, "replace", lambda one, temper: temper)
    found = SimpleNamespace(samples=[SimpleNamespace(temper=1.0)] * 3)
    assert outstanding_runs.tempered(found, np.ones(2))[2] == pytest.approx(tempered, abs=0.01)


@pytest.mark.parametrize(
    ("astray", "power", "follows"),
    [(0.23, 9.0, True), (0.27, 9.0, False), (0.9, 1.85, True), (0.9, 2.15, False)],
)
def test_a_start_that_follows_the_runs(monkeypatch, astray, power, follows) -> None:
    """A quarter of the swings' size, or twice the noise's power."""
    monkeypatch.setattr(declared_model, "astray", lambda _: astray)
    monkeypatch.setattr(declared_model, "residual_powers", lambda *_: np.array([power]))
    assert declared_model._follows(None, np.ones(2)) == follows


@pytest.mark.parametrize(
    ("runs", "apart", "ends"), [(3, 0.45, True), (3, 0.55, False), (2, 0.45, False)]
)
def test_a_start_that_comes_where_another_was(runs, apart, ends) -> None:
    """Half a deviation apart after the first stretch, with as many runs."""
    earlier = declared_model._Watch([], 3)
    earlier(np.ones(9), np.ones(9))
    watch = declared_model._Watch([earlier], runs)
    inertia = np.ones(9)
    inertia[4] -= 0.2 * apart
    with pytest.raises(declared_model._SameValleyError) if ends else nullcontext():
        watch(inertia, np.full(9, 0.2))
    assert watch.inertia is inertia


@pytest.mark.parametrize(("chance", "lead", "no_worse"), [
    (0.94, 11.0, True), (0.96, 11.0, False), (0.94, 13.0, False),
])  # fmt: skip
def test_an_effect_that_may_leave_again(monkeypatch, chance, lead, no_worse) -> None:
    monkeypatch.setattr(backward_removal, "included", lambda *_: chance)
    fewer, more = fitted([100.0 + lead], count=1000.0), fitted([100.0], count=1000.0)
    assert backward_removal.is_no_worse(fewer, more, "effect", np.ones(2)) == no_worse


@pytest.mark.parametrize(("runs", "enough"), [(2, False), (3, True)])
def test_runs_to_leave_one_out_of(runs, enough) -> None:
    if enough:
        declared_model.refuse_few([None] * runs)
    else:
        with pytest.raises(declared_model.DataError, match="at least 3"):
            declared_model.refuse_few([None] * runs)


@pytest.mark.parametrize(("left", "fits"), [(110.0, 1), (90.0, 2)])
def test_a_fit_is_weighed_by_what_it_leaves(monkeypatch, left, fits) -> None:
    """Its search had stopped at 200 times the noise: what leaves 90 was weighed too loosely."""
    begun = SimpleNamespace(colour=200.0, swings=SimpleNamespace(), unknowns=None)
    made = []

    def again(swings, *_):
        made.append(swings.scales)
        return SimpleNamespace(colour=left, swings=SimpleNamespace(), unknowns=None)

    monkeypatch.setattr(refit, "colour_of", lambda one, _: one.colour)
    monkeypatch.setattr(refit, "tempered", lambda *_: ())
    monkeypatch.setattr(refit, "replace", lambda _, samples, scales: SimpleNamespace(scales=scales))
    monkeypatch.setattr(refit, "fit", again)
    monkeypatch.setattr(refit, "rescored", lambda one, _, colour: colour)
    assert refit.polished(begun, np.ones(2)) == pytest.approx(200.0 if fits == 1 else left)
    assert [float(scales[0] ** 2) for scales in made] == pytest.approx([200.0, left][:fits])
