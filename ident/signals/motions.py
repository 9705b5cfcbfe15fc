"""Signals to motions, by full poses or by free coordinates alone (FIDIM 2022, sec. 3.1, 5.2)."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.free_motion import assemble, free_basis
from freeswing.cdpr.model.regressor import SwingMotion
from freeswing.cdpr.robot import Array
from freeswing.ident.signals.constant_lengths import mean_lengths
from freeswing.ident.signals.derivatives import Signals, UnusableRunError

STEEPEST_THETA_RAD = np.deg2rad(80.0)


def full_motion(
    model: Model, signals: Signals, free: tuple[str, ...], lengths_m: Array | None = None
) -> SwingMotion:
    """The motion as measured by full poses (sec. 5.2, eq. 47).

    Args:
        model: the robot.
        signals: of all six pose coordinates.
        free: the free coordinates that the equations are projected on.
        lengths_m: cable lengths, None for the run's own.

    Raises:
        UnusableRunError: when a cable's length varies or theta comes near 90 degrees.
    """
    own = mean_lengths(model, signals)
    steepest = float(np.abs(signals.values[:, 4]).max())
    if steepest > STEEPEST_THETA_RAD:
        raise UnusableRunError(
            f"theta reaches {np.rad2deg(steepest):.0f} degrees, "
            f"{np.rad2deg(STEEPEST_THETA_RAD):.0f} is the limit of these angles: turn the base or "
            "platform frame"
        )
    return SwingMotion(
        signals.run,
        free,
        signals.times_s,
        signals.values,
        signals.velocities,
        signals.accelerations,
        own if lengths_m is None else lengths_m,
    )


def free_motion(
    model: Model, signals: Signals, lengths_m: Array, start: Array, exact: bool = True
) -> SwingMotion:
    """The motion that follows from the free coordinates and the lengths (eqs. 44, 45).

    Args:
        model: the robot.
        signals: of the 6 - n free coordinates.
        lengths_m: cable lengths, (n_cables,).
        start: a pose near the first sample, (6,).
        exact: False takes `start` for the poses (n, 6) themselves, without solving.

    Raises:
        UnusableRunError: when the poses cannot be found, with the sample.
    """
    free, values = signals.coordinates, model.start_values
    zetas = _assembled(model, signals, lengths_m, start) if exact else start
    speeds, seconds = signals.velocities[..., None], signals.accelerations[..., None]
    follow = free_basis(model, free, zetas, np.zeros_like(zetas), values).zeta_map
    rates = (follow @ speeds)[..., 0]
    basis = free_basis(model, free, zetas, rates, values)
    accelerations = (basis.zeta_map_rate @ speeds + basis.zeta_map @ seconds)[..., 0]
    return SwingMotion(
        signals.run, free, signals.times_s, zetas, rates, accelerations, np.asarray(lengths_m)
    )


def _assembled(model: Model, signals: Signals, lengths_m: Array, start: Array) -> Array:
    """Poses by (44); where decimated samples lie too far apart for Newton, in smaller steps."""
    values, failure = signals.values, ""
    for steps in (1, 8):
        places = np.arange(steps * (len(values) - 1) + 1) / steps
        path = np.column_stack([np.interp(places, np.arange(len(values)), v) for v in values.T])
        try:
            found = assemble(model, signals.coordinates, lengths_m, path, start)
        except (ValueError, np.linalg.LinAlgError) as error:
            failure = failure or str(error)
        else:
            return found.zetas[::steps]
    raise UnusableRunError(failure)


def lowest_tension(model: Model, motion: SwingMotion, inertia: Array) -> tuple[float, str]:
    """Smallest specific tension tau / m along a motion, m/s^2, and the cable that has it."""
    arguments = (0.0 * motion.times_s, motion.zetas, motion.rates, inertia, model.start_values)
    tensions = evaluate(model.acceleration, *arguments)[1]
    # A single smoothed sample may dip below zero by noise alone: slack lasts.
    lowest = np.quantile(tensions, 0.02, axis=0)
    cable = int(np.argmin(lowest))
    return float(lowest[cable]), model.robot.cables[cable].name
