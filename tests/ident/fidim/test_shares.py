"""What moves FIDIM's solution beside scatter: foreseen where truth is known, held by deviations."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.regressor import regressor
from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.ident.estimate import Estimate
from freeswing.ident.fidim import bias
from freeswing.ident.fidim.bias import noise_bias, smoothing_bias
from freeswing.ident.fidim.fidim_stage import How, fidim_estimates
from freeswing.ident.fidim.length_share import length_share
from freeswing.ident.fidim.shares import Share, Stack, shares_sentence
from freeswing.ident.fidim.total_least_squares import total_least_squares
from freeswing.ident.runs import SwingRun
from freeswing.ident.signals.derivatives import SignalSettings
from freeswing.ident.signals.usable_runs import motion_of, prepare_runs, usable
from tests.ident.swings import TRUE_INERTIA, paper_model, recorded, swing
from tests.oracle.recorded.sessions import make_scene, tait_bryan
from tests.oracle.scenes.robots import declared_robot, true_body
from tests.oracle.scenes.runs import draw_run

ALL = np.ones(9, dtype=bool)
LENGTH_STD_M = 3e-4
NOISE_M = 3e-5


def filmed(seed: int, noise_m: float) -> tuple[list[SwingRun], np.ndarray]:
    """Three swings of 6 s as a phone would give them, lengths told with errors; the inertia."""
    rng = np.random.default_rng(seed)
    robot, body = declared_robot("bologna-4"), true_body("bologna-4", rng)
    scene, runs = make_scene(robot, body, {}, rng), []
    for k in range(3):
        run = draw_run(scene, rng, 6.1, 400.0)
        poses = np.hstack([run.motion.positions_m, tait_bryan(run.motion.quaternions)])
        times = np.arange(0.05, 6.0, 1001 / 30000)
        noise = noise_m * np.where(np.arange(6) < 3, 1.0, 2.0)
        values = CubicSpline(run.motion.times_s, poses)(times)
        values = values + noise * rng.standard_normal(values.shape)
        stated = np.broadcast_to(np.diag(noise**2), (len(times), 6, 6))
        trajectory = Trajectory(times, POSE_COORDINATES, values, stated, "made")
        told = run.world.length + rng.normal(0.0, LENGTH_STD_M, 4)
        window = float(times[0]), float(times[-1])
        runs.append(SwingRun(f"swing-{k}", "identify", trajectory, told, LENGTH_STD_M, window))
    return runs, np.concatenate([body.com_m, body.specific_inertia_m2])


@pytest.fixture(scope="module")
def sessions() -> list[tuple[Estimate, np.ndarray]]:
    """FIDIM by x and y of six sessions, beside the truth."""
    return [(found["fidim_free"], truth) for found, truth in estimated(range(200, 206), NOISE_M)]


def estimated(
    seeds: range, noise_m: float, how: How | None = None
) -> list[tuple[dict[str, Estimate], np.ndarray]]:
    """FIDIM's estimates of sessions, beside the truth."""
    model, found = build_model(declared_robot("bologna-4")), []
    for seed in seeds:
        runs, truth = filmed(seed, noise_m)
        prepared = prepare_runs(runs, model, SignalSettings())
        how = how or How(settings=SignalSettings())
        found.append((fidim_estimates(model, prepared, how, None)[1], truth))
    return found


@pytest.mark.slow
def test_intervals_of_free_coordinates_hold_the_truth(sessions) -> None:
    """With stated lengths off by their 0.3 mm, uneven noise and a smoother."""
    z = np.array([(one.values - truth) / one.std for one, truth in sessions])
    assert np.abs(z).max() < 3.0, f"{np.round(z, 1)}"
    assert np.sqrt(np.mean(z**2)) > 0.4, f"{np.round(z, 1)}: deviations far too wide"


@pytest.mark.slow
@pytest.mark.parametrize("weighting", ["published", "covariance"])
def test_intervals_hold_the_truth_where_poses_are_noisier(weighting: str) -> None:
    """At 0.1 mm noise moves values by as much as they are; runs near singular x, y are among them.

    Without scatter between stretches, smoothing and runs the weighted form by full poses has one
    value in eleven beyond three deviations.
    """
    how = How(weighting, SignalSettings())
    found = estimated(range(1024, 1032), 1e-4, how)
    for name in ("fidim_full", "fidim_free"):
        z = np.array(
            [(one[name].values - truth) / one[name].std for one, truth in found if name in one]
        )
        assert len(z) >= 6
        assert (np.abs(z) > 3.0).mean() < 0.03, f"{name}: {np.round(z, 1)}"
        assert np.sqrt(np.mean(z**2)) > 0.4, f"{name}: {np.round(z, 1)}: deviations far too wide"


@pytest.mark.slow
def test_published_deviations_alone_do_not(sessions) -> None:
    """Without what the shares hold the same solutions are many deviations off."""
    stds = np.array([one.extra["published_std"] for one, _ in sessions])
    z = np.array([one.values - truth for one, truth in sessions]) / stds
    assert (np.abs(z) > 5.0).any(axis=1).sum() >= 2, f"{np.round(np.abs(z).max(axis=1), 1)}"


