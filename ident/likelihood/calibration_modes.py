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
from freeswing.ident.likelihood.blocks import MODES, free_of, state_of
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_swings import (
    FreeSwing,
    LikelihoodFit,
    Swings,
    correlation_factor,
)
from freeswing.ident.likelihood.joint_problem import Problem
from freeswing.ident.likelihood.run_residuals import Samples, reduce_run
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown, Unknowns
from freeswing.ident.runs import SwingRun
from freeswing.ident.signals.residual_colour import enlargement

ROUNDS = 3
CONVERGED = 0.02  # of a standard deviation of the amplitudes
UNLIKELY = 4.5  # deviations: seven in a million by chance, for each of some tens of modes


@dataclass(frozen=True, slots=True)
class BesideModes:
    """How to fit free swings with camera modes among the unknowns: the two by turns.

    The motions of a fit never know of the modes: their amplitudes are solved beside a fit that
    stands, with all other unknowns to first order, and taken out of its samples.

    Attributes:
        consistent: hold the inertia, of which all is then free, to what a body can have.
    """

    consistent: bool = False

    def fitted(self, swings: Swings, unknowns: Unknowns) -> LikelihoodFit:
        """All unknowns; the modes stand last in the covariance, which holds what is left of them.

        Args:
            swings: with the motions of a fit; their samples may be free of some errors already,
                by the amplitudes where the block starts.
            unknowns: those of that fit, and `modes_block` of the samples.

        Raises:
            ValueError: when the modes are not those of the samples, no motions are given, or a
                refit breaks down.
        """
        _refuse_other_modes(swings, unknowns.block(MODES))
        found, step = self._turn(swings, unknowns.without(MODES))
        for _ in range(ROUNDS - 1):
            if np.abs(step).max() < CONVERGED:
                break
            found, step = self._turn(found.swings, found.unknowns)
        joint, block = _solved(found.swings, found.unknowns), modes_block(found.samples)
        return replace(
            found,
            unknowns=found.unknowns.joined(block),
            covariance=joint.covariance,
            singular_values=joint.singular_values,
            rank=found.rank + block.size,
            between=np.append(found.between, np.zeros(block.size)),
        )

    def _turn(self, swings: Swings, rest: Unknowns) -> tuple[LikelihoodFit, Array]:
        """Amplitudes beside a fit, then the fit beside these; and their change, (r,)."""
        step = _solved(swings, rest).step
        freer = replace(swings, samples=freed_samples(swings, step))
        return fit(freer, rest, FreeSwing(grow=False, consistent=self.consistent)), step


def with_calibration(found: LikelihoodFit, consistent: bool = False) -> LikelihoodFit:
    """Goes on from a fit with the amplitudes of the calibration's errors as further unknowns.

    Args:
        found: converged; its samples state the errors and may be free of some already.
        consistent: hold the inertia to what a body can have.

    Returns:
        The fit to the samples without the errors found, `MODES` among its unknowns; the fit as it
        is where nothing is known of the errors, or its own unknowns are not determined.

    Raises:
        ValueError: when the runs' errors have different numbers of modes, or a refit breaks down.
    """
    block = modes_block(found.samples)
    if not block.size or found.rank < int(found.free.sum()):
        return found
    return fit(found.swings, found.unknowns.joined(block), BesideModes(consistent))


def modes_block(samples: Sequence[Samples]) -> Unknown:
    """Amplitudes of the modes, in standard deviations of the calibration: as many as are stated.

    Raises:
        ValueError: when the runs' errors have different numbers of modes.
    """
    amplitudes = amplitudes_of(samples)
    ones = np.ones(len(amplitudes))
    prior = Gaussian(0.0 * ones, ones, "the calibration of the cameras")
    return Unknown(MODES, amplitudes, ones, prior)


def _refuse_other_modes(swings: Swings, block: Unknown) -> None:
    if not swings.motions:
        raise ValueError(f"unknown {MODES}: is fitted beside motions, and these swings have none")
    made = modes_block(swings.samples)
    if not block.is_known_as(made) or not np.array_equal(block.value, made.value):
        raise ValueError(f"unknown {MODES}: value, bounds, prior or mask are not the samples'")


def modes_document(found: LikelihoodFit) -> dict[str, Any]:
    """For the estimate's entry in the result file; empty where nothing was known."""
    if MODES not in found.unknowns:
        return {}
    modes = {"amplitudes": found.value(MODES).tolist(), "std": found.std(MODES).tolist()}
    return {"calibration_modes": modes}


def modes_notes(found: LikelihoodFit) -> tuple[str, ...]:
    """What a reader should know of the modes."""
    asked = found.value(MODES) if MODES in found.unknowns else np.zeros(0)
    largest = float(np.abs(asked).max(initial=0.0))
    if largest <= UNLIKELY:
        return ()
    return (
        f"the swings ask for errors of all poses together of {largest:.1f} standard deviations "
        f"(more than {UNLIKELY:g} is unlikely): the cameras' calibration, the base tags' "
        "survey, tags' or markers' places on the platform or the robot's geometry may be off",
    )


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


def freed_samples(swings: Swings, step: Array) -> tuple[Samples, ...]:
    """Samples with so much more of the errors that they share taken out.

    Args:
        swings: those of a fit, at whose motions the errors are taken.
        step: of the amplitudes, (r,).
    """
    amplitudes = amplitudes_of(swings.samples) + step
    return tuple(
        replace(
            run,
            values=run.values - motion_shifts(motion, run, len(step))[:, run.columns] @ step,
            freed=amplitudes,
        )
        for motion, run in zip(swings.motions, swings.samples, strict=True)
    )


def freed(run: SwingRun, amplitudes: Array) -> SwingRun:
    """A run without the calibration's errors that a fit of others found.

    The modes are taken at the measured poses and at the slopes between them: errors of a tenth of
    a millimetre change little with either. A run that states no errors, or whose full poses were
    not measured, stays as it is.

    Args:
        run: as recorded.
        amplitudes: of its modes, the value of `MODES`, (r,); (0,) where none were fitted.

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
        covariance: of the others and of the amplitudes, (p + r, p + r).
        singular_values: of the scaled triangle, descending.
    """

    step: Array
    covariance: Array
    singular_values: Array


def _solved(swings: Swings, rest: Unknowns) -> _Joint:
    """All runs, the priors, and amplitudes of unit deviation about zero.

    Coloured residuals say less than their number: the samples count by `correlation`.
    """
    model, samples, motions, scales = swings.model, swings.samples, swings.motions, swings.scales
    problem = Problem(model, samples, free_of(rest, model), known=rest.known_of(*model.effects))
    amplitudes = amplitudes_of(samples)
    n_modes, n_shared = len(amplitudes), problem.layout.size
    layout = problem.layout.joined(MODES, n_modes)
    state = state_of(rest, model, scales)
    weight = 1.0 / np.sqrt(enlargement(correlation_factor(motions, samples, scales)))

    def reduced(motion: Motion, run: Samples) -> Array:
        linear = linearise(motion, wanted=problem.wanted)
        return reduce_run(linear, run, scales, motion_shifts(motion, run, n_modes)).rows

    rows = []
    for found in side_by_side(reduced, motions, samples):
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
    return _Joint(step[layout.place(MODES)], covariance, np.linalg.svd(R, compute_uv=False))
