"""All controllers of one robot, tuned by the one rule of `tuning`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from freeswing.servo.design.controller import HALF_HOLD_S, Controller, finished
from freeswing.servo.design.hinf import design_hinf
from freeswing.servo.design.lqg import design_lqg
from freeswing.servo.design.mpc import design_mpc
from freeswing.servo.design.pid import slowest_filters, task_pid
from freeswing.servo.design.plant import Plant
from freeswing.servo.design.tuning import Noise, fastest
from freeswing.servo.synthesis.state_space import Array, StateSpace
from freeswing.servo.synthesis.weights import Weights

METHODS = ("hinf", "hinf-fastest", "pid", "joint-pid", "lqg", "mpc")
# Of the weights' own rates, 10 % apart; twice the paper's 5 rad/s are what a step of 0.2 m leaves
# of the currents, as for the others (`tuning.SPEEDS_RAD_S`).
SHARES = np.geomspace(0.4, 2.4, 20)


def design(
    method: str,
    plant: Plant,
    weights: Weights,
    noise: Noise,
    gear: Array,
    *,
    with_delay: bool,
    order: int | None = None,
) -> Controller:
    """One controller.

    Args:
        method: one of `METHODS`.
        plant: the robot about a pose.
        weights: of the H-infinity problem.
        noise: of the camera.
        gear: d theta / d X with its sign turned, (n, 6): J~ of the paper's eq. (6).
        with_delay: whether the H-infinity design knows the delay; the others always do.
        order: of the reduced H-infinity controller; None keeps all states.

    Raises:
        ValueError: for an unknown method, weights without a solution or a rule without one.
    """
    if method not in METHODS:
        raise ValueError(f"method {method!r}: one of {', '.join(METHODS)}")
    if method == "hinf":
        return design_hinf(plant, weights, with_delay=with_delay, order=order)
    if method == "hinf-fastest":
        return _fastest_hinf(plant, weights, noise, with_delay=with_delay, order=order)
    late = plant.delay_s + HALF_HOLD_S
    make = _makers(plant, gear)[method]
    if method == "joint-pid":
        # It never sees the camera: its poses are the encoders', fresh and free of that noise.
        instant = Plant(plant.at, plant.wrench, plant.mass, plant.system, 0.0)
        quiet = Noise(np.zeros(6), noise.period_s)
        speeds = fastest(make, instant, HALF_HOLD_S, quiet, tied=True)
        return finished(method, instant, make(speeds), _facts(speeds))
    speeds = fastest(make, plant, late, noise)
    if method == "mpc":
        predictor = design_mpc(plant, speeds)
        found = finished(method, plant, predictor.unbounded(), _facts(speeds))
        return replace(found, predictor=predictor)
    return finished(method, plant, make(speeds), _facts(speeds))


def _fastest_hinf(
    plant: Plant, weights: Weights, noise: Noise, *, with_delay: bool, order: int | None
) -> Controller:
    """H-infinity with the rates of its weights by the rule, one share for both halves.

    Slower orientations would hold positions back: M_o couples them.
    """
    # Weights that leave no problem say so here, and not as a speed that keeps no rule.
    design_hinf(plant, weights, with_delay=with_delay)

    def make(shares: Array) -> StateSpace:
        goals = weights.faster(float(shares[0]))
        return design_hinf(plant, goals, with_delay=with_delay).system

    late = plant.delay_s + HALF_HOLD_S
    shares = fastest(make, plant, late, noise, tied=True, grid=SHARES)
    goals = weights.faster(float(shares[0]))
    found = design_hinf(plant, goals, with_delay=with_delay, order=order)
    return replace(found, method="hinf-fastest", facts=found.facts | {"share": float(shares[0])})


def _makers(plant: Plant, gear: Array) -> dict[str, Callable[[Array], StateSpace]]:
    modes = np.abs(plant.system.poles())
    # The slower half of the modes are those of position, the faster those of orientation.
    fastest_modes = np.repeat([np.sort(modes)[5], modes.max()], 3)
    filters = slowest_filters(fastest_modes)
    felt = gear.T @ gear
    # The inertia that one motor feels when the platform is moved: M_o shared out over all motors.
    inertia = np.trace(plant.mass[:3, :3]) / np.trace(felt[:3, :3])
    return {
        "pid": lambda speeds: task_pid(plant.mass, speeds, np.r_[np.zeros(3), filters[3:]]),
        "joint-pid": lambda speeds: task_pid(inertia * felt, speeds, np.zeros(6)),
        "mpc": lambda speeds: design_mpc(plant, speeds).unbounded(),
        "lqg": lambda speeds: design_lqg(plant.delayed(), plant.mass, speeds).system,
    }


def _facts(speeds: Array) -> dict[str, float]:
    return {
        "position_speed_rad_s": float(speeds[0]),
        "orientation_speed_rad_s": float(speeds[3]),
    }
