"""Newton-Euler integration of the platform in maximal coordinates: the truth's time evolution.

State: P (3), quaternion (4), velocity of P (3), angular velocity in the base frame (3), then the
place and velocity (3 + 3) of a bob that may hang on the platform. Rigid cables act through
Lagrange multipliers; pose and twist are projected back on the cable lengths after every
Runge-Kutta step. Elastic cables act through their own tension, no constraint at all.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from tests.oracle.mechanics.dynamics import (
    cable_weight,
    constraint_rows,
    derivative,
    held_length,
    mass_matrix,
)
from tests.oracle.mechanics.forces import bob_at_rest
from tests.oracle.mechanics.geometry import (
    add,
    dot,
    factor,
    rotate,
    rotation_of,
    scaled,
    solve_factored,
    turn,
)
from tests.oracle.mechanics.world import Array, World

STATE_SIZE = 19
RIGID_STEP_S = 5e-4
ELASTIC_STEP_S = 2.5e-4


@dataclass(frozen=True, slots=True)
class Motion:
    """A simulated run.

    Attributes:
        times_s: (n_t,).
        positions_m: P in the base frame, (n_t, 3).
        quaternions: w, x, y, z of T_base_platform, sign continuous, (n_t, 4).
        twists: velocity of P and angular velocity in the base frame, (n_t, 6).
        tensions_n: (n_t, n).
        drift_m: largest departure of a rigid cable from its length at a step's end.
    """

    times_s: Array
    positions_m: Array
    quaternions: Array
    twists: Array
    tensions_n: Array
    drift_m: float

    @property
    def rotations(self) -> Array:
        """R of T_base_platform, (n_t, 3, 3)."""
        out = np.empty((len(self.quaternions), 3, 3))
        for k, quaternion in enumerate(self.quaternions):
            rotation_of(quaternion, out[k])
        return out


def simulate(
    world: World,
    position_m: Array,
    quaternion: Array,
    duration_s: float,
    twist: Array | None = None,
    rate_hz: float = 100.0,
    step_s: float | None = None,
) -> Motion:
    """The free motion from a pose and a twist, sampled at `rate_hz` with both ends.

    With rigid cables the pose must already hold `world.length`. `step_s` is rounded so that a
    sample interval is a whole number of steps.
    """
    if step_s is None:
        step_s = ELASTIC_STEP_S if world.stiffness_ea > 0.0 else RIGID_STEP_S
    substeps = max(1, round(1.0 / (rate_hz * step_s)))
    samples = round(duration_s * rate_hz) + 1
    state = start_state(world, position_m, quaternion, twist)
    states, tensions, drift = _integrate(
        state, samples, substeps, 1.0 / (rate_hz * substeps), world
    )
    return Motion(
        np.arange(samples) / rate_hz,
        states[:, :3].copy(),
        states[:, 3:7].copy(),
        states[:, 7:13].copy(),
        tensions,
        float(drift),
    )


def start_state(
    world: World, position_m: Array, quaternion: Array, twist: Array | None = None
) -> Array:
    """The integrator's state (19,) with a bob, if there is one, hanging at rest."""
    state = np.zeros(STATE_SIZE)
    state[:3] = position_m
    state[3:7] = np.asarray(quaternion) / np.linalg.norm(quaternion)
    state[7:13] = 0.0 if twist is None else twist
    R = np.empty((3, 3))
    rotation_of(state[3:7], R)
    if world.bob_mass > 0.0:
        state[13:16] = bob_at_rest(state[:3], R, world)
    return state


