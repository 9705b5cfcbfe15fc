"""What cable ends that are known only so well do to FIDIM.

A robot.toml may state how well entry and attachment points are known. Maximum likelihood then has
them among its unknowns; FIDIM takes the declared places as exact, for all runs alike, so that no
scatter of its equations tells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.regressor import SwingMotion, regressor
from freeswing.cdpr.robot import Array
from freeswing.ident.fidim.shares import Share, Stack
from freeswing.ident.signals.constant_lengths import mean_lengths
from freeswing.ident.signals.motions import free_motion
from freeswing.ident.signals.usable_runs import PreparedRun, motion_of, signals_used


def ends_share(model: Model, runs: Sequence[PreparedRun], full: bool, stack: Stack) -> Share:
    """The share of cable ends, each coordinate a cause of its own.

    Args:
        model: the robot with its cable ends as values of known spread.
        runs: those FIDIM was solved for.
        full: by full poses, or by free coordinates alone.
        stack: their regressors.

    Raises:
        ValueError: when no pose fits ends that are off by their deviation, with the sample.

    Source:
        JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, eq. (10).
    """
    changes = _changes(model, runs, full, stack)
    return Share("cable ends known to their tolerances", "tolerances_std", changes)


def geometry_share(
    model: Model, size: float, runs: Sequence[PreparedRun], full: bool, stack: Stack
) -> Share:
    """The share of cables' geometry that is so many times its tolerances off, each value a cause.

    Args:
        model: the robot with cables' geometry as values of known spread.
        size: how many times that.
        runs: those FIDIM was solved for.
        full: by full poses, or by free coordinates alone.
        stack: their regressors.

    Raises:
        ValueError: when no pose fits geometry that is off by its tolerance, with the sample.

    Source:
        JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, eq. (10): to first
        order.
    """
    name = "geometry as wrong as residuals of the motions ask for"
    return Share(name, "geometry_std", size * _changes(model, runs, full, stack))


def missing_share(changes: Array, stack: Stack) -> Share:
    """The share of forces that the motions lack.

    A force moves FIDIM's solution about as far as it moves that of maximum likelihood, which knows
    the same equations along the same motions.

    Args:
        changes: what each does to the nine parameters, (k, 9).
        stack: the runs' regressors.
    """
    essential = changes[:, stack.kept[1:]]
    name = "forces that the motions lack, as residuals ask for them"
    return Share(name, "forces_std", np.hstack([changes, essential]))


def _changes(model: Model, runs: Sequence[PreparedRun], full: bool, stack: Stack) -> Array:
    """What each value does, off by its deviation, to the solution, (k, 9 + e)."""
    changes = []
    for k, parameter in enumerate(model.parameters):
        off = list(model.parameters)
        off[k] = replace(parameter, start=parameter.prior_std)
        moved = replace(model, parameters=tuple(off))
        motions = {place: _seen(moved, run, full) for place, run in enumerate(runs)}
        changes.append(stack.change({k: regressor(moved, one) for k, one in motions.items()}))
    return np.array(changes)


def _seen(model: Model, run: PreparedRun, full: bool) -> SwingMotion:
    """A run's motion as it would have been understood with cables that end elsewhere."""
    motion = motion_of(run, full)
    if full:
        return motion
    lengths = motion.lengths_m
    if run.run.lengths_m is None:
        lengths = mean_lengths(model, run.signals)
    return free_motion(model, signals_used(run, full), lengths, motion.zetas[0])
