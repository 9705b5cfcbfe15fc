"""When a bench says a number, doubts it or refuses a column: both sides of each limit."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.model.equations import build_model
from freeswing.ident.bench import fit_rounds, mass_verdict, noise
from freeswing.ident.bench.channels import Channel, check_moves
from freeswing.ident.bench.modal import SQUARE
from freeswing.ident.bench.noise import _colours, rescaled
from freeswing.ident.bench.runs import Bench, BenchRun, Signal, check_swings
from freeswing.ident.bench.scatter_between_runs import scatter_std
from freeswing.ident.bench.swing import COMMON, Column
from freeswing.ident.bench.told.classic_formula import (
    BESIDE,
    ClassicRun,
    leaning_sentence,
    sine_period,
    unchecked_lengths,
)
from freeswing.ident.bench.told.contradicted import strained_sentence
from freeswing.ident.bench.told.report_objects import _in_true_scale, told_object
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown, Unknowns
from tests.ident.bench.test_swing_slopes import trifilar

TRIFILAR = SimpleNamespace(robot=SimpleNamespace(n_cables=3))


def body(mass_std: float, prior_std: float = 0.1) -> SimpleNamespace:
    """A fit of a platform of 5 kg whose other numbers are held."""
    prior = Gaussian(np.full(10, 5.0), np.full(10, prior_std), "declared")
    platform = Unknown("platform", np.full(10, 5.0), np.ones(10), prior)
    covariance = mass_std**2 * np.eye(10)
    return SimpleNamespace(
        unknowns=Unknowns((platform,)), value=lambda name: platform.value,
        std=lambda name: np.sqrt(np.diag(covariance)), covariance_of=lambda name: covariance,
    )  # fmt: skip


@pytest.mark.parametrize(("declared_kg", "contradicted"), [(5.28, False), (5.32, True)])
def test_a_declared_mass_that_payload_runs_exclude(monkeypatch, declared_kg, contradicted):
    """Runs that know the mass to 0.1 kg."""
    monkeypatch.setattr(mass_verdict, "fit", lambda swings, unknowns, how: body(0.1))
    model = SimpleNamespace(robot=SimpleNamespace(platform=SimpleNamespace(mass_kg=declared_kg)))
    start = SimpleNamespace(runs=[SimpleNamespace(payloads=("one",))])
    bench = SimpleNamespace(mass_std_kg=None)
    _, verdict = mass_verdict.weighed_mass(bench, model, (), body(0.1), start, fit_rounds.FINE)
    assert verdict is not None
    assert verdict.contradicted == contradicted, verdict


@pytest.mark.parametrize(("runs", "looked"), [(4, False), (5, True)])
def test_scatter_is_looked_for_between_enough_runs(monkeypatch, runs, looked) -> None:
    asked = []
    none = SimpleNamespace(coordinates=(), signals=())
    blocks = body(0.1).unknowns.joined(Unknown(COMMON, np.zeros(1), np.ones(1)))
    fitted = {**vars(body(0.1)), "covariance": np.eye(11)}
    monkeypatch.setattr(
        fit_rounds,
        "fit",
        lambda _, unknowns, how: SimpleNamespace(**(fitted | {"unknowns": unknowns})),
    )
    monkeypatch.setattr(fit_rounds, "_rough", lambda swings, unknowns: unknowns)
    monkeypatch.setattr(
        fit_rounds,
        "first_fit",
        lambda swings, unknowns: fit_rounds.fit(swings, unknowns, fit_rounds.ROUGH),
    )
    monkeypatch.setattr(fit_rounds, "_fastest", lambda *_: 1.0)
    monkeypatch.setattr(fit_rounds, "rescaled", lambda swings, *_, **__: swings)
    monkeypatch.setattr(
        fit_rounds, "weighed_mass", lambda bench, model, swings, found, *_: (found, None)
    )
    monkeypatch.setattr(fit_rounds, "considered", lambda swings, found, held: found)
    monkeypatch.setattr(fit_rounds, "replace", lambda found, **_: found)
    monkeypatch.setattr(fit_rounds, "scatter_std", lambda found: asked.append(1) or 0.0)
    start = SimpleNamespace(swings=tuple(range(runs)), unknowns=blocks, runs=[none] * runs)
    fit_rounds.solved(TRIFILAR, Bench(()), start)
    assert bool(asked) == looked


@pytest.mark.parametrize(("share", "counts"), [(0.048, True), (0.052, False)])
def test_payload_runs_that_check_a_declared_mass(share, counts) -> None:
    """5 kg declared, 4.9 by payload runs, known to that share of it; what answers twice as much."""
    free = body(0.1)
    covariance = 1e-4 * np.eye(10)
    covariance[6, 0] = covariance[0, 6] = 2e-4
    freed = SimpleNamespace(covariance=covariance, unknowns=free.unknowns)
    verdict = mass_verdict.MassVerdict(5.0, 4.9, 5.0 * share, contradicted=False, stated=True)
    counted = mass_verdict.doubt(freed, verdict)
    assert counted[6] == pytest.approx(0.2 if counts else 0.0)
    assert counted[0] == 0.0


@pytest.mark.parametrize(("off", "counts"), [(1.95, False), (2.05, True)])
def test_a_declared_mass_that_runs_speak_against_counts_however_little_they_tell(off, counts):
    """Runs that know it to a tenth, so many deviations off: the declared one serves."""
    covariance = 1e-4 * np.eye(10)
    covariance[6, 0] = covariance[0, 6] = 2e-4
    freed = SimpleNamespace(covariance=covariance, unknowns=body(0.1).unknowns)
    told = 5.0, 5.0 + 0.5 * off, 0.5
    verdict = mass_verdict.MassVerdict(*told, contradicted=False, stated=True)
    counted = mass_verdict.doubt(freed, verdict)
    assert counted[6] == pytest.approx(-off if counts else 0.0)
    solution = SimpleNamespace(value=lambda name: np.full(10, 5.0))
    solved = SimpleNamespace(mass=verdict, doubts={"platform": counted}, solution=solution)
    sentence = strained_sentence(solved)
    assert bool(sentence) == counts
    assert f"the platform by {20.0 * off:+.2g} %" in sentence or not counts, sentence


@pytest.mark.parametrize(("std_kg", "open_kg"), [(0.01, 0.01), (0.125, 0.0884), (10.0, 0.125)])
def test_a_declared_mass_that_nobody_says_to_be_known(std_kg, open_kg) -> None:
    """5 kg, to a fortieth as scales go and to `std_kg` by runs: what is left of both is open."""
    covariance = 1e-4 * np.eye(10)
    covariance[6, 0] = covariance[0, 6] = 2e-4
    freed = SimpleNamespace(covariance=covariance, unknowns=body(0.1).unknowns)
    verdict = mass_verdict.MassVerdict(5.0, 5.0, std_kg, contradicted=False)
    counted = mass_verdict.doubt(freed, verdict)
    np.testing.assert_allclose(counted[[0, 6]], [open_kg, 2.0 * open_kg], rtol=0.01)
    stated = mass_verdict.MassVerdict(5.0, 5.0, std_kg, contradicted=False, stated=True)
    assert not mass_verdict.doubt(freed, stated).any()
    used = mass_verdict.MassVerdict(5.0, 6.0, std_kg, contradicted=True)
    assert not mass_verdict.doubt(freed, used).any()


def test_what_runs_say_and_what_is_open_add_up() -> None:
    """4.9 kg by runs that know it to 0.1: off by that, and open by what scales leave of it."""
    verdict = mass_verdict.MassVerdict(5.0, 4.9, 0.1, contradicted=False)
    covariance = 1e-4 * np.eye(10)
    freed = SimpleNamespace(covariance=covariance, unknowns=body(0.1).unknowns)
    counted = mass_verdict.doubt(freed, verdict)
    open_kg = 0.1 * 0.125 / np.hypot(0.1, 0.125)
    assert counted[0] == pytest.approx(np.hypot(0.1, open_kg))
    assert verdict.open_part == pytest.approx(open_kg / counted[0])


@pytest.mark.parametrize(("fitted_kg", "counts"), [(5.048, True), (5.052, False), (4.952, True)])
def test_a_contradiction_as_small_as_wires_that_give_way(fitted_kg, counts) -> None:
    """Up to a hundredth either mass may be right, and both are counted; beyond, the fitted one."""
    covariance = 1e-4 * np.eye(10)
    covariance[6, 0] = covariance[0, 6] = 2e-4
    freed = SimpleNamespace(covariance=covariance, unknowns=body(0.1).unknowns)
    verdict = mass_verdict.MassVerdict(5.0, fitted_kg, 0.001, contradicted=True)
    counted = mass_verdict.doubt(freed, verdict)
    shift = 5.0 - fitted_kg if counts else 0.0
    assert counted[[0, 6]] == pytest.approx([shift, 2.0 * shift])


@pytest.mark.parametrize(("shift_mm", "contradicted"), [(2.9, False), (3.1, True)])
def test_wires_that_sway_contradicts(shift_mm, contradicted) -> None:
    """Sway knows them to 1 mm; beyond three times that its lengths serve, and all is counted."""
    value = np.array([1e-3 * shift_mm])
    covariance = np.array([[1e-6, 2e-6], [2e-6, 1e-4]])  # of the wires, and of what answers
    found = SimpleNamespace(
        value=lambda name: value, std=lambda name: np.array([1e-3]),
        covariance=covariance, place=lambda name: slice(0, 1),
    )  # fmt: skip
    run = SimpleNamespace(lengths_std_m=5e-4)
    swing = SimpleNamespace(lengths_m=np.full(3, 1.0))
    verdict = fit_rounds._wires(found, SimpleNamespace(swings=[swing], runs=[run]))
    assert verdict.contradicted == contradicted, verdict
    counted = fit_rounds._who_is_right(found, verdict)
    expected = [value[0], 2.0 * value[0]] if contradicted else [0.0, 0.0]
    np.testing.assert_allclose(counted, np.outer(expected, expected), rtol=1e-12)


@pytest.mark.parametrize(("chi_square", "seen"), [(2.4, False), (3.0, True)])
def test_a_scatter_that_is_significant(chi_square, seen) -> None:
    """Twelve runs of deviation 1 whose spread makes the likelihood rise by this much."""
    pattern = np.tile([1.0, -1.0], 6)
    sizes = np.linspace(1.0, 2.0, 4001)
    rise = 12.0 * (sizes**2 - 1.0 - np.log(sizes**2))  # twice the logarithm, maximal scatter
    values = 1e-4 * sizes[int(np.argmin(np.abs(rise - chi_square)))] * pattern
    prior = Gaussian(np.zeros(12), np.full(12, 1e-3), "test")
    found = SimpleNamespace(
        value=lambda name: values, covariance_of=lambda name: np.eye(12) * 1e-8,
        unknowns=Unknowns((Unknown("scatter", values, np.array([1e-4]), prior),)),
    )  # fmt: skip
    assert (scatter_std(found) > 0.0) == seen


def swing_of(values: np.ndarray, rate_hz: float = 50.0) -> SimpleNamespace:
    times = np.arange(len(values)) / rate_hz
    column = Column("chi", np.zeros(len(values)), np.ones(len(values)), 5)
    return SimpleNamespace(times_s=times, columns=(column,))


@pytest.mark.parametrize(("held", "factor"), [(60, np.sqrt(100 / 40)), (90, 2.0)])
def test_a_fit_never_uses_up_more_than_three_quarters_of_the_samples(monkeypatch, held, factor):
    """A hundred residuals of one, and so many unknowns."""
    monkeypatch.setattr(noise, "replace", lambda one, **changes: SimpleNamespace(**changes))
    unknown = Unknown("all", np.zeros(held), np.ones(held))
    found = SimpleNamespace(residuals=[np.ones(100)], unknowns=Unknowns((unknown,)))
    (scaled,) = rescaled([swing_of(np.ones(100))], found, 1.0, coloured=False)
    assert scaled.columns[0].factor == pytest.approx(factor, rel=0.02)


@pytest.mark.parametrize(("over", "counts"), [(2.8, True), (3.2, False)])
def test_noise_near_the_swing_counts(over, counts) -> None:
    """A disturbance at so many times the fastest swing of 1 Hz."""
    white = np.sin(2.0 * np.pi * over * np.arange(1000) / 50.0)
    found = SimpleNamespace(residuals=[white])
    colour = _colours([swing_of(white)], found, 1.0, 0.0)["chi"]
    assert (colour > 2.0) == counts, colour


@pytest.mark.parametrize(("share", "told"), [(0.46, True), (0.54, False)])
def test_a_number_that_rests_on_its_prior(share, told) -> None:
    """The share of the prior's variance that is left."""
    found = body(0.1 * np.sqrt(share))
    solved = SimpleNamespace(solution=found, first=found.unknowns, held={})
    rows = told_object(solved, "platform", np.zeros(10, bool), one_way=False)
    assert [row.identifiable for row in rows[1:]] == [told] * 9


