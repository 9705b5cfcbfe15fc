"""How far FIDIM's solution lies beside the truth for reasons that more samples do not cure.

Two are foreseen from the estimate itself. Noise reaches the regressor's columns unevenly, and
enters their squares; total least squares is right where all columns and equations have the same.
And smoothing takes a little of the swing away with the noise. Neither is taken off the published
solution; its standard deviations hold both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.free_motion import admissible_rates, coordinate_indices
from freeswing.cdpr.model.regressor import SwingMotion, regressor
from freeswing.cdpr.robot import Array
from freeswing.cdpr.simulation.free_swing import simulate
from freeswing.ident.fidim.shares import Share, Stack
from freeswing.ident.fidim.weighted_least_squares import NoisyRegressor
from freeswing.ident.signals.derivatives import SignalSettings, signals_of
from freeswing.ident.signals.motions import free_motion, full_motion
from freeswing.ident.signals.prepare import PreparedRun, motion_of, signals_used


def noise_bias(noisy: Sequence[NoisyRegressor], stack: Stack) -> Share:
    """The share of the noise's own squares in the normal equations, to first order.

    Its shape is what the samples' covariances and the smoother make of it, its size what the
    solution leaves of the equations.

    Args:
        noisy: the runs' regressors with their answers to the signals.
        stack: the same, and their solution.

    Source:
        Van Huffel, Vandewalle 1991, The Total Least Squares Problem, sec. 8.4: errors of unequal
        covariance; Stewart, Sun 1990, Matrix Perturbation Theory, sec. V.2.
    """
    normal, noise = np.zeros((10, 10)), np.zeros((10, 10))
    for run in noisy:
        rows = run.W.reshape(-1, 10)
        normal += rows.T @ rows
        spread = np.einsum("njk,nkec->njec", run.covariances, run.answers, optimize=True)
        noise += np.einsum("njec,njed->cd", run.answers, spread, optimize=True)
    kept = np.flatnonzero(stack.kept)
    alone = np.ix_(kept, kept)
    moved = [
        _pulled(normal, noise, stack.values[:9]),
        _pulled(normal[alone], noise[alone], stack.values[9:]),
    ]
    return Share(
        'noise that the regressor\'s columns do not share alike (weighting = "covariance" takes '
        "it off)",
        "noise_bias",
        np.concatenate(moved)[None],
        is_bias=True,
    )


def _pulled(normal: Array, noise: Array, values: Array) -> Array:
    """Values (p,) less those without the noise, whose normal equations' share is `noise`."""
    chi = np.append(1.0, values)
    left, size = chi @ normal @ chi, chi @ noise @ chi
    if not size > 0.0:  # samples that state no noise
        return np.zeros(len(values))
    even = left / (chi @ chi) * np.eye(len(chi))
    # Rank is whole, or there were no values: what total least squares leaves is positive definite.
    score = (normal - left / size * noise) @ chi
    return np.linalg.solve((normal - even)[1:, 1:], score[1:])


def smoothing_bias(
    model: Model, runs: Sequence[PreparedRun], full: bool, settings: SignalSettings, stack: Stack
) -> Share:
    """The share of smoothing: the estimate's own swings, without noise, smoothed and solved alike.

    Args:
        model: the robot.
        runs: those FIDIM was solved for.
        full: by full poses, or by free coordinates alone.
        settings: how samples became signals.
        stack: the runs' regressors.

    Raises:
        ValueError: when the estimate has no free swing that begins as a run does, with the reason.

    Source:
        Efron, Tibshirani 1993, An Introduction to the Bootstrap, sec. 10.2: the bias of the
        parametric bootstrap, here of its noise-free draw.
    """
    followed, why = [], ""
    for run in runs:
        try:
            followed.append(_own_swing(model, run, full, settings, stack.values[:9]))
        except (ValueError, np.linalg.LinAlgError) as error:
            why = str(error)
    try:
        change = stack.alone([regressor(model, motion) for motion in followed])
    except ValueError as error:
        raise ValueError(
            f"no free swings of its inertia begin as the runs do ({why or error}): it is none of "
            "this platform; record larger swings, or more of them"
        ) from error
    return Share("smoothing", "smoothing_bias", change[None], is_bias=True)


def _own_swing(
    model: Model, run: PreparedRun, full: bool, settings: SignalSettings, inertia: Array
) -> SwingMotion:
    """The free swing of an inertia through a run's first state, sampled and smoothed as the run."""
    motion, signals, recorded = motion_of(run, full), signals_used(run, full), run.run.trajectory
    start, rates = motion.zetas[0], motion.rates[0]
    if full:
        rates = admissible_rates(model, start, rates, inertia)
    first, last = signals.window_s
    known = (
        recorded.is_known & (recorded.times_s >= first - 1e-9) & (recorded.times_s <= last + 1e-9)
    )
    times = recorded.times_s[known]
    begin, lead = float(times[0]), float(motion.times_s[0] - times[0])
    if lead > 0.0:  # what swings without losses swings the same way backwards
        back = simulate(model, start, -rates, (0.0, lead), inertia)
        start, rates = back.at(np.array([lead]))[0][0], -back.at(np.array([lead]))[1][0]
    swing = simulate(model, start, rates, (begin, float(times[-1])), inertia)
    zetas, _, _ = swing.at(times)
    values = np.full(recorded.values.shape, np.nan)
    values[known] = zetas[:, coordinate_indices(recorded.coordinates)]
    again = replace(run.run, trajectory=replace(recorded, values=values), window_s=signals.window_s)
    smoothed = signals_of(again, replace(settings, pass_hz=signals.pass_hz))
    if full:
        return full_motion(model, smoothed, motion.free)
    near, _, _ = swing.at(smoothed.times_s[:1])
    return free_motion(model, smoothed.select(motion.free), motion.lengths_m, near[0])
