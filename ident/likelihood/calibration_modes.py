"""The calibration's errors as unknowns of the likelihood, known beforehand to be small.

A calibration that is a little wrong moves all poses of all runs together, by modes of known size
(`cdpr.measured.pose_errors`). Left out, they end up in the inertia, and no residual says so. Here
each mode has an amplitude, one for all runs, with a standard normal prior: samples = motion + modes
a + noise. What the swings themselves tell of the amplitudes is used, and the rest widens the
covariance. An inertia found so belongs to samples without the errors: `freed` gives those of runs
that were not fitted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from freeswing.cdpr.measured.pose_errors import PoseErrors
from freeswing.cdpr.robot import Array
from freeswing.cdpr.rotation import angle_rate_matrix, matrix_from_angles
from freeswing.cdpr.simulation.free_swing import Motion
from freeswing.cdpr.simulation.sensitivity import linearise
from freeswing.cdpr.system.threads import side_by_side
from freeswing.ident.likelihood.blocks import state_of
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_swings import FreeSwing, LikelihoodFit
from freeswing.ident.likelihood.joint_problem import Problem
from freeswing.ident.likelihood.run_residuals import Samples, reduce_run
from freeswing.ident.runs import SwingRun

ROUNDS = 3
MODES = "camera modes"
CONVERGED = 0.02  # of a standard deviation of the amplitudes
UNLIKELY = 4.5  # deviations: seven in a million by chance, for each of some tens of modes


@dataclass(frozen=True, slots=True)
class Calibrated:
    """A fit with the calibration's errors among its unknowns.

    Attributes:
        fit: to the samples without the errors found; its covariance holds what is left of them.
        amplitudes: of the modes, in standard deviations of the calibration, (r,).
        std: their standard deviations after the fit, (r,).
    """

    fit: LikelihoodFit
    amplitudes: Array
    std: Array

    def document(self) -> dict[str, Any]:
        """For the estimate's entry in the result file; empty where nothing was known."""
        if not len(self.amplitudes):
            return {}
        modes = {"amplitudes": self.amplitudes.tolist(), "std": self.std.tolist()}
        return {"calibration_modes": modes}

    def notes(self) -> tuple[str, ...]:
        """What a reader should know."""
        largest = float(np.abs(self.amplitudes).max(initial=0.0))
        if largest <= UNLIKELY:
            return ()
        return (
            f"the swings ask for errors of all poses together of {largest:.1f} standard deviations "
            f"(more than {UNLIKELY:g} is unlikely): the cameras' calibration, the base tags' "
            "survey, tags' or markers' places on the platform or the robot's geometry may be off",
        )


def with_calibration(found: LikelihoodFit, consistent: bool = False) -> Calibrated:
    """Goes on from a fit with the amplitudes of the calibration's errors as further unknowns.

    Args:
        found: converged; its samples state the errors and may be free of some already.
        consistent: hold the inertia to what a body can have.

    Raises:
        ValueError: when the runs' errors have different numbers of modes, or a refit breaks down.
    """
    amplitudes = amplitudes_of(found.samples)
    if not len(amplitudes) or found.rank < int(found.free.sum()):
        return Calibrated(found, np.zeros(0), np.zeros(0))
    current = found
    for _ in range(ROUNDS):
        step = _solved(current).step
        swings = replace(current.swings, samples=freed_samples(current, step))
        current = fit(swings, current.unknowns, FreeSwing(grow=False, consistent=consistent))
        if np.abs(step).max() < CONVERGED:
            break
    joint = _solved(current)
    amplitudes = amplitudes_of(current.samples)
    return Calibrated(replace(current, covariance=joint.shared), amplitudes, joint.spread)


def amplitudes_of(samples: Sequence[Samples]) -> Array:
    """What is taken out of some runs' poses of the errors that they share, (r,).

    Raises:
        ValueError: when the runs' errors have different numbers of modes.
    """
    counts = {len(run.errors.modes) for run in samples if run.errors is not None}
    if len(counts) > 1:
        raise ValueError(
            f"calibration errors with {sorted(counts)} modes: all runs must come from one tracking"
        )
    known = next((run.freed for run in samples if run.freed is not None), None)
    return np.zeros(counts.pop() if counts else 0) if known is None else known


def freed_samples(found: LikelihoodFit, step: Array) -> tuple[Samples, ...]:
    """A fit's samples with so much more of the errors that they share taken out.

    Args:
        found: the fit, at whose motions the errors are taken.
        step: of the amplitudes, (r,).
    """
    amplitudes = amplitudes_of(found.samples) + step
    return tuple(
        replace(
            run,
            values=run.values - motion_shifts(motion, run, len(step))[:, run.columns] @ step,
            freed=amplitudes,
        )
        for motion, run in zip(found.motions, found.samples, strict=True)
    )