@pytest.mark.parametrize(("percent", "warned"), [(0.9, False), (1.1, True)])
def test_izz_that_leans_on_an_unseen_centre_of_mass(percent, warned) -> None:
    run = ClassicRun("a", 1.0, 1.0, 1.0, ((BESIDE, -percent),))
    assert bool(leaning_sentence([run], sway_seen=False)) == warned


@pytest.mark.parametrize(("periods", "found"), [(2.2, True), (1.75, False)])
def test_a_period_needs_two_of_them(periods, found) -> None:
    times = np.arange(501) / 50.0
    values = 0.1 * np.cos(2.0 * np.pi * periods * times / 10.0)
    period = sine_period(times, values)
    assert period is not None
    assert (abs(period * periods / 10.0 - 1.0) < 0.02) == found, period


@pytest.mark.parametrize(("over", "usable"), [(4.6, False), (5.5, True)])
def test_a_channel_that_moves_above_its_noise(over, usable) -> None:
    """A slow sine beside noise, its spread over the noise's."""
    random = np.random.default_rng(0).standard_normal(4000)
    slow = np.sin(np.arange(4000) / 300.0)
    values = slow / slow.std() * np.sqrt(over**2 - 1.0) + random / random.std()
    with nullcontext() if usable else pytest.raises(DataError, match="never moves above its noise"):
        check_moves("a", "laser", values)


