"""Every force of the world on the platform except the cable tensions, from first principles.

A wrench is (force, moment about P) in the base frame, (6,).
"""

from __future__ import annotations

import math

from numba import njit

from tests.oracle.mechanics.geometry import add, cross, dot, rotate, scaled

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
    add_force(wrench, scaled(world.mass, world.gravity), s)
    _drag(R, v, omega, world, wrench)
    _disturbances(time, R, world, wrench)
    if world.tether_stiffness > 0.0:
        _tether(p, R, world, wrench)
    if world.torsion > 0.0:
        _torsion(R, world, wrench)
    if world.wall_stiffness > 0.0:
        _contact(p, v, omega, world, s, wrench)
    if world.magnet_strength != 0.0:
        line = add(world.magnet, scaled(-1.0, add(p, s)))
        pull = world.magnet_strength / dot(line, line) ** 2.5
        add_force(wrench, scaled(pull, line), s)


@njit(cache=True)
def _drag(R, v, omega, world, wrench):
    arm = rotate(R, world.drag_point)
    velocity = add(v, cross(omega, arm))
    speed = math.sqrt(dot(velocity, velocity))
    add_force(wrench, scaled(-(world.drag + world.drag_quadratic * speed), velocity), arm)
    gyro = cross(omega, rotate(R, world.rotor))
    for k in range(3):
        wrench[3 + k] -= world.drag_angular * omega[k] + gyro[k]


@njit(cache=True)
def _disturbances(time, R, world, wrench):
    arm = rotate(R, world.force_point)
    add_force(wrench, world.force, arm)
    for k in range(world.oscillators.shape[0]):
        hz, phase, rate = world.oscillators[k, 0], world.oscillators[k, 1], world.oscillators[k, 5]
        wave = math.sin(2.0 * math.pi * (hz * time + 0.5 * rate * time * time) + phase)
        add_force(wrench, scaled(wave, world.oscillators[k, 2:5]), arm)


@njit(cache=True)
def _tether(p, R, world, wrench):
    arm = rotate(R, world.tether_point)
    line = add(world.tether_anchor, scaled(-1.0, add(p, arm)))
    distance = math.sqrt(dot(line, line))
    if distance > world.tether_rest:
        pull = world.tether_stiffness * (distance - world.tether_rest) / distance
        add_force(wrench, scaled(pull, line), arm)


@njit(cache=True)
def _torsion(R, world, wrench):
    """The spring's energy is kappa h^2 / 2 with the heading h = atan2(R10, R00).

    Its moment is minus the gradient of that, which has a small horizontal part when the
    platform's x axis leaves the horizontal plane.
    """
    heading = math.atan2(R[1, 0], R[0, 0]) - world.torsion_yaw
    flat = R[0, 0] ** 2 + R[1, 0] ** 2
    wrench[3] += world.torsion * heading * R[0, 0] * R[2, 0] / flat
    wrench[4] += world.torsion * heading * R[1, 0] * R[2, 0] / flat
    wrench[5] -= world.torsion * heading


@njit(cache=True)
def _contact(p, v, omega, world, s, wrench):
    depth = dot(world.wall_normal, add(p, s)) - world.wall_offset
    if depth > 0.0:
        rate = dot(world.wall_normal, add(v, cross(omega, s)))
        push = max(0.0, world.wall_stiffness * depth + world.wall_damping * rate)
        add_force(wrench, scaled(-push, world.wall_normal), s)


@njit(cache=True)
def bob_force(pivot, pivot_velocity, bob, bob_velocity, world):
    """Force of the hanging bob on the platform at its pivot."""
    line = add(bob, scaled(-1.0, pivot))
    length = math.sqrt(dot(line, line))
    relative = add(bob_velocity, scaled(-1.0, pivot_velocity))
    stiffness = world.bob_mass * (2.0 * math.pi * BOB_AXIAL_HZ) ** 2
    damping = 0.1 * math.sqrt(stiffness * world.bob_mass)
    axial = stiffness * (length - world.bob_length) + damping * dot(line, relative) / length
    return add(scaled(axial / length, line), scaled(world.bob_damping, relative))


@njit(cache=True)
def bob_at_rest(p, R, world):
    """Where the bob hangs when nothing moves."""
    gravity = math.sqrt(dot(world.gravity, world.gravity))
    reach = world.bob_length + gravity / (2.0 * math.pi * BOB_AXIAL_HZ) ** 2
    pivot = add(p, rotate(R, world.bob_pivot))
    return add(pivot, scaled(reach / gravity, world.gravity))


@njit(cache=True)
def friction_force(i, world, tension, point_velocity, n, w, rho, s):
    """Force at attachment i of the friction in the swivel and of the cable's bending loss.

    A torque about the swivel axis reaches the platform as torque / s along w; a torque against
    the change of the wrap angle as torque / rho along n (virtual work).
    """
    if world.radius[i] == 0.0:
        return (0.0, 0.0, 0.0)
    swivel_rate = dot(w, point_velocity) / s
    wrap_rate = dot(n, point_velocity) / rho
    swivel = world.swivel_coulomb[i] * math.tanh(swivel_rate / COULOMB_RATE_RAD_S)
    swivel += world.swivel_viscous[i] * swivel_rate
    wrap = world.bending[i] * world.radius[i] * tension
    wrap *= math.tanh(wrap_rate / COULOMB_RATE_RAD_S)
    return add(scaled(-swivel / s, w), scaled(-wrap / rho, n))
