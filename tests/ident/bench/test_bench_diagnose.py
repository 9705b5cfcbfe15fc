"""Parts of a bench's diagnosis: causes, the linear problem of left-out runs, and its limits."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from freeswing.cdpr.effects import catalogue, effect_named
from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.model.equations import build_model
from freeswing.ident.bench.assemble import EFFECTS, assembled
from freeswing.ident.bench.diagnose import diagnose, search
from freeswing.ident.bench.diagnose.causes import (
    ALL_WIRES,
    causes_of,
    dressed,
    mass_power,
    wanting,
)
from freeswing.ident.bench.diagnose.document import (
    _others,
    _plain,
    _tells,
    _unshown,
    _with_sight,
    bench_document,
    experiment_of,
    most_likely,
)
from freeswing.ident.bench.diagnose.entries import removed_entry
from freeswing.ident.bench.diagnose.search import Ground
from freeswing.ident.bench.diagnose.shown import shown
from freeswing.ident.bench.diagnose.taken_for_granted import Removed, _wires, no_drag
from freeswing.ident.bench.diagnose.unexplained import remaining
from freeswing.ident.bench.diagnose.weigh import Fit
from freeswing.ident.bench.modal import ModalSwing
from freeswing.ident.bench.swing import COMMON, BenchSwing, Column
from freeswing.ident.likelihood.fit import Solution
from freeswing.ident.likelihood.fit_blocks import linear_problem
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown, Unknowns
from tests.ident.bench.test_swing_slopes import small_bench, trifilar


@pytest.mark.parametrize(
    ("effect", "power"),
    [("torsion_spring", -1), ("cable_mass", -1), ("cable_elasticity", 1), ("gravity_tilt", 0)],
)
def test_how_effects_go_with_the_mass_that_hangs(effect: str, power: int) -> None:
    """The same spring turns twice the mass half as much; the same wire stretches twice as far."""
    assert mass_power(effect_named(effect)) == power


def test_every_end_moves_alone_and_all_together() -> None:
    robot = trifilar()
    causes = causes_of(robot, ["attachment_offset"])
    assert [one.part for one in causes] == ["", "0", "1", "2"]
    together = causes[0].directions @ [1.0, 2.0]
    np.testing.assert_array_equal(together.reshape(3, 3), np.tile([1.0, 2.0, 0.0], (3, 1)))
    alone = causes[2].directions @ [1.0, 2.0]
    np.testing.assert_array_equal(alone.reshape(3, 3)[1], [1.0, 2.0, 0.0])
    assert np.count_nonzero(alone) == 2


def start_with(names: list[str]):
    """The small bench in a model with some causes, its unknowns a little off."""
    bench, robot = small_bench(), trifilar()
    start = assembled(build_model(robot, EFFECTS), bench, bench.runs)
    causes = [one for one in causes_of(robot, names) if not one.part]
    swings = dressed(start.swings, causes, np.array([1.5, 1.2, 1.0]))
    unknowns = wanting(start.unknowns, causes)
    moved = {one.block: 0.1 * unknowns.block(one.block).scale for one in causes}
    return swings, unknowns.moved(moved), causes


def test_slopes_of_causes_are_those_of_differences() -> None:
    names = ["gravity_tilt", "cable_elasticity", "torsion_spring", "attachment_offset"]
    swings, unknowns, causes = start_with(names)
    for index, swing in enumerate(swings):
        values = unknowns.of_run(index)
        _, slopes = swing.linearised(values, swing.simulated(values))
        for cause in causes:
            block = unknowns.block(cause.block)
            for k in range(block.size):
                step, ends = 1e-2 * block.scale[k], []
                for sign in (1.0, -1.0):
                    there = values[block.name] + sign * step * np.eye(block.size)[k]
                    moved = {**values, block.name: there}
                    ends.append(swing.residuals(moved, swing.simulated(moved)))
                expected = (ends[0] - ends[1]) / (2.0 * step)
                size = np.abs(expected).max() + 1e-3 / block.scale[k]
                off = np.abs(slopes[block.name][:, k] - expected).max() / size
                assert off < 5e-3, (swing.name, block.name, k, off)


def test_all_wires_together_are_the_block_that_every_bench_has() -> None:
    (together,) = [one for one in causes_of(trifilar()) if one.part == ALL_WIRES]
    bench, robot = small_bench(), trifilar()
    start = assembled(build_model(robot, EFFECTS), bench, bench.runs)
    held = start.unknowns.held(COMMON)
    assert wanting(held, [together]).block(COMMON).mask.all()
    swings = dressed(start.swings, [together], np.ones(3))
    assert swings[0].acting == ()


def test_a_left_out_run_follows_as_well_as_its_own_unknowns_allow() -> None:
    """Triangles and left-over residuals against the whole least-squares problem of a run."""
    swings, unknowns, _ = start_with(["gravity_tilt"])
    linear = linear_problem(swings, unknowns)
    change = 0.01 * np.random.default_rng(0).normal(size=linear.triangles.shape[1] - 1)
    for run, (residuals, own, shared) in enumerate(linear.parts):
        moved = residuals + shared @ change
        best = moved - own @ np.linalg.lstsq(own, moved, rcond=None)[0]
        reduced = linear.triangles[run] @ np.append(change, 1.0)
        assert np.sum(reduced**2) == pytest.approx(np.sum(best**2), rel=1e-6)
        left = linear.left_over(run, change)
        assert np.sum(left**2) == pytest.approx(np.sum(best**2), rel=1e-6)


@pytest.mark.parametrize(("size_mm", "part"), [(0.28, ""), (0.32, "0")])
def test_the_wire_that_is_the_one(size_mm: float, part: str) -> None:
    """Known to 0.1 mm: three deviations make it the one."""
    values = 1e-3 * np.array([size_mm, 0.1, -0.1])
    prior = Gaussian(np.zeros(3), np.full(3, 1e-3), "stated")
    unknowns = Unknowns((Unknown("wires.1", values, np.ones(3), prior),))
    solution = SimpleNamespace(
        value=lambda _: values, std=lambda _: np.full(3, 1e-4), unknowns=unknowns
    )
    swing = SimpleNamespace(model=SimpleNamespace(robot=trifilar()))
    last: Any = SimpleNamespace(solution=solution, swings=[swing])
    told = _wires(last, Removed("cable_length_bias", ("wires.1",), (np.ones(3, bool),)))
    assert told.part == part
    assert told.values == pytest.approx(values)


@pytest.mark.parametrize(
    ("rate", "says"), [(-1e-3, "negative"), (2.9e-4, "not told from nothing"), (3.1e-4, "")]
)
def test_a_rate_that_the_runs_do_not_agree_on_is_no_drag(rate: float, says: str) -> None:
    """By a track on two wires 4e-5 +- 3e-3 was accepted, beside a true rate of nothing."""
    said = no_drag(Removed("rotational_drag", ("effects",), (), values=(rate,), stds=(1e-4,)))
    assert says in said
    assert bool(said) == bool(says)


@pytest.mark.parametrize(("share", "told"), [(0.46, True), (0.54, False)])
def test_wires_of_which_runs_tell_no_more_than_what_is_stated(share: float, told: bool) -> None:
    """The share of the stated variance that is left."""
    prior = Gaussian(np.zeros(3), np.full(3, 1e-3), "stated")
    unknowns = Unknowns((Unknown("wires.1", np.zeros(3), np.ones(3), prior),))
    std = np.full(3, 1e-3 * np.sqrt(share))
    solution = SimpleNamespace(value=lambda _: np.zeros(3), std=lambda _: std, unknowns=unknowns)
    swing = SimpleNamespace(model=SimpleNamespace(robot=trifilar()))
    last: Any = SimpleNamespace(solution=solution, swings=[swing])
    found = _wires(last, Removed("cable_length_bias", ("wires.1",), (np.ones(3, bool),)))
    assert found.told == told
    assert removed_entry(found)["verdict"] == ("rejected" if told else "not_identifiable")


@pytest.mark.parametrize(("power", "present"), [(9.0, False), (11.2, True)])
def test_what_remains_stands_out_of_white_noise(power: float, present: bool) -> None:
    """A residual of so many times the noise's power over the lower quarter of the band."""
    count = 4096
    spectrum = np.ones(count // 2 + 1)
    spectrum[: count // 8] = np.sqrt(power)
    phases = np.exp(2j * np.pi * np.random.default_rng(1).random(len(spectrum)))
    part = np.fft.irfft(spectrum * phases, count)
    times = np.arange(count) / 50.0
    column = Column("chi", np.zeros(count), np.ones(count), 5)
    swing = SimpleNamespace(times_s=times, columns=(column,))
    fit: Any = SimpleNamespace(swings=[swing], solution=SimpleNamespace(residuals=[part]))
    told = remaining(fit)
    assert told["present"] == present, told
    said = f"chi is off by {1e3 * np.sqrt(np.mean(part**2)):.2g} mrad rms"
    assert (said in told["signature"]) == present, told


@pytest.mark.parametrize("kind", [ModalSwing, BenchSwing])
def test_two_runs_tell_no_effect_from_another(monkeypatch, kind) -> None:
    """Every effect is `not_identifiable`, with the reason and what to add."""
    swings = tuple(object.__new__(kind) for _ in range(2))
    identified = SimpleNamespace(solved=SimpleNamespace(swings=swings, mass=None, wires=None))
    monkeypatch.setattr(diagnose, "identify_bench", lambda *_: identified)
    nothing: Any = None
    document = bench_document(diagnose.diagnose_bench(nothing, nothing))
    assert {row["verdict"] for row in document["candidates"]} == {"not_identifiable"}
    assert len(document["candidates"]) == len(catalogue())
    assert "2 run(s)" in document["notes"][0], document["notes"]


def test_channels_alone_go_their_own_way(monkeypatch) -> None:
    swings = tuple(object.__new__(ModalSwing) for _ in range(3))
    identified = SimpleNamespace(solved=SimpleNamespace(swings=swings))
    monkeypatch.setattr(diagnose, "identify_bench", lambda *_: identified)
    monkeypatch.setattr(diagnose, "by_channels", lambda one: ("by channels", one))
    nothing: Any = None
    assert diagnose.diagnose_bench(nothing, nothing) == ("by channels", identified)


def test_three_runs_are_diagnosed_and_what_fails_is_said(monkeypatch) -> None:
    swings = tuple(object.__new__(BenchSwing) for _ in range(3))
    identified = SimpleNamespace(solved=SimpleNamespace(swings=swings))
    monkeypatch.setattr(diagnose, "identify_bench", lambda *_: identified)

    def fails(*_: object) -> None:
        raise ValueError("as arranged")

    monkeypatch.setattr(diagnose, "_diagnosed", fails)
    nothing: Any = None
    with pytest.raises(DataError, match="cannot be diagnosed: as arranged"):
        diagnose.diagnose_bench(nothing, nothing)


def test_a_group_is_told_with_what_would_part_it() -> None:
    assert "plumb line" in experiment_of(["constant_force", "gravity_tilt"])
    assert "exchange the wires" in experiment_of(["anchor_offset", "attachment_offset"])
    assert "payload" in experiment_of(["torsion_spring", "cable_mass"])


def test_a_run_keeps_its_drag_beside_what_all_share() -> None:
    swings, unknowns, causes = start_with(["torsion_spring"])
    values = unknowns.of_run(0)
    (spring,) = causes
    found = swings[0].effects(values)
    np.testing.assert_array_equal(found[: len(values["effects"])], values["effects"])
    np.testing.assert_allclose(found[-2:], values[spring.block] / 1.5, rtol=1e-12)
    plain = replace(swings[0], acting=())
    np.testing.assert_array_equal(plain.effects(values), values["effects"])


def test_what_runs_would_not_show_is_not_rejected() -> None:
    """A tilt about y shows in x, one about x does not; in yaw alone neither would."""
    bench, robot = small_bench(), trifilar()
    chi = replace(bench.runs[2], signals=bench.runs[2].signals[1:], name="chi")
    seen = {}
    for name, run in (("plane", bench.runs[2]), ("chi", chi)):
        runs = tuple(replace(run, name=f"{name}{k}") for k in range(3))
        start = assembled(build_model(robot, EFFECTS), replace(bench, runs=runs, loads=()), runs)
        solution: Any = SimpleNamespace(unknowns=start.unknowns)
        fit = Fit(start.swings, solution)
        (tilt,) = causes_of(robot, ["gravity_tilt"])
        (seen[name],) = shown(Ground(start.swings, np.ones(3), 1.0), fit, [tilt])
    assert seen["plane"].told.tolist() == [False, True], seen["plane"].words  # x alone is seen
    assert not seen["chi"].told.any(), seen["chi"].words
    assert "a usual one of" in seen["chi"].words
    row = {"effect": "gravity_tilt", "verdict": "rejected", "reason": "removes 0 %"}
    known = replace(seen["plane"], std=np.array([0.009, 0.009]))
    assert _with_sight(row, [known]) == {**row, "reason": f"removes 0 %; {known.words}"}
    assert _with_sight(row, [seen["plane"]])["verdict"] == "not_identifiable"
    unseen = _with_sight(row, [seen["chi"]])
    assert unseen["verdict"] == "not_identifiable", unseen
    assert "gravity_tilt (tilt_" in _unshown([row, unseen])[0], _unshown([unseen])
    assert _unshown([row]) == []
    assert _with_sight({**row, "verdict": "confounded"}, [seen["chi"]])["verdict"] == "confounded"


def test_a_hold_of_yaw_that_nothing_shows_moves_the_inertia_with_it() -> None:
    """Equal runs of yaw alone: a spring is as good as a heavier platform, share by share."""
    bench, robot = small_bench(), trifilar()
    run = replace(bench.runs[2], signals=bench.runs[2].signals[1:])
    runs = tuple(replace(run, name=f"chi {k}") for k in range(3))
    start = assembled(build_model(robot, EFFECTS), replace(bench, runs=runs, loads=()), runs)
    fit = Fit(start.swings, cast(Any, SimpleNamespace(unknowns=start.unknowns)))
    (spring,) = causes_of(robot, ["torsion_spring"])
    (seen,) = shown(Ground(start.swings, np.ones(3), 1.0), fit, [spring])
    assert not seen.told[0], seen.words
    stiffness = 9.80665 * 0.25**2 / 1.2  # g R r / L, over the mass
    share = 0.02 / stiffness  # of it, a usual spring: inertia grows by as much to keep the time
    assert abs(seen.moves[0]) == pytest.approx(share, rel=0.1), (seen.moves, share)


@pytest.mark.parametrize(("chance", "accepted"), [(0.04, False), (0.06, True)])
def test_the_less_probable_is_not_taken_for_the_one_that_failed(
    monkeypatch, chance: float, accepted: bool
) -> None:
    """A spring is far more probable, but left-out runs do not bear it out; a heavy wire does."""
    causes = [one for one in causes_of(trifilar(), ["torsion_spring", "cable_mass"])]
    spring, heavy = sorted(causes, key=lambda one: one.effect, reverse=True)
    likely = {spring.block: 1.0 - chance, heavy.block: chance}

    def fit(block: str) -> Any:
        return SimpleNamespace(
            block=block, squares=np.ones(3), solution=SimpleNamespace(cost=1.0),
            score=SimpleNamespace(surprise=np.full(3, 2.0 if block == spring.block else 1.0)),
        )  # fmt: skip

    before = fit("")
    weighed = {one.block: fit(one.block) for one in (spring, heavy)}
    monkeypatch.setattr(
        search, "chances", lambda fits, _: np.array([0.0, *(likely[one.block] for one in fits[1:])])
    )
    monkeypatch.setattr(
        search, "_complaint", lambda _, one, __: "failed" * (one.block == spring.block)
    )
    words = {
        one.block: search.Word(one, "rejected", 0.0, None, 0.0, (), "") for one in (spring, heavy)
    }
    told = search._judged(before, weighed, words)
    assert (told.winner is not None) == accepted
    verdicts = {word.cause.effect: (word.verdict, word.reason) for word in told.words}
    assert verdicts["torsion_spring"] == ("rejected", "failed")
    assert ("far more probable" in verdicts["cable_mass"][1]) != accepted, verdicts
    # Where nothing is found, what the probable one would change is not known to be right.
    unborne = [] if accepted else [(before, weighed[spring.block])]
    assert list(told.unborne) == unborne


def test_what_is_probable_and_not_borne_out_counts_in_full() -> None:
    """A centre of mass that goes 3 mm with a hook that yields, told to 1 mm without it."""
    body = Unknown("platform", np.zeros(10), np.ones(10))
    moved = replace(body, value=np.eye(10)[1] * 3e-3)

    def solution(block: Unknown) -> Solution:
        told = Unknowns((block,)), 1e-6 * np.eye(10), 0.0, (), np.ones(10), 10, 1
        return Solution(*told, cast(Any, None))

    rounds = [search.Round((), None, unborne=((fit_of(solution(body)), fit_of(solution(moved))),))]
    counted = diagnose.with_rounds(solution(body), rounds)
    assert counted.std("platform")[1] == pytest.approx(np.hypot(1e-3, 3e-3))
    assert counted.std("platform")[2] == pytest.approx(1e-3)


def fit_of(solution: Solution) -> Any:
    return SimpleNamespace(solution=solution)


def test_hooks_yield_alike_or_one_by_one() -> None:
    causes = causes_of(trifilar(), ["yielding_clamp"])
    assert [one.part for one in causes] == ["", "0", "1", "2"]
    np.testing.assert_array_equal(causes[0].directions @ [2.0], [2.0, 2.0, 2.0])
    np.testing.assert_array_equal(causes[2].directions @ [2.0], [0.0, 2.0, 0.0])


@pytest.mark.parametrize(("chance", "said"), [(0.52, True), (0.48, False)])
def test_what_is_most_likely_and_not_accepted_is_said_with_what_would_tell(chance, said) -> None:
    hooks, bent = causes_of(trifilar(), ["yielding_clamp"])[0], causes_of(trifilar())[0]
    failed = "3 of 7 left-out runs are predicted worse with it"
    words = (
        search.Word(hooks, "rejected", 0.0, chance, 0.0, (), failed),
        search.Word(bent, "rejected", 0.0, 0.1, 0.0, (), ""),
    )
    fits: Any = ((None, None),)
    notes = most_likely([search.Round(words, None, unborne=fits)])
    assert [
        ("all wires alike" in one, failed in one, "spring balance" in one) for one in notes
    ] == [(True, True, True)] * said, notes
    assert most_likely([search.Round(words, None)]) == []


def test_advice_on_every_cause_and_group_is_of_benches() -> None:
    """Nothing of workspaces, equilibria or winches; a wire is named where it is one wire."""
    causes = causes_of(trifilar())
    names = sorted({cause.effect for cause in causes})
    told = {one.block: f"{_plain(one)}: {_tells(one)}" for one in causes}
    told |= {f"{one.block}..": experiment_of((one.effect, *_others(one, ()))) for one in causes}
    told |= {" ".join(pair): experiment_of(pair) for pair in combinations(names, 2)}
    odd = {
        name: text
        for name, text in told.items()
        if any(word in text for word in ("workspace", "quilibri", "winch", "wire all"))
    }
    assert odd == {}
    assert told[COMMON].startswith("cable length bias, all wires alike: measure the wires from")
    assert told["missing.anchor_offset:1"].startswith("anchor offset, wire 1: exchange the wires")
    assert told["missing.attachment_offset"].startswith("attachment offset, all wires alike")
    assert "clamped" in experiment_of(["attachment_offset", "marker_offset"])
    assert "weigh the platform" in experiment_of(["torsion_spring", "platform_mass"])


def test_what_would_tell_one_cause() -> None:
    (tilt,) = causes_of(trifilar(), ["gravity_tilt"])
    word = search.Word(tilt, "rejected", 0.0, 0.9, 0.0, (), "failed")
    fits: Any = ((None, None),)
    (note,) = most_likely([search.Round((word,), None, unborne=fits)])
    assert "gravity tilt. It is not accepted: failed" in note, note
    assert note.split("To tell: ")[1], note
