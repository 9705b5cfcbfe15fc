"""Held-out runs simulated from a fitted start: fast swings at slow frame rates included."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import freeswing.ident.judge.prediction
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.model.elastic_motion import SPRUNG
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.statics import modes
from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.ident.judge.prediction import predict
from freeswing.ident.likelihood.fit_swings import LikelihoodFit, Swings
from freeswing.ident.likelihood.rest_pose import taut_equilibrium
from freeswing.ident.likelihood.unknowns import Unknowns
from freeswing.ident.signals.derivatives import SignalSettings
from freeswing.ident.signals.usable_runs import PreparedRun, prepare_runs
from tests.ident.swings import PAPER_LENGTHS_M, paper_model, recorded, swing

# A light platform: its com_z and moments are those of a plate, which swings at 3 to 4 Hz.
LIGHT = np.array([0.002, -0.0025, 0.198, 0.0648, 0.0513, 0.0377, 0.0, -4e-4, 5e-4])
NOISE_M = 1e-4


def filmed(equilibrium: int, rate_hz: int, coordinates: tuple[str, ...], seed: int) -> PreparedRun:
    """A swing of the light platform at a camera's rate."""
    motion = swing(equilibrium, duration_s=8.0, inertia=tuple(LIGHT))
    generator = np.random.default_rng(seed)
    times = np.arange(8 * rate_hz + 1) / rate_hz
    run = recorded(motion, f"fast-{equilibrium}", None, 0.0, coordinates, "validate")
    columns = [POSE_COORDINATES.index(name) for name in coordinates]
    std = np.where(np.array(columns) < 3, NOISE_M, 5 * NOISE_M)
    values = motion.at(times)[0][:, columns] + std * generator.standard_normal(
        (len(times), len(columns))
    )
    run = replace(run, trajectory=Trajectory(times, coordinates, values))
    (prepared,) = prepare_runs([run], paper_model(), SignalSettings()).runs
    return prepared


@pytest.mark.parametrize(
    ("equilibrium", "coordinates"),
    [
        (7, POSE_COORDINATES),
        (11, ("x", "y")),
        pytest.param(7, ("x", "y"), marks=pytest.mark.slow),
        pytest.param(11, POSE_COORDINATES, marks=pytest.mark.slow),
    ],
)
def test_fast_swings_at_40_hz_are_predicted_to_their_noise(
    equilibrium: int, coordinates: tuple[str, ...]
):
    """About equilibrium 11 the first start ends 30 mm off; a second one grows into the run."""
    assert fastest_hz(equilibrium) > 2.5, f"{fastest_hz(equilibrium)} Hz is not fast"
    run = filmed(equilibrium, 40, coordinates, seed=0)
    free = None if len(coordinates) == 6 else coordinates
    found = predict(paper_model(), run, free, LIGHT)
    assert found.rmse_m is not None
    assert found.rmse_m == pytest.approx(NOISE_M, rel=0.1), f"off by {found.rmse_m} m"


def test_a_start_that_cannot_be_simulated_over_the_run_is_grown_into_it(
    monkeypatch: pytest.MonkeyPatch,
):
    fitted = freeswing.ident.judge.prediction._fitted

    def short_only(swings: Swings, unknowns: Unknowns, grow: bool) -> LikelihoodFit:
        if not grow:
            raise ValueError("the free motion cannot be followed beyond 0.7 s")
        return fitted(swings, unknowns, grow)

    monkeypatch.setattr(freeswing.ident.judge.prediction, "_fitted", short_only)
    off = predict(paper_model(), filmed(7, 40, ("x", "y"), seed=1), ("x", "y"), LIGHT).rmse_m
    assert off == pytest.approx(NOISE_M, rel=0.1), f"off by {off} m"


def fastest_hz(equilibrium: int) -> float:
    model = paper_model()
    rest = taut_equilibrium(model, PAPER_LENGTHS_M[equilibrium], LIGHT, "light")
    return float(modes(model, rest, LIGHT).frequencies_hz.max())


def test_a_run_s_frame_stays_within_what_markers_can_be_off() -> None:
    """The inertia is 2 % off: the frame may not make up for it by many times its tolerance."""
    run = filmed(7, 40, POSE_COORDINATES, seed=0)
    model = build_model(paper_model().robot, ("platform_frame",))
    found = predict(model, run, None, LIGHT * 1.02)
    tolerances = np.array([one.prior_std for one in model.parameters])
    assert np.abs(found.values / tolerances).max() < 1.0, found.values
    right = predict(model, run, None, LIGHT)
    assert right.rmse_m == pytest.approx(NOISE_M, rel=0.1)
    assert np.abs(right.values / tolerances).max() < 1.0, right.values


@pytest.mark.parametrize(
    ("effects", "guess", "taken"),
    [
        ((), 1.0, 500.0),
        (SPRUNG, 1.0, 1.0),
        (SPRUNG, 900.0, 500.0),
        (SPRUNG, None, 500.0),
    ],
)
def test_a_platform_on_springs_is_begun_from_a_guess_too(
    monkeypatch, effects, guess, taken
) -> None:
    """Where a rigid one was 2.3 mm off the vibrating one stayed, at 23 times the noise."""
    place = freeswing.ident.judge.prediction

    def followed(*_: object) -> SimpleNamespace:
        if guess is None:
            raise ValueError("no start")
        return SimpleNamespace(deviance=guess)

    monkeypatch.setattr(place, "_carried_on", lambda *_: SimpleNamespace(deviance=500.0))
    monkeypatch.setattr(place, "_followed", followed)
    monkeypatch.setattr(place, "_held", lambda *_: None)
    monkeypatch.setattr(place, "_thinned", lambda samples: samples)
    monkeypatch.setattr(place, "started", lambda *_: (SimpleNamespace(), np.zeros(12)))
    monkeypatch.setattr(place, "_weighed", lambda found: found)
    stage: Any = SimpleNamespace(model=SimpleNamespace(effects=effects), inertia=LIGHT)
    nothing: Any = SimpleNamespace()
    assert place._fitted_to(stage, nothing, None, nothing).deviance == taken