@njit(cache=True)
def _integrate(state, samples, substeps, h, world):
    n = world.entry.shape[0]
    states = np.empty((samples, 19))
    tensions = np.empty((samples, n))
    k1, k2, k3, k4 = np.empty(19), np.empty(19), np.empty(19), np.empty(19)
    tension, unused = np.zeros(n), np.zeros(n)
    state, drift, time = state.copy(), 0.0, 0.0
    for sample in range(samples):
        time = sample * substeps * h
        derivative(time, state, world, k1, tension)
        states[sample] = state
        tensions[sample] = tension
        if sample == samples - 1:
            break
        for sub in range(substeps):
            time = (sample * substeps + sub) * h
            derivative(time, state, world, k1, tension)
            unused[:] = tension
            derivative(time + 0.5 * h, state + 0.5 * h * k1, world, k2, unused)
            derivative(time + 0.5 * h, state + 0.5 * h * k2, world, k3, unused)
            derivative(time + h, state + h * k3, world, k4, unused)
            state = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            state[3:7] /= math.sqrt(np.sum(state[3:7] ** 2))
            if world.stiffness_ea == 0.0:
                drift = max(drift, project(time + h, state, world))
    return states, tensions, drift


@njit(cache=True)
def project(time, state, world):
    """Moves pose and twist onto the held lengths, in the metric of the mass; in place.

    Returns:
        largest length error left, m.
    """
    n = world.entry.shape[0]
    R, gap, speed = np.empty((3, 3)), np.empty(n), np.empty(n)
    left = 0.0
    for attempt in range(4):
        rotation_of(state[3:7], R)
        J, _, _, _, scalars = constraint_rows(state[0:3], R, state[7:10], state[10:13], world)
        left = 0.0
        for i in range(n):
            length, rate, _ = held_length(time, i, world)
            gap[i] = length - scalars[i, 0]
            speed[i] = rate - dot(J[i, :3], state[7:10]) - dot(J[i, 3:], state[10:13])
            left = max(left, abs(gap[i]))
        mass = mass_matrix(R, world)
        factor(mass)
        if left < 1e-13 or attempt == 3:
            state[7:13] += _correction(mass, J, speed)
            return left
        move = _correction(mass, J, gap)
        state[0:3] += move[:3]
        turn(state[3:7], move[3:])
    return left


@njit(cache=True)
def _correction(mass, J, gap):
    n = J.shape[0]
    columns, normal = np.empty((n, 6)), np.empty((n, n))
    for i in range(n):
        columns[i] = J[i]
        solve_factored(mass, columns[i])
    for i in range(n):
        for j in range(n):
            normal[i, j] = 0.0
            for k in range(6):
                normal[i, j] += J[i, k] * columns[j, k]
    factor(normal)
    solve_factored(normal, gap)
    out = np.zeros(6)
    for i in range(n):
        for k in range(6):
            out[k] += columns[i, k] * gap[i]
    return out


@njit(cache=True)
def energy(time, state, world, tension_energy):
    """Mechanical energy of body, cable weights, tether, torsion spring and bob, J.

    `tension_energy` adds the strain energy of elastic cables.
    """
    p, v, omega = state[0:3], state[7:10], state[10:13]
    R = np.empty((3, 3))
    rotation_of(state[3:7], R)
    mass = mass_matrix(R, world)
    wrench = np.zeros(6)
    _, _, arms, _, scalars = constraint_rows(p, R, v, omega, world)
    cable_weight(R, omega, arms, scalars, world, mass, wrench)
    total = 0.0
    for i in range(6):
        for j in range(6):
            total += 0.5 * state[7 + i] * mass[i, j] * state[7 + j]
    total -= world.mass * dot(world.gravity, add(p, rotate(R, world.com)))
    end = add(p, rotate(R, world.tether_point))
    line = add(world.tether_anchor, scaled(-1.0, end))
    distance = math.sqrt(dot(line, line))
    total += 0.5 * world.tether_stiffness * max(0.0, distance - world.tether_rest) ** 2
    total += 0.5 * world.torsion * (math.atan2(R[1, 0], R[0, 0]) - world.torsion_yaw) ** 2
    if tension_energy and world.stiffness_ea > 0.0:
        for i in range(scalars.shape[0]):
            held, _, _ = held_length(time, i, world)
            stretch = max(0.0, scalars[i, 0] - held)
            total += 0.5 * world.stiffness_ea / held * stretch**2
    return total
