"""Cables that stretch vibrate: the full motion beside its slow part, and starts that pluck them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.elastic_motion import SPRUNG, lengths_of
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.cdpr.simulation.free_swing import Motion, simulate
from freeswing.ident.diagnose import heldout, screen
from freeswing.ident.diagnose import refit as fits
from freeswing.ident.diagnose.answer.entries import accepted_entries
from freeswing.ident.diagnose.own_values import OwnValues
from freeswing.ident.diagnose.refit import Refit, rescored, without
from freeswing.ident.diagnose.springs import full_motion as module
from freeswing.ident.diagnose.springs.full_motion import fully
from freeswing.ident.likelihood.blocks import STARTS, each_run, eased, first_unknowns
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_swings import ONWARD, Swings
from freeswing.ident.likelihood.joint_problem import NotFollowedError
from freeswing.ident.likelihood.run_residuals import Reduced, plucked_start
from freeswing.ident.likelihood.samples_and_noise import UNIT_NOISE_M, prepare
from tests.ident.swings import TRUE_INERTIA, paper_model, recorded, swing

EQUILIBRIA = (2, 5, 8)
COMPLIANCE, DAMPING = 1e-4, 2e-7  # 8 kg on EA = 80 kN, 2 ms
NOISE_M, LONG_S = 1e-4, 2.0
SCALES = np.full(2, NOISE_M / UNIT_NOISE_M)


@cache
def vibrating(plucked_m: float) -> tuple[Motion, ...]:
    """Releases with every cable let go of longer than it hangs, by so much."""
    model, found = build_model(paper_model().robot, SPRUNG), []
    for place in EQUILIBRIA:
        start = swing(place, 0.015, 0.01, 1.0).zetas[0]
        values = np.append([COMPLIANCE, DAMPING], model.start_values[2:])
        values = eased(model, TRUE_INERTIA, values, np.append(start, np.zeros(6))[None])[0]
        values[lengths_of(model)] += plucked_m * np.array([1.0, -0.5, 0.7, 0.2])
        found.append(simulate(model, start, np.zeros(6), (0.0, LONG_S), TRUE_INERTIA, values))
    return tuple(found)


@cache
def slow(plucked_m: float) -> Refit:
    """The fit of these runs with stretch that follows its tension."""
    rng, motions = np.random.default_rng(4), vibrating(plucked_m)
    runs = [
        recorded(one, f"run {k}", rng, NOISE_M, POSE_COORDINATES) for k, one in enumerate(motions)
    ]
    model = build_model(paper_model().robot, SPRUNG[:1])
    told = [one.values[lengths_of(one.model)] for one in motions]
    samples = tuple(
        prepare(replace(run, lengths_m=lengths), (0.0, LONG_S))
        for run, lengths in zip(runs, told, strict=True)
    )
    starts = np.array([np.append(one.zetas[0], one.rates[0]) for one in motions])
    values = np.array([COMPLIANCE, DAMPING])
    unknowns = first_unknowns(model, TRUE_INERTIA, starts, [None] * len(runs), values)
    swings = Swings(model, samples, SCALES)
    return rescored(fit(swings, unknowns, replace(ONWARD, tolerance=1.0)), SCALES, 1.0)


@cache
def full(plucked_m: float) -> Refit:
    """The same runs with the full motion."""
    return fully(slow(plucked_m), SPRUNG[0], SCALES, 1.0)


@pytest.mark.parametrize("plucked_m", [0.0, 3e-4])
def test_vibration_is_followed_to_the_noise_and_stretch_is_right(plucked_m: float) -> None:
    found = full(plucked_m)
    assert found.effects == SPRUNG
    value, std = found.fit.value(SPRUNG[0]), found.fit.std(SPRUNG[0])
    off = (value - [COMPLIANCE, DAMPING]) / std
    assert np.abs(off).max() < 3.5, f"{off} deviations: {value} +- {std}"
    left, before = (one.fit.cost / found.evidence.counts.sum() for one in (found, slow(plucked_m)))
    assert left == pytest.approx(1.0, abs=0.06), left
    assert before > 1.3, before


def test_starts_that_pluck_cables_are_told_from_others() -> None:
    """By so many times the whole weight, of all runs together; a start at ease by hardly any."""
    truth = np.concatenate([_plucks(one) for one in vibrating(3e-4)])
    known = full(3e-4).evidence.plucked
    assert known is not None
    size = np.sqrt(np.mean(truth**2))
    assert known.likeliest()[0] == pytest.approx(size, rel=0.4), size
    quiet = full(0.0).evidence.plucked
    assert quiet is not None
    assert quiet.likeliest()[0] < 0.03


def _plucks(motion: Motion) -> np.ndarray:
    usual = motion.values[motion.model.place_of(SPRUNG[1])][0]
    return usual * plucked_start(motion)


def test_a_start_at_ease_plucks_nothing() -> None:
    rest = plucked_start(vibrating(0.0)[0])
    assert np.abs(rest).max() < 1e-6, rest
    assert plucked_start(swing(2, duration_s=1.0)).shape == (0,)


def test_unstretched_lengths_are_no_offset_of_the_measured_frame() -> None:
    """They had been told as `frame_shift_m`: two metres."""
    motion = vibrating(0.0)[0]
    told: Any = SimpleNamespace(values=motion.values)
    assert heldout._offset(motion.model, told) is None
    framed = build_model(motion.model.robot, (*SPRUNG, "platform_frame"))
    told.values = np.append(motion.values, [3e-3, 0.0, 0.0, 0.0, 6e-3, 0.0])
    assert heldout._offset(framed, told) == pytest.approx((3e-3 / 3**0.5, 6e-3 / 3**0.5))


def test_without_stretch_nothing_vibrates() -> None:
    with pytest.raises(ValueError, match="rigid cables do not vibrate"):
        build_model(paper_model().robot, SPRUNG[1:])
    fewer = without(full(0.0).fit, SPRUNG[0], SCALES)
    assert fewer.effects == ()


def test_tensions_are_those_of_the_stretch() -> None:
    motion = vibrating(3e-4)[0]
    values, times = motion.values, np.array([0.0, 0.4])
    lengths = evaluate(motion.model.lengths, motion.at(times)[0], values)[0]
    slopes = np.gradient(
        evaluate(motion.model.lengths, motion.at(np.array([0.4 - 1e-5, 0.4 + 1e-5]))[0], values)[0],
        2e-5,
        axis=0,
    )[0]
    rest = values[lengths_of(motion.model)]
    pull = (lengths[1] - rest + DAMPING / COMPLIANCE * slopes) / (COMPLIANCE * rest)
    np.testing.assert_allclose(motion.tensions(times)[1], pull, rtol=1e-6)


def test_what_a_fan_and_plucks_say_alike_is_charged_once() -> None:
    """Charged twice less, a fan at 31 Hz stood beside stretch where runs began plucked."""
    joint = np.array([[101.0, 99.0], [99.0, 101.0]])  # a pluck, and a fan's part
    own = np.column_stack([np.linalg.cholesky(joint).T, np.zeros(2)])
    places = {"harmonic_force": slice(0, 1), SPRUNG[1]: slice(1, 2)}
    model: Any = SimpleNamespace(
        effects=tuple(places), names=("a", "b"), own_values=np.array([0]),
        parameters=(SimpleNamespace(prior_std=1.0),) * 2, place_of=places.get,
    )  # fmt: skip
    motion: Any = SimpleNamespace(model=model, values=np.ones(2))
    nothing = np.zeros((0, 0))
    run = Reduced(nothing, own, nothing, np.array([0]), np.array([[1.0, 0.0, 0.0]]))
    found = (part(run, motion, 1.0) for part in (screen._own_values, screen._plucked))
    charges = [np.log(one.curves[0, 0] + 1.0) for one in found if one is not None]
    assert sum(charges) == pytest.approx(np.linalg.slogdet(joint)[1])


def test_stretch_that_makes_way_takes_its_vibration_along() -> None:
    """An anchor held against it at the end of a search would have stood beside the vibration."""
    model, unknowns = fits._freed_of(full(0.0).fit, SPRUNG[0])
    assert not model.effects
    assert not {*SPRUNG, each_run(SPRUNG[1])} & {block.name for block in unknowns.blocks}


@pytest.mark.parametrize(("chance", "taken"), [(0.49, False), (0.51, True)])
def test_vibration_must_be_likelier_than_none(monkeypatch, chance, taken) -> None:
    """A line of the noise is as good as a vibration that rings for ever."""
    monkeypatch.setattr(module, "included", lambda *_: chance)
    found = fully(slow(0.0), SPRUNG[0], SCALES, 1.0)
    assert (SPRUNG[1] in found.effects) == taken
    assert ("do not show a vibration (probability 0.49)" in found.slowly) == (not taken)


@pytest.mark.parametrize(
    "error",
    [NotFollowedError("run 2: no motion from there"), np.linalg.LinAlgError("Singular matrix")],
)
def test_a_motion_that_cannot_be_followed_is_said(monkeypatch, error) -> None:
    def stuck(*_: Any) -> Any:
        raise error

    monkeypatch.setattr(module, "ranked", stuck)
    found = fully(slow(0.0), SPRUNG[0], SCALES, 1.0)
    assert found.fit is slow(0.0).fit
    assert found.slowly == f"no motion with vibration follows the runs: {error}"


def test_other_errors_of_that_fit_are_not_taken_for_it(monkeypatch) -> None:
    """Any ValueError had been, and slow stretch stood without a word."""

    def wrong(*_: Any) -> Any:
        raise ValueError("unknown starts: bounds, prior or mask are not the model's")

    monkeypatch.setattr(module, "ranked", wrong)
    with pytest.raises(ValueError, match="unknown starts"):
        fully(slow(0.0), SPRUNG[0], SCALES, 1.0)


def test_what_cannot_be_followed_is_told_by_its_run() -> None:
    found = slow(0.0).fit
    starts = replace(found.unknowns.block(STARTS), value=np.full((len(found.samples), 12), 9.0))
    swings = replace(found.swings, motions=())
    with pytest.raises(NotFollowedError, match="run run 0: "):
        fit(swings, found.unknowns.exchanged(starts), ONWARD)


def test_the_result_says_whether_stretch_was_fitted_with_its_vibration() -> None:
    for found, said in ((full(0.0), "with vibration"), (slow(0.0), "quasi-static: at the noise")):
        told = np.eye(len(found.fit.covariance))
        groups = {SPRUNG[0]: (SPRUNG[0],)}
        (entry,) = accepted_entries(found.fit, told, groups, {SPRUNG[0]: "at the noise"})
        assert entry["motion"] == said


@pytest.mark.parametrize(("times", "held"), [(1.95, [0.01, 0.01]), (2.05, [0.01, 0.01, 0.0205])])
def test_plucks_beyond_what_they_were_held_to_are_fitted_again(monkeypatch, times, held) -> None:
    usual = 0.01
    fitted: list[float] = []
    sizes = iter([times * usual, 0.0])
    ranked = module.ranked

    def counted(swings: Any, unknowns: Any, cost: float) -> Any:
        fitted.append(float(unknowns.value(SPRUNG[1])[0]))
        return ranked(swings, unknowns, cost)

    monkeypatch.setattr(module, "ranked", counted)
    monkeypatch.setattr(OwnValues, "likeliest", lambda _: (next(sizes), np.zeros(3)))
    monkeypatch.setattr(module, "included", lambda *_: 1.0)
    monkeypatch.setattr(module, "rescored", _unscored)
    fully(slow(0.0), SPRUNG[0], SCALES, 1.0)
    assert fitted == pytest.approx(held)


def _unscored(found: Any, *_: Any) -> Any:
    return Refit(found, full(0.0).evidence, full(0.0).score)


@pytest.mark.parametrize(
    ("effects", "likelier", "asked"),
    [
        (SPRUNG[:1], True, True),
        (SPRUNG[:1], False, True),
        (SPRUNG, True, False),
        (("rotational_drag",), True, False),
    ],
)
def test_vibration_is_asked_again_once_less_is_missing(
    monkeypatch, effects, likelier, asked
) -> None:
    """Beside a missing attachment and tilt it was not likelier; after them, by 2081 in density."""
    found: Any = SimpleNamespace(effects=effects, fit="slow")
    moving: Any = SimpleNamespace(effects=SPRUNG, fit="full")
    asks: list[str] = []

    def fully_so(one, name, *_):
        asks.append(name)
        return moving if likelier else one

    monkeypatch.setattr(module, "fully", fully_so)
    monkeypatch.setattr(module, "colour_of", lambda *_: 1.0)
    monkeypatch.setattr(module, "polished", lambda fit, *_: fit)
    told = module.fully_by_now(found, SCALES)
    assert asks == (["cable_elasticity"] if asked else [])
    assert told == ("full" if asked and likelier else found)


def test_what_stands_in_the_model_beside_a_place_that_leads_is_not_told() -> None:
    """It widens the others, and is nothing."""
    found = slow(0.0)
    assert not accepted_entries(found.fit, np.eye(len(found.fit.covariance)), {}, {})
