"""Coulomb friction from slow ramps as the paper takes it, and what the ramp's slope costs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.ident.drive.run_problem import DriveRun, Noise, simulated, start_pose

Array = NDArray[np.float64]

# An encoder at rest between two counts shows one of them, noise of its edge the other: a motion is
# what is farther off than that.
MOVED_STEPS = 2.5
LEAST_ROWS = 20  # of a rise: fewer are an edge of a PRBS
EVEN = 1e-6  # of the whole rise: two steps of a ramp differ by less


@dataclass(frozen=True, slots=True)
class Ramp:
    """What one ramp says of its motor.

    Attributes:
        run: which.
        motor: its place.
        slope_A_s: of the reference.
        moved_s: when the encoder first told a motion; NaN where it never did.
        read_N_m: torque of the current that had come by then (the paper's f_c).
        of_estimate_N_m: the same reading of the same ramp, simulated with the estimate.
        estimate_N_m: the estimate itself.
        breakaway_s: what the ramp needs to reach it.
    """

    run: str
    motor: int
    slope_A_s: float
    moved_s: float
    read_N_m: float
    of_estimate_N_m: float
    estimate_N_m: float
    breakaway_s: float

    @property
    def slope_costs_N_m(self) -> float:
        """By how much such a ramp reads more than the friction that the estimate has."""
        return self.of_estimate_N_m - self.estimate_N_m


def ramp_of(run: DriveRun) -> tuple[int, float] | None:
    """Motor and slope in A/s of a run in which one reference alone rises evenly; None: no ramp."""
    references = run.record.references_A
    turning = np.flatnonzero(np.ptp(references, axis=0) > 0.0)
    if len(turning) != 1:
        return None
    motor = int(turning[0])
    steps = np.diff(references[:, motor])
    rising = np.flatnonzero(steps)
    even = np.ptp(steps[rising[:-1]]) <= EVEN * np.ptp(references) if len(rising) > 1 else False
    whole = len(rising) == rising[-1] - rising[0] + 1
    if not (even and whole and len(rising) >= LEAST_ROWS and steps[rising[0]] > 0.0):
        return None
    return motor, float(np.median(steps[rising]) * run.rate_hz)


def ramps(
    model: DrivenModel, theta: Array, zero: Array, noise: Noise, runs: tuple[DriveRun, ...]
) -> tuple[Ramp, ...]:
    """Every ramp among the runs, beside the estimate's own friction.

    The paper takes the current at the first motion (4.2.1). By then it has gone on rising: smoothed
    friction creeps, motors that turn along rub too, and the encoder tells whole counts. The same
    reading of the simulated ramp says what all that costs.

    Args:
        model: the equations.
        theta: the estimate.
        zero: L / r where the angles are zero, (n,).
        noise: of the readings.
        runs: all recordings.
    """
    own = coulomb_of(model, theta)
    torque = _motors(model, theta, "torque_constant")
    found = []
    for run in runs:
        known = ramp_of(run)
        if known is None:
            continue
        motor, slope = known
        moved_s, read = _read(run, motor, noise, torque[motor])
        again = _read(_again(model, theta, zero, noise, run), motor, noise, torque[motor])[1]
        late = own[motor] / (torque[motor] * slope)
        own_one = float(own[motor])
        found.append(Ramp(run.name, motor, slope, moved_s, read, again, own_one, late))
    return tuple(found)


def _again(model: DrivenModel, theta: Array, zero: Array, noise: Noise, run: DriveRun) -> DriveRun:
    """A run as the estimate would have it, told in counts."""
    motion = simulated(model, theta, run, start_pose(model, theta, run, zero))
    step = np.sqrt(12.0) * noise.angle_std_rad
    angles = np.round((zero - motion.turns) / step) * step
    return replace(run, record=replace(run.record, angles_rad=angles, currents_A=motion.currents_A))


def coulomb_of(model: DrivenModel, theta: Array) -> Array:
    """Coulomb friction of every motor, effects included, (n,)."""
    return _motors(model, theta, "coulomb")


def _motors(model: DrivenModel, theta: Array, name: str) -> Array:
    given = model.premises
    value = ca.Function("value", [given.theta], [getattr(given.terms.motors, name)])
    return np.asarray(ca.DM(value(theta)).full()).ravel()


def _read(run: DriveRun, motor: int, noise: Noise, torque: float) -> tuple[float, float]:
    """When a motor first moved, and the torque of its current then over that at the start."""
    angles, times = run.record.angles_rad[:, motor], run.record.times_s - run.record.times_s[0]
    reach = MOVED_STEPS * np.sqrt(12.0) * noise.angle_std_rad
    away = np.flatnonzero(np.abs(angles - angles[0]) > reach)
    if len(away) == 0:
        return float("nan"), float("nan")
    first = int(away[0])
    # A straight line through the measured currents takes their noise out.
    line = np.polyfit(times[: first + 1], run.record.currents_A[: first + 1, motor], 1)
    return float(times[first]), float(torque * line[0] * times[first])
