"""What the calibration's errors do to FIDIM: every mode carried through to the solution.

Total least squares knows the noise of single samples alone. Here the recorded motion is moved by
one standard deviation of each mode (`cdpr.measured.pose_errors`), with its derivatives, and the
problem solved again: the changes of the solution add up to a covariance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.free_motion import coordinate_indices
from freeswing.cdpr.model.regressor import SwingMotion, regressor
from freeswing.cdpr.robot import Array
from freeswing.ident.fidim.shares import Share, Stack
from freeswing.ident.likelihood.calibration_modes import mode_shifts
from freeswing.ident.signals.motions import free_motion
from freeswing.ident.signals.usable_runs import PreparedRun, motion_of, signals_used


def calibration_share(
    model: Model, runs: Sequence[PreparedRun], full: bool, stack: Stack
) -> Share | None:
    """The share of the runs' calibration errors; None where none of them has any.

    Args:
        model: the robot.
        runs: those FIDIM was solved for.
        full: by full poses, or by free coordinates alone.
        stack: their regressors.
    """
    errors = [run.run.pose_errors for run in runs]
    counts = [len(one.modes) for one in errors if one is not None]
    if not counts:
        return None
    shifts = [_shifts(run, full, max(counts)) for run in runs]
    changes = [
        stack.change(
            {
                k: regressor(model, _moved(model, run, full, own[:, :, mode]))
                for k, (run, own) in enumerate(zip(runs, shifts, strict=True))
            }
        )
        for mode in range(max(counts))
    ]
    return Share("the calibration's errors", "calibration_std", np.array(changes))


def _shifts(run: PreparedRun, full: bool, count: int) -> Array:
    """Changes of the pose along a run's motion by each mode, (n, 6, r)."""
    motion, errors = motion_of(run, full), run.run.pose_errors
    if errors is None:
        return np.zeros((len(motion.zetas), 6, count))
    return mode_shifts(motion.zetas, motion.rates, errors)


def _moved(model: Model, run: PreparedRun, full: bool, shift: Array) -> SwingMotion:
    """A run's motion with its poses changed by a shift, (n, 6)."""
    motion = motion_of(run, full)
    slope = np.gradient(shift, motion.times_s, axis=0)
    curve = np.gradient(slope, motion.times_s, axis=0)
    if full:
        return replace(
            motion,
            zetas=motion.zetas + shift,
            rates=motion.rates + slope,
            accelerations=motion.accelerations + curve,
        )
    columns = coordinate_indices(motion.free)
    signals = signals_used(run, full)
    signals = replace(
        signals,
        values=signals.values + shift[:, columns],
        velocities=signals.velocities + slope[:, columns],
        accelerations=signals.accelerations + curve[:, columns],
    )
    lengths = run.lengths_m
    if run.run.lengths_m is None:
        by_pose = evaluate(model.cables, motion.zetas, model.start_values)[3]
        lengths = lengths + np.mean((by_pose @ shift[..., None])[..., 0], axis=0)
    return free_motion(model, signals, lengths, motion.zetas[0])
