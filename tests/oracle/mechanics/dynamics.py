"""Newton-Euler equations of the platform on its cables: accelerations and tensions at a state.

Rigid cables act through Lagrange multipliers, elastic ones through their own tension.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from tests.oracle.mechanics.forces import add_force, applied_wrench, bob_force, friction_force
from tests.oracle.mechanics.geometry import (
    add,
    cable,
    cross,
    dot,
    factor,
    length_acceleration,
    quaternion_rate,
    rotate,
    rotate_back,
    rotation_of,
    scaled,
    solve_factored,
)


@njit(cache=True)
def derivative(time, state, world, out, tension):
    """Time derivative of the state; `tension` (n,) comes in as a guess and leaves as solved."""
    n = world.entry.shape[0]
    p, q, v, omega = state[0:3], state[3:7], state[7:10], state[10:13]
    R = np.empty((3, 3))
    rotation_of(q, R)
    wrench = np.empty(6)
    applied_wrench(time, p, R, v, omega, world, wrench)
    _bob(state, p, R, v, omega, world, wrench, out)
    mass = mass_matrix(R, world)
    _inertial_bias(R, omega, world, wrench)
    J, gamma, arms, frames, scalars = constraint_rows(p, R, v, omega, world)
    cable_weight(R, omega, arms, scalars, world, mass, wrench)
    factor(mass)
    _solve_tensions(time, v, omega, world, mass, wrench, J, gamma, arms, frames, scalars, tension)
    for i in range(n):
        for k in range(6):
            wrench[k] -= J[i, k] * tension[i]
    solve_factored(mass, wrench)
    out[0:3] = v
    quaternion_rate(q, omega, out[3:7])
    out[7:13] = wrench


@njit(cache=True)
def _bob(state, p, R, v, omega, world, wrench, out):
    out[13:19] = 0.0
    if world.bob_mass <= 0.0:
        return
    arm = rotate(R, world.bob_pivot)
    pull = bob_force(add(p, arm), add(v, cross(omega, arm)), state[13:16], state[16:19], world)
    add_force(wrench, pull, arm)
    out[13:16] = state[16:19]
    for k in range(3):
        out[16 + k] = world.gravity[k] - pull[k] / world.bob_mass


@njit(cache=True)
def mass_matrix(R, world):
    """Mass matrix of the platform at P in the base frame, (6, 6)."""
    s = rotate(R, world.com)
    out = np.zeros((6, 6))
    for i in range(3):
        out[i, i] = world.mass
        for j in range(3):
            total = 0.0
            for a in range(3):
                for b in range(3):
                    total += R[i, a] * world.inertia[a, b] * R[j, b]
            out[3 + i, 3 + j] = total
    _add_skew(out, world.mass, s)
    return out


@njit(cache=True)
def _add_skew(out, mass, s):
    """The off-diagonal blocks -m s~ and m s~ of a mass at arm s."""
    out[0, 4] += mass * s[2]
    out[0, 5] -= mass * s[1]
    out[1, 3] -= mass * s[2]
    out[1, 5] += mass * s[0]
    out[2, 3] += mass * s[1]
    out[2, 4] -= mass * s[0]
    for i in range(3):
        for j in range(3):
            out[3 + j, i] = out[i, 3 + j]


@njit(cache=True)
def _inertial_bias(R, omega, world, wrench):
    """Takes the centripetal and gyroscopic terms from the wrench."""
    s = rotate(R, world.com)
    centripetal = cross(omega, cross(omega, s))
    momentum = rotate(R, rotate(world.inertia, rotate_back(R, omega)))
    gyro = cross(omega, momentum)
    for k in range(3):
        wrench[k] -= world.mass * centripetal[k]
        wrench[3 + k] -= gyro[k]


@njit(cache=True)
def constraint_rows(p, R, v, omega, world):
    """Rows of the length Jacobian and everything else the cables need.

    Returns:
        J (n, 6); gamma (n,), the part of the length's second derivative that velocities make;
        arms (n, 3); frames (n, 3, 3) with t, n, w; scalars (n, 4) of length, rho, psi, s.
    """
    count = world.entry.shape[0]
    J, gamma = np.empty((count, 6)), np.empty(count)
    arms, frames, scalars = np.empty((count, 3)), np.empty((count, 3, 3)), np.empty((count, 4))
    for i in range(count):
        arm = rotate(R, world.attach[i])
        t, n, w = frames[i, 0], frames[i, 1], frames[i, 2]
        entry = _yielded(i, add(p, arm), world, t, n, w)
        length, rho, psi, s = cable(entry, world.radius[i], world.swivel[i], add(p, arm), t, n, w)
        velocity = add(v, cross(omega, arm))
        gamma[i] = length_acceleration(world.radius[i], t, n, w, rho, psi, s, velocity)
        gamma[i] += dot(t, cross(omega, cross(omega, arm)))
        moment = cross(arm, t)
        for k in range(3):
            J[i, k], J[i, 3 + k], arms[i, k] = t[k], moment[k], arm[k]
        scalars[i, 0], scalars[i, 1], scalars[i, 2], scalars[i, 3] = length, rho, psi, s
    return J, gamma, arms, frames, scalars


@njit(cache=True)
def _yielded(i, point, world, t, n, w):
    """Where a hook without mass is that its elastic cable pulls sideways against a spring, (3,)."""
    entry = world.entry[i].copy()
    if world.hook[i] <= 0.0:
        return entry
    for _ in range(25):
        length, _, _, _ = cable(entry, world.radius[i], world.swivel[i], point, t, n, w)
        pull = max(0.0, world.stiffness_ea * (length / world.length[i] - 1.0))
        for k in range(2):
            entry[k] = world.entry[i, k] + pull * t[k] / world.hook[i]
    return entry


@njit(cache=True)
def cable_weight(R, omega, arms, scalars, world, mass, wrench):
    """A straight massive cable pinned at the pulley: a third of its mass moves with A.

    Its velocity grows linearly from the exit point, so the kinetic energy is that of a third of
    the straight part's mass at A; half of its weight hangs on A.
    """
    if world.density == 0.0:
        return
    for i in range(arms.shape[0]):
        hanging = world.density * scalars[i, 1]
        add_force(wrench, scaled(0.5 * hanging, world.gravity), arms[i])
        moving = hanging / 3.0
        centripetal = cross(omega, cross(omega, arms[i]))
        add_force(wrench, scaled(-moving, centripetal), arms[i])
        for k in range(3):
            mass[k, k] += moving
        _add_skew(mass, moving, arms[i])
        square = dot(arms[i], arms[i])
        for k in range(3):
            mass[3 + k, 3 + k] += moving * square
            for j in range(3):
                mass[3 + k, 3 + j] -= moving * arms[i, k] * arms[i, j]


@njit(cache=True)
def held_length(time, i, world):
    """Length of cable i that the winch holds at `time`, its rate and its acceleration."""
    w = 2.0 * math.pi * world.hunting_hz
    angle = w * time + world.hunting_phase
    start = math.sin(world.hunting_phase)
    length = world.length[i] + world.creep[i] * time
    length += world.hunting[i] * (math.sin(angle) - start)
    rate = world.creep[i] + world.hunting[i] * w * math.cos(angle)
    return length, rate, -world.hunting[i] * w * w * math.sin(angle)


@njit(cache=True)
def elastic_tension(time, i, world, length, rate):
    """Tension of an elastic cable stretched to `length`, never pushing."""
    held, held_rate, _ = held_length(time, i, world)
    strain, strain_rate = (length - held) / held, (rate - held_rate) / held
    return max(0.0, world.stiffness_ea * (strain + world.relaxation * strain_rate))


@njit(cache=True)
def _solve_tensions(time, v, omega, world, mass, wrench, J, gamma, arms, frames, scalars, tension):
    """Tensions, with friction added to the wrench; friction that grows with tension is iterated."""
    n = world.entry.shape[0]
    rates = np.empty(n)
    rough = np.sum(world.swivel_coulomb) + np.sum(world.swivel_viscous) > 0.0
    loaded = np.sum(world.bending) > 0.0
    for i in range(n):
        rates[i] = dot(J[i, :3], v) + dot(J[i, 3:], omega)
        if world.stiffness_ea > 0.0:
            tension[i] = elastic_tension(time, i, world, scalars[i, 0], rates[i])
    rounds = 1 if world.stiffness_ea > 0.0 or not loaded else 4
    bare = wrench.copy()
    for _ in range(rounds):
        wrench[:] = bare
        if rough or loaded:
            _friction(v, omega, world, arms, frames, scalars, tension, wrench)
        if world.stiffness_ea == 0.0:
            _multipliers(time, world, mass, wrench, J, gamma, tension)


@njit(cache=True)
def _friction(v, omega, world, arms, frames, scalars, tension, wrench):
    for i in range(arms.shape[0]):
        velocity = add(v, cross(omega, arms[i]))
        force = friction_force(
            i, world, tension[i], velocity, frames[i, 1], frames[i, 2], scalars[i, 1], scalars[i, 3]
        )
        add_force(wrench, force, arms[i])


@njit(cache=True)
def _multipliers(time, world, mass, wrench, J, gamma, tension):
    """Tensions that keep the second derivative of every length at that of its winch."""
    n = J.shape[0]
    free = wrench.copy()
    solve_factored(mass, free)
    columns = np.empty((n, 6))
    for i in range(n):
        columns[i] = J[i]
        solve_factored(mass, columns[i])
    normal = np.empty((n, n))
    for i in range(n):
        _, _, acceleration = held_length(time, i, world)
        tension[i] = gamma[i] - acceleration
        for k in range(6):
            tension[i] += J[i, k] * free[k]
        for j in range(n):
            normal[i, j] = 0.0
            for k in range(6):
                normal[i, j] += J[i, k] * columns[j, k]
    factor(normal)
    solve_factored(normal, tension)
