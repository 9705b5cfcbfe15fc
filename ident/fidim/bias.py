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
from freeswing.ident.fidim.shares import NINE, Share, Stack
from freeswing.ident.fidim.total_least_squares import least_by_noise
from freeswing.ident.fidim.weighted_least_squares import NoisyRegressor
from freeswing.ident.signals.derivatives import SignalSettings, signals_of
from freeswing.ident.signals.motions import free_motion, full_motion
from freeswing.ident.signals.usable_runs import PreparedRun, motion_of, signals_used

# A share that moves by less than half a scatter changes the deviation by a tenth.
SETTLED = 0.5
_ROUNDS = 4  # each asks one more swing of every run


def noise_bias(noisy: Sequence[NoisyRegressor], stack: Stack) -> Share:
    """The share of the noise's own squares in the normal equations.

    Its shape is what the samples' covariances and the smoother make of it, its size what the
    solution leaves of the equations: how far the solution lies from the one that takes columns
    for as noisy as they are.

    Args:
        noisy: the runs' regressors with their answers to the signals.
        stack: the same, and their solution.

    Raises:
        ValueError: when rank is lost.

    Source:
        Van Huffel, Vandewalle 1991, The Total Least Squares Problem, sec. 8.4: errors of unequal
        covariance.
    """
    noise = np.zeros((10, 10))
    for run in noisy:
        spread = np.einsum("njk,nkec->njec", run.covariances, run.answers, optimize=True)
        noise += np.einsum("njec,njed->cd", run.answers, spread, optimize=True)
    moved = np.zeros(len(stack.values))
    if noise.any():  # samples that state no noise have no share
        rows = np.concatenate(stack.factors)
        whole, _ = least_by_noise(rows, noise)
        reduced, _ = least_by_noise(rows[:, stack.kept], noise[np.ix_(stack.kept, stack.kept)])
        moved = stack.values - np.concatenate([whole, reduced])
    return Share(
        'noise that the regressor\'s columns do not share alike (weighting = "covariance" takes '
        "it off)",
        "noise_bias",
        moved[None],
        is_bias=True,
    )


def smoothing_bias(
    model: Model,
    runs: Sequence[PreparedRun],
    full: bool,
    settings: SignalSettings,
    stack: Stack,
    scatter: Array,
    noise: Array | None = None,
) -> Share:
    """The share of smoothing: swings without noise, smoothed and solved alike.

    The swings are the estimate's own. Where noise and smoothing move it by more than the scatter
    they are not quite the platform's: those of the estimate less both are nearer, and are asked in
    turn.

    Args:
        model: the robot.
        runs: those FIDIM was solved for.
        full: by full poses, or by free coordinates alone.
        settings: how samples became signals.
        stack: the runs' regressors.
        scatter: standard deviations of the nine values without it, (9,).
        noise: what noise moves the nine values by, (9,); None where it is taken off.

    Raises:
        ValueError: when the estimate has no free swing that begins as a run does, with the reason.

    Source:
        Efron, Tibshirani 1993, An Introduction to the Bootstrap, sec. 10.2: the bias of the
        parametric bootstrap, here of its noise-free draw; Gourieroux, Monfort, Renault 1993,
        Indirect Inference, sec. 2: the values whose draws give the estimate.
    """
    inertia = stack.values[NINE]
    without_noise = inertia - (0.0 if noise is None else noise)
    change = _smoothed_away(model, runs, full, settings, stack, inertia)
    before = None
    for _ in range(_ROUNDS):
        off = without_noise - change[NINE] - inertia
        size = off if before is None else change[NINE] - before[1][NINE]
        if np.abs(size / scatter).max() < SETTLED:
            break
        following = _nearer(without_noise, inertia, change[NINE], before, scatter)
        before = inertia, change
        try:
            change = _smoothed_away(model, runs, full, settings, stack, following)
        except ValueError:  # no body any more: what was found before is told
            break
        inertia = following
    return Share("smoothing", "smoothing_bias", change[None], is_bias=True)


def _nearer(
    estimate: Array,
    inertia: Array,
    change: Array,
    before: tuple[Array, Array] | None,
    scatter: Array,
) -> Array:
    """An inertia of which the estimate is nearer to what smoothing leaves, (9,).

    Source:
        Anderson 1965, Iterative Procedures for Nonlinear Integral Equations, sec. 4, of depth 1.
    """
    step = estimate - change - inertia
    if before is None:
        return inertia + step
    last = estimate - before[1][NINE] - before[0]
    turn = (step - last) / scatter
    share = float((step / scatter) @ turn / max(float(turn @ turn), 1e-300))
    return inertia + step - share * (inertia + step - before[0] - last)


def _smoothed_away(
    model: Model,
    runs: Sequence[PreparedRun],
    full: bool,
    settings: SignalSettings,
    stack: Stack,
    inertia: Array,
) -> Array:
    """What smoothing changes an inertia by, all nine and the essential ones, (9 + e,)."""
    followed, why = {}, ""
    for k, run in enumerate(runs):
        try:
            motion = _own_swing(model, run, full, settings, inertia)
        except (ValueError, np.linalg.LinAlgError) as error:
            why = str(error)
        else:
            followed[k] = regressor(model, motion)
    try:
        return stack.alone(followed) - stack.values - stack.apart(inertia)
    except ValueError as error:
        raise ValueError(
            f"no free swings of its inertia begin as the runs do ({why or error}): it is none of "
            "this platform; record larger swings, or more of them"
        ) from error


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
