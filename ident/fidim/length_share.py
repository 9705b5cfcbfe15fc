"""What errors of stated cable lengths do to FIDIM by free coordinates.

Poses follow from the free coordinates and the lengths (FIDIM 2022, eq. 44): a length that is off
puts all poses of its run off alike. Maximum likelihood has the lengths among its unknowns; FIDIM
takes them as exact, and no scatter of its equations tells.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.regressor import regressor
from freeswing.ident.fidim.shares import Share, Stack
from freeswing.ident.likelihood.samples_and_noise import length_std
from freeswing.ident.signals.motions import free_motion
from freeswing.ident.signals.usable_runs import PreparedRun, motion_of, signals_used


def length_share(model: Model, runs: Sequence[PreparedRun], stack: Stack) -> Share | None:
    """The share of lengths known to their stated deviation; None where all come from the poses.

    Every run and every cable is a cause of its own.

    Args:
        model: the robot.
        runs: those FIDIM was solved for, by free coordinates.
        stack: their regressors.

    Raises:
        ValueError: when no pose fits lengths that are off by their deviation, with the sample.

    Source:
        JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, eq. (10).
    """
    changes = []
    for k, run in enumerate(runs):
        if run.run.lengths_m is None:
            continue
        motion, signals = motion_of(run, False), signals_used(run, False)
        for off in length_std(run.run) * np.eye(model.robot.n_cables):
            moved = free_motion(model, signals, motion.lengths_m + off, motion.zetas[0])
            changes.append(stack.change({k: regressor(model, moved)}))
    if not changes:
        return None
    return Share("errors of stated cable lengths", "lengths_std", np.array(changes))
