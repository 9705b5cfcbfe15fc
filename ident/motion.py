"""Signals to regressors, by full poses or by free coordinates alone (FIDIM 2022, sec. 3.1, 5.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr.batch import evaluate
from cdpr.dynamics import body_regressor, internal_regressor, twist_of
from cdpr.free_motion import assemble, free_basis
from cdpr.model import Model
from cdpr.robot import Array
from cdpr.rotation import matrix_from_angles
from ident.frozen import freeze
from ident.signals import Signals, UnusableRunError

LENGTH_LIMIT_M = 0.005
STEEPEST_THETA_RAD = np.deg2rad(80.0)


@dataclass(frozen=True, slots=True)
class SwingMotion:
    """The platform's motion along a run, as far as the regressor needs it.

    Attributes:
        run: its name.
        free: names of the free coordinates.
        times_s: (n,).
        zetas: pose coordinates, (n, 6).
        rates: (n, 6).
        accelerations: (n, 6).
        lengths_m: cable lengths held, (n_cables,).
    """

    run: str
    free: tuple[str, ...]
    times_s: Array
    zetas: Array
    rates: Array
    accelerations: Array
    lengths_m: Array

    def __post_init__(self) -> None:
        freeze(self, "times_s", "zetas", "rates", "accelerations", "lengths_m")


def mean_lengths(model: Model, signals: Signals) -> Array:
    """A run's own cable lengths: the mean of those of its poses, (n_cables,).

    Raises:
        UnusableRunError: when a length does not stay constant, with the cable and by how much.
    """
    lengths = evaluate(model.lengths, signals.values, model.start_values)[0]
    mean = lengths.mean(axis=0)
    off = np.abs(lengths - mean).max(axis=0)
    worst = int(np.argmax(off))
    if not off[worst] <= LENGTH_LIMIT_M:
        raise UnusableRunError(
            f"cable {model.robot.cables[worst].name} is off its mean length by up to "
            f"{1e3 * off[worst]:.1f} mm (limit {1e3 * LENGTH_LIMIT_M:g} mm): slack, or its winch "
            "was not locked"
        )
    return mean


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


def regressor(model: Model, motion: SwingMotion) -> Array:
    """W'_EE along a motion (eqs. 19-22), (n, 6 - n_cables, 10)."""
    zetas, rates, accelerations = motion.zetas, motion.rates, motion.accelerations
    turn, turn_rate = evaluate(model.twist_map, zetas, rates)
    twist, twist_rate = twist_of(turn, turn_rate, rates, accelerations)
    body = body_regressor(
        matrix_from_angles(zetas[:, 3:]),
        twist_rate[:, :3],
        twist[:, 3:],
        twist_rate[:, 3:],
        model.robot.gravity_m_s2,
    )
    basis = free_basis(model, motion.free, zetas, rates, model.start_values)
    return internal_regressor(body, basis.xi_perp)


def lowest_tension(model: Model, motion: SwingMotion, inertia: Array) -> tuple[float, str]:
    """Smallest specific tension tau / m along a motion, m/s^2, and the cable that has it."""
    arguments = (0.0 * motion.times_s, motion.zetas, motion.rates, inertia, model.start_values)
    tensions = evaluate(model.acceleration, *arguments)[1]
    # A single smoothed sample may dip below zero by noise alone: slack lasts.
    lowest = np.quantile(tensions, 0.02, axis=0)
    cable = int(np.argmin(lowest))
    return float(lowest[cable]), model.robot.cables[cable].name