@pytest.mark.parametrize(("share", "told"), [(0.9, True), (1.1, False)])
def test_a_gain_that_the_period_tells(share, told) -> None:
    """Squared amplitudes four times those assumed: gains of half the size, if it is told."""
    values = {SQUARE: np.array([4.0])}
    found = SimpleNamespace(
        value=lambda name: values[name], std=lambda name: np.array([4.0 * share])
    )
    channel = Channel("dot", "dot_px", ("chi", "x"), order=2)
    value, std = np.array([100.0, 10.0, 8.0, 6.0, 4.0]), np.zeros(5)
    gains, spread = _in_true_scale(SimpleNamespace(solution=found), channel, value, std)
    expected = np.array([50.0, 10.0, 2.0, 3.0, 4.0])
    seen = [True, True, True, True, True] if told else [False, True, False, False, True]
    np.testing.assert_allclose(gains[seen], (expected if told else value)[seen])
    assert np.isfinite(gains).tolist() == seen
    assert spread[0] == pytest.approx(0.5 * share * 50.0) if told else not np.isfinite(spread[0])


def still_run(chi: np.ndarray, *more: Signal) -> BenchRun:
    times = np.arange(len(chi)) / 50.0
    return BenchRun("a", "identify", times, (Signal("chi", chi), *more), np.full(3, 1.2))


