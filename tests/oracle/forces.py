"""Every force of the world on the platform except the cable tensions, from first principles.

A wrench is (force, moment about P) in the base frame, (6,).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from tests.oracle.geometry import cross, dot, rotate

COULOMB_RATE_RAD_S = 2e-4  # below this rate dry friction is smoothed to a viscous creep
BOB_AXIAL_HZ = 25.0  # a bob hangs on a stiff elastic string of this frequency


@njit(cache=True)
def add_force(wrench, force, arm):
    """Adds a force acting at P + arm."""
    moment = cross(arm, force)
    for k in range(3):
        wrench[k] += force[k]
        wrench[3 + k] += moment[k]


@njit(cache=True)
def applied_wrench(time, p, R, v, omega, world, wrench):
    """Fills `wrench` with gravity, drag, springs, contact, magnet and disturbances at `time`."""
    wrench[:] = 0.0
    s = rotate(R, world.com)
    add_force(wrench, world.mass * world.gravity, s)
    _drag(R, v, omega, world, wrench)
    _disturbances(time, R, world, wrench)
    _springs(p, R, world, wrench)
    _contact_and_magnet(p, R, v, omega, world, s, wrench)


@njit(cache=True)
def _drag(R, v, omega, world, wrench):
    arm = rotate(R, world.drag_point)
    velocity = v + cross(omega, arm)
    speed = math.sqrt(dot(velocity, velocity))
    add_force(wrench, -(world.drag + world.drag_quadratic * speed) * velocity, arm)
    turn = cross(omega, rotate(R, world.rotor))
    for k in range(3):
        wrench[3 + k] -= world.drag_angular * omega[k] + turn[k]


@njit(cache=True)
def _disturbances(time, R, world, wrench):
    force = world.force.copy()
    for k in range(world.oscillators.shape[0]):
        hz, phase, rate = world.oscillators[k, 0], world.oscillators[k, 1], world.oscillators[k, 5]
        wave = math.sin(2.0 * math.pi * (hz * time + 0.5 * rate * time * time) + phase)
        for j in range(3):
            force[j] += wave * world.oscillators[k, 2 + j]
    add_force(wrench, force, rotate(R, world.force_point))


@njit(cache=True)
def _springs(p, R, world, wrench):
    arm = rotate(R, world.tether_point)
    line = world.tether_anchor - p - arm
    distance = math.sqrt(dot(line, line))
    if world.tether_stiffness > 0.0 and distance > world.tether_rest:
        pull = world.tether_stiffness * (distance - world.tether_rest) / distance
        add_force(wrench, pull * line, arm)
    heading = math.atan2(R[1, 0], R[0, 0]) - world.torsion_yaw
    # The potential kappa heading^2 / 2 of the heading atan2(R10, R00): its moment is minus the
    # gradient, which has a small horizontal part when the x axis leaves the horizontal plane.
    flat = R[0, 0] ** 2 + R[1, 0] ** 2
    wrench[3] += world.torsion * heading * R[0, 0] * R[2, 0] / flat
    wrench[4] += world.torsion * heading * R[1, 0] * R[2, 0] / flat
    wrench[5] -= world.torsion * heading


@njit(cache=True)
def _contact_and_magnet(p, R, v, omega, world, s, wrench):
    centre = p + s
    depth = dot(world.wall_normal, centre) - world.wall_offset
    if world.wall_stiffness > 0.0 and depth > 0.0:
        rate = dot(world.wall_normal, v + cross(omega, s))
        push = max(0.0, world.wall_stiffness * depth + world.wall_damping * rate)
        add_force(wrench, -push * world.wall_normal, s)
    if world.magnet_strength != 0.0:
        line = world.magnet - centre
        distance = math.sqrt(dot(line, line))
        add_force(wrench, world.magnet_strength / distance**5 * line, s)


@njit(cache=True)
def bob_force(pivot, pivot_velocity, bob, bob_velocity, world):
    """Force of the hanging bob on the platform at its pivot, (3,)."""
    line = bob - pivot
    length = math.sqrt(dot(line, line))
    relative = bob_velocity - pivot_velocity
    stiffness = world.bob_mass * (2.0 * math.pi * BOB_AXIAL_HZ) ** 2
    damping = 0.1 * math.sqrt(stiffness * world.bob_mass)
    axial = stiffness * (length - world.bob_length) + damping * dot(line, relative) / length
    return axial / length * line + world.bob_damping * relative


@njit(cache=True)
def bob_at_rest(p, R, world):
    """Where the bob hangs when nothing moves, (3,)."""
    stretch = math.sqrt(dot(world.gravity, world.gravity)) / (2.0 * math.pi * BOB_AXIAL_HZ) ** 2
    down = world.gravity / math.sqrt(dot(world.gravity, world.gravity))
    return p + rotate(R, world.bob_pivot) + (world.bob_length + stretch) * down


@njit(cache=True)
def friction_force(i, world, tension, point_velocity, n, w, rho, s):
    """Force at attachment i of the friction in the swivel and of the cable's bending loss, (3,).

    A torque about the swivel axis reaches the platform as torque / s along w; a torque against
    the change of the wrap angle as torque / rho along n (virtual work).
    """
    if world.radius[i] == 0.0:
        return np.zeros(3)
    swivel_rate = dot(w, point_velocity) / s
    wrap_rate = dot(n, point_velocity) / rho
    swivel = world.swivel_coulomb[i] * math.tanh(swivel_rate / COULOMB_RATE_RAD_S)
    swivel += world.swivel_viscous[i] * swivel_rate
    wrap = world.bending[i] * world.radius[i] * tension
    wrap *= math.tanh(wrap_rate / COULOMB_RATE_RAD_S)
    return -swivel / s * w - wrap / rho * n
