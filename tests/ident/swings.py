"""Seeded simulated swings of the paper's robot, for tests and benchmarks of identification."""

from __future__ import annotations

from functools import cache

import numpy as np

from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.model.free_motion import assemble
from freeswing.cdpr.robot import POSE_COORDINATES, Array
from freeswing.cdpr.simulation.free_swing import Motion, simulate
from freeswing.ident.likelihood.rest_pose import taut_equilibrium
from freeswing.ident.runs import Payload, SwingRun
from tests.oracle.scenes.robots import declared_robot

# FIDIM 2022, Table 2: optimised cable lengths in metres, a column an equilibrium.
PAPER_LENGTHS_M = np.array(
    [
        [1.66, 1.32, 1.30, 1.52, 1.11, 1.38, 1.19, 1.16, 1.46, 1.43, 1.35, 1.52],
        [1.86, 1.58, 1.26, 1.26, 1.68, 1.39, 1.15, 1.17, 1.16, 1.37, 1.45, 1.12],
        [1.68, 1.99, 1.57, 1.27, 2.19, 1.36, 1.65, 1.63, 1.24, 1.27, 1.42, 1.17],
        [1.41, 1.76, 1.56, 1.50, 1.72, 1.32, 1.65, 1.59, 1.50, 1.30, 1.28, 1.54],
    ]
).T
# At the other three x and y do not settle the pose: their Jacobian block is nearly singular.
REGULAR = (2, 3, 5, 6, 7, 8, 9, 10, 11)
TRUE_INERTIA = np.array([0.002, -0.0025, 0.198, 0.0569, 0.0627, 0.0314, 2e-4, -2e-4, 1.6e-4])


@cache
def paper_model() -> Model:
    """The paper's robot."""
    return build_model(declared_robot("bologna-4"))


@cache
def swing(
    equilibrium: int,
    dx_m: float = 0.04,
    dy_m: float = 0.02,
    duration_s: float = 10.0,
    inertia: tuple[float, ...] = tuple(TRUE_INERTIA),
) -> Motion:
    """A release at rest from a displaced pose about one of the paper's equilibria."""
    model, truth = paper_model(), np.array(inertia)
    lengths = PAPER_LENGTHS_M[equilibrium]
    rest = taut_equilibrium(model, lengths, truth, f"equilibrium {equilibrium}").zeta
    path = rest[:2] + np.linspace(0.0, 1.0, 40)[:, None] * np.array([dx_m, dy_m])
    start = assemble(model, ("x", "y"), lengths, path, rest).zetas[-1]
    return simulate(model, start, np.zeros(6), (0.0, duration_s), truth)


def recorded(
    motion: Motion,
    name: str,
    generator: np.random.Generator | None = None,
    noise_m: float = 0.0,
    coordinates: tuple[str, ...] = ("x", "y"),
    role: str = "identify",
    length_error_m: Array | float = 0.0,
    payload: Payload | None = None,
) -> SwingRun:
    """The motion sampled at 100 Hz, angles with noise of `noise_m` over 0.2 m."""
    times = np.arange(round(100 * motion.end_s) + 1) / 100.0
    zetas, _, _ = motion.at(times)
    noise = np.where(np.arange(6) < 3, noise_m, noise_m / 0.2)
    if generator is not None:
        zetas = zetas + noise * generator.standard_normal(zetas.shape)
    columns = [POSE_COORDINATES.index(c) for c in coordinates]
    trajectory = Trajectory(times, coordinates, zetas[:, columns], None, "simulated")
    lengths = lengths_of(motion) + length_error_m
    window = (0.0, float(times[-1]))
    return SwingRun(name, role, trajectory, lengths, 5e-4, window, payload)  # pyright: ignore[reportArgumentType]


def lengths_of(motion: Motion) -> Array:
    """The cable lengths that the motion keeps, (n,)."""
    from freeswing.cdpr.model.batch import evaluate

    return evaluate(motion.model.lengths, motion.zetas[0], motion.values)[0]


@cache
def tilted_swing(equilibrium: int, tilt_rad: float = 0.08, duration_s: float = 10.0) -> Motion:
    """A release at rest from a tilted pose: also where x and y do not settle the pose."""
    return tilted_release(paper_model(), PAPER_LENGTHS_M[equilibrium], tilt_rad, duration_s)


def tilted_release(model: Model, lengths_m: Array, tilt_rad: float, duration_s: float) -> Motion:
    """The same of a robot that may differ from the paper's."""
    rest = taut_equilibrium(model, lengths_m, TRUE_INERTIA, "tilted").zeta
    share = np.linspace(0.0, 1.0, 40)[:, None]
    path = rest[3:5] + share * tilt_rad * np.array([0.7, 1.0])
    start = assemble(model, ("phi", "theta"), lengths_m, path, rest).zetas[-1]
    return simulate(model, start, np.zeros(6), (0.0, duration_s), TRUE_INERTIA)