@pytest.mark.parametrize(("over", "usable"), [(1.3, False), (1.7, True)])
def test_a_run_that_stands_still(over, usable) -> None:
    """Spread over the noise between neighbours; a channel beside it is judged by itself."""
    random = np.random.default_rng(0).standard_normal(4000)
    slow = np.sin(np.arange(4000) / 300.0)
    chi = slow / slow.std() * np.sqrt(over**2 - 1.0) + random / random.std()
    with (
        nullcontext()
        if usable
        else pytest.raises(DataError, match="run a: nothing moves above its noise in chi")
    ):
        check_swings(still_run(chi))
    check_swings(still_run(chi, Signal("dot_px", slow)))


def test_a_column_that_no_sensor_gave() -> None:
    chi, constant = np.sin(np.arange(100) / 9.0), Signal("theta", np.full(100, 0.1))
    with pytest.raises(DataError, match="run a: column theta is the same number throughout"):
        check_swings(still_run(chi, constant))


@pytest.mark.parametrize(
    ("wires", "payloads", "says"),
    [(None, (), True), ("by sway", (), False), (None, ("known",), False)],
)
def test_lengths_that_nothing_checks(wires, payloads, says) -> None:
    """Izz goes as one over the length: by yaw alone a factor two would be unseen."""
    swing = SimpleNamespace(model=build_model(trifilar()), lengths_m=np.full(3, 1.2))
    solved = SimpleNamespace(swings=(swing,), wires=wires)
    told = unchecked_lengths(solved, [SimpleNamespace(payloads=payloads)])
    assert bool(told) == says, told
    assert ("1.2 m would halve it" in told and "ten sways (22.0 s" in told) == says, told