def freed(run: SwingRun, amplitudes: Array) -> SwingRun:
    """A run without the calibration's errors that a fit of others found.

    The modes are taken at the measured poses and at the slopes between them: errors of a tenth of
    a millimetre change little with either. A run that states no errors, or whose full poses were
    not measured, stays as it is.

    Args:
        run: as recorded.
        amplitudes: of its modes, `Calibrated.amplitudes`, (r,); (0,) where none were fitted.

    Raises:
        ValueError: when the run has another number of modes.
    """
    errors, trajectory = run.pose_errors, run.trajectory
    known = trajectory.is_known
    if errors is None or not len(amplitudes) or not trajectory.is_pose or known.sum() < 2:
        return run
    if len(errors.modes) != len(amplitudes):
        raise ValueError(
            f"run {run.name}: {len(errors.modes)} calibration errors, {len(amplitudes)} in the "
            "fitted runs: all runs must come from one tracking; track again"
        )
    zetas = trajectory.values[known]
    rates = np.gradient(zetas, trajectory.times_s[known], axis=0)
    values = trajectory.values.copy()
    values[known] -= mode_shifts(zetas, rates, errors) @ amplitudes
    return replace(run, trajectory=replace(trajectory, values=values))


def mode_shifts(zetas: Array, rates: Array, errors: PoseErrors) -> Array:
    """What one standard deviation of each mode adds to poses (n, 6) with rates, (n, 6, r).

    Source:
        JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, eq. (13):
        propagation.
    """
    turn = angle_rate_matrix(zetas[:, 3:])
    omega = (turn @ rates[:, 3:, None])[..., 0]
    velocities = np.concatenate([rates[:, :3], omega], axis=1)
    shifts = errors.at(zetas[:, :3], matrix_from_angles(zetas[:, 3:]), velocities)
    shifts[:, 3:] = np.linalg.solve(turn, shifts[:, 3:])
    return shifts


def motion_shifts(motion: Motion, samples: Samples, count: int) -> Array:
    """`mode_shifts` at the samples of a motion, (n, 6, r): none where a run states no errors.

    Args:
        motion: of the run.
        samples: its.
        count: of the modes, r.

    Source:
        JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, eq. (13):
        propagation.
    """
    if samples.errors is None:
        return np.zeros((len(samples.times_s), 6, count))
    zetas, rates, _ = motion.at(samples.times_s)
    return mode_shifts(zetas, rates, samples.errors)


@dataclass(frozen=True, slots=True)
class _Joint:
    """Amplitudes beside all other shared unknowns, to first order.

    Attributes:
        step: change of the amplitudes, (r,).
        spread: their standard deviations, (r,).
        shared: covariance of the others, (p, p).
    """

    step: Array
    spread: Array
    shared: Array


def _solved(current: LikelihoodFit) -> _Joint:
    """All runs, the priors, and amplitudes of unit deviation about zero.

    Coloured residuals say less than their number: the samples count by `correlation`.
    """
    problem = Problem(current.model, current.samples, current.free)
    amplitudes = amplitudes_of(current.samples)
    n_modes, n_shared = len(amplitudes), problem.layout.size
    layout = problem.layout.joined(MODES, n_modes)
    state = state_of(current.unknowns, current.model, current.scales)
    weight = 1.0 / np.sqrt(current.enlargement)

    def reduced(motion: Motion, run: Samples) -> Array:
        linear = linearise(motion, wanted=problem.wanted)
        return reduce_run(linear, run, current.scales, motion_shifts(motion, run, n_modes)).rows

    rows = []
    for found in side_by_side(reduced, current.motions, current.samples):
        shared = problem.shared_map(len(rows), state)
        by_shared = found[:-1, : len(shared)] @ shared
        rows.append(weight * np.hstack([by_shared, found[:-1, len(shared) :]]))
    prior = problem.prior_rows(state)
    rows.append(np.hstack([prior[:, :-1], np.zeros((len(prior), n_modes)), prior[:, -1:]]))
    rows.append(np.hstack([np.zeros((n_modes, n_shared)), np.eye(n_modes), amplitudes[:, None]]))
    kept = np.concatenate([problem.free, np.ones(n_modes, dtype=bool)])
    unit = np.concatenate([problem.unit, np.ones(n_modes)])[kept]
    stacked = np.vstack(rows)
    matrix, right = stacked[:, :-1][:, kept] * unit, stacked[:, -1]
    Q, R = np.linalg.qr(matrix)
    inverse = np.linalg.inv(R) * unit[:, None]
    covariance = np.zeros((layout.size, layout.size))
    covariance[np.ix_(kept, kept)] = inverse @ inverse.T
    step = np.zeros(layout.size)
    step[kept] = -inverse @ (Q.T @ right)
    modes = layout.place(MODES)
    spread = np.sqrt(np.diag(covariance)[modes])
    return _Joint(step[modes], spread, covariance[:n_shared, :n_shared])