def test_bias_of_uneven_noise_is_foreseen() -> None:
    """A column ten times as noisy as the others: the mean of 200 draws, by the first of them."""
    rng = np.random.default_rng(3)
    exact = rng.standard_normal((300, 2, 10))
    exact[..., 0] -= exact @ np.append(1.0, TRUE_INERTIA)
    std = np.full(10, 0.01)
    std[3] = 0.3
    answers = np.broadcast_to(np.eye(10)[:, None, :], (300, 10, 2, 10)) * 1.0
    noisy = SimpleNamespace(
        answers=answers, covariances=np.broadcast_to(np.diag(std**2), (300, 10, 10))
    )
    off, foreseen = [], []
    for _ in range(200):
        noisy.W = exact + std * rng.standard_normal((300, 1, 10))
        stack = Stack([noisy.W], ALL)
        off.append(stack.values[:9] - TRUE_INERTIA)
        foreseen.append(noise_bias([noisy], stack).changes[0, :9])
    mean, said = np.mean(off, axis=0), np.mean(foreseen, axis=0)
    assert abs(mean[2]) > 10.0 * np.std(off, axis=0)[2] / np.sqrt(200), f"{mean}: no bias"
    assert said[2] == pytest.approx(mean[2], rel=0.15), f"{said} {mean}"


def test_even_noise_has_no_bias() -> None:
    rng = np.random.default_rng(4)
    exact = rng.standard_normal((300, 2, 10))
    exact[..., 0] -= exact @ np.append(1.0, TRUE_INERTIA)
    answers = np.broadcast_to(np.eye(20).reshape(20, 2, 10), (300, 20, 2, 10))
    noisy = SimpleNamespace(
        W=exact + 0.05 * rng.standard_normal(exact.shape),
        answers=answers,
        covariances=np.broadcast_to(0.05**2 * np.eye(20), (300, 20, 20)),
    )
    assert np.abs(noise_bias([noisy], Stack([noisy.W], ALL)).changes).max() < 1e-12
    noisy.covariances = np.zeros((300, 20, 20))
    assert (noise_bias([noisy], Stack([noisy.W], ALL)).changes == 0.0).all()


@pytest.mark.parametrize("full", [True, False])
@pytest.mark.parametrize("settings", [SignalSettings(processing="authors"), SignalSettings()])
def test_bias_of_smoothing_is_foreseen(full: bool, settings: SignalSettings) -> None:
    """Swings without noise: what the solution is off by is smoothing's, lagging derivatives too."""
    model = paper_model()
    runs = [recorded(swing(k), f"s{k}", coordinates=POSE_COORDINATES) for k in (3, 5, 8, 11)]
    chosen = usable(prepare_runs(runs, model, settings), full, None)
    stack = Stack([regressor(model, motion_of(run, full)) for run in chosen], ALL)
    off = stack.values[:9] - TRUE_INERTIA
    scatter = total_least_squares(np.concatenate(stack.rows)).std
    said = smoothing_bias(model, chosen, full, settings, stack, scatter).changes[0, :9]
    assert np.linalg.norm(said - off) < 0.5 * np.linalg.norm(off), f"{said} {off}"


def test_an_inertia_whose_swings_cannot_be_followed_is_refused(monkeypatch) -> None:
    model = paper_model()
    runs = [recorded(swing(k), f"s{k}", coordinates=POSE_COORDINATES) for k in (3, 5, 8)]
    prepared = prepare_runs(runs, model, SignalSettings())
    chosen = usable(prepared, True, None)
    stack = Stack([regressor(model, motion_of(run, True)) for run in chosen], ALL)

    def stuck(*_):
        raise ValueError("cannot be followed beyond 0.1 s")

    monkeypatch.setattr(bias, "simulate", stuck)
    with pytest.raises(ValueError, match=r"no free swings .*beyond 0.1 s.*larger swings"):
        smoothing_bias(model, chosen, True, SignalSettings(), stack, np.ones(9))
    how = How(settings=SignalSettings())
    _, found, failures = fidim_estimates(model, prepared, how, None)
    assert found == {}
    assert set(failures) == {"fidim_full", "fidim_free"}


def test_lengths_count_by_their_stated_deviation_and_1_mm_without() -> None:
    model = paper_model()
    runs = [recorded(swing(k), f"s{k}", coordinates=POSE_COORDINATES) for k in (3, 5, 8)]

    def size(**changes) -> float:
        told = [replace(run, **changes) for run in runs]
        chosen = usable(prepare_runs(told, model, SignalSettings()), False, None)
        stack = Stack([regressor(model, motion_of(run, False)) for run in chosen], ALL)
        share = length_share(model, chosen, stack)
        return 0.0 if share is None else float(np.sqrt(share.covariance[2, 2]))

    one = size(lengths_std_m=1e-4)
    assert size(lengths_std_m=2e-4) == pytest.approx(2.0 * one, rel=0.1)
    assert size(lengths_std_m=None) == pytest.approx(10.0 * one, rel=0.3)
    assert size(lengths_m=None) == 0.0


@pytest.mark.parametrize(("size", "said"), [(0.9, False), (-1.1, True)])
def test_errors_larger_than_the_scatter_are_said(size: float, said: bool) -> None:
    share = Share("smoothing", "smoothing_bias", size * np.eye(9)[1:2], is_bias=True)
    sentence = shares_sentence([share], np.ones(9))
    assert ("smoothing: com_y_m by -1.1, 1.1 times it" in sentence) == said, sentence
