"""Where the platform hangs at rest, and where to let it go from: all effects of the world count."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from tests.oracle.mechanics.dynamics import constraint_rows, derivative
from tests.oracle.mechanics.forces import add_force, applied_wrench
from tests.oracle.mechanics.geometry import rotate, rotation_of, scaled, turn
from tests.oracle.mechanics.newton_euler import project, start_state
from tests.oracle.mechanics.world import Array, World

ROTATION_SCALE_M = 0.25  # a radian counts as so many metres in step sizes and conditioning
RESIDUAL_LIMIT = 1e-9  # N, N m and m


class NoEquilibriumError(ValueError):
    """The draw has no usable rest pose; draw again."""


@dataclass(frozen=True, slots=True)
class Rest:
    """A pose at rest.

    Attributes:
        position_m: P, (3,).
        quaternion: w, x, y, z, (4,).
        tensions_n: (n,).
        stable: the potential energy has a minimum among the poses that hold the lengths.
        freedom: directions that keep the lengths, unit in metres with `ROTATION_SCALE_M`, (6, f).
    """

    position_m: Array
    quaternion: Array
    tensions_n: Array
    stable: bool
    freedom: Array


def lengths_at(world: World, position_m: Array, quaternion: Array) -> Array:
    """Geometric lengths of all cables at a pose, (n,)."""
    return jacobian_and_lengths(world, position_m, quaternion)[1]


def settle(world: World, position_m: Array, quaternion: Array) -> Rest:
    """The rest pose reached by Newton's method from a nearby pose, at `world.length`.

    Unknowns are the pose and the tensions; equations the balance of the wrench and the lengths
    (stretched by their tensions when elastic). Oscillating forces are left out.

    Raises:
        NoEquilibriumError: no convergence.
    """
    world = world._replace(oscillators=np.zeros((0, 6)))
    p: Array = np.array(position_m, dtype=float)
    q: Array = np.array(quaternion, dtype=float)
    J, _ = jacobian_and_lengths(world, p, q)
    bare = _residual(world, p, q, np.zeros(len(world.length)))[:6]
    tension: Array = np.linalg.lstsq(J.T, bare, rcond=None)[0]
    residual = bare
    for _ in range(60):
        residual = _residual(world, p, q, tension)
        if np.max(np.abs(residual)) < RESIDUAL_LIMIT:
            return _rest(world, p, q, tension)
        step = np.linalg.lstsq(_slope(world, p, q, tension), -residual, rcond=None)[0]
        step *= min(1.0, 0.05 / max(np.max(np.abs(step[:3])), 0.25 * np.max(np.abs(step[3:6]))))
        p += step[:3]
        turn(q, step[3:6])
        tension = tension + step[6:]
    raise NoEquilibriumError(f"balance still off by {np.max(np.abs(residual)):.2g} after 60 steps")


def displaced(
    world: World, rest: Rest, direction: Array, reach_m: float, reach_rad: float
) -> tuple[Array, Array]:
    """A pose on the held lengths, moved from `rest` until P or the orientation has gone so far.

    Args:
        world: physics with the run's lengths.
        rest: the rest pose.
        direction: weights of the columns of `rest.freedom`, (f,).
        reach_m: largest way of P.
        reach_rad: largest rotation.

    Returns:
        position (3,) and quaternion (4,).
    """
    rigid = world._replace(stiffness_ea=0.0)
    rigid = rigid._replace(length=lengths_at(world, rest.position_m, rest.quaternion))
    state = start_state(rigid, rest.position_m, rest.quaternion)
    heading = rest.freedom @ direction
    for _ in range(400):
        J, _ = jacobian_and_lengths(rigid, state[:3], state[3:7])
        freedom = freedom_of(J)
        heading = freedom @ (freedom.T @ heading)
        heading /= np.linalg.norm(heading)
        trial = state.copy()
        trial[:3] += 5e-4 * heading[:3]
        turn(trial[3:7], 5e-4 / ROTATION_SCALE_M * heading[3:])
        project(0.0, trial, rigid)
        way = np.linalg.norm(trial[:3] - rest.position_m)
        angle = 2.0 * np.arccos(min(1.0, abs(trial[3:7] @ rest.quaternion)))
        if way > reach_m or angle > reach_rad:
            break
        state = trial
    return _elastic_hold(world, state)


def tensions_at_rest(world: World, position_m: Array, quaternion: Array) -> Array:
    """Tensions of rigid cables just after letting go from rest at a pose, (n,)."""
    rigid = world._replace(stiffness_ea=0.0)
    tension = np.zeros(len(world.length))
    state = start_state(rigid, position_m, quaternion)
    derivative(0.0, state, rigid, np.empty(19), tension)
    return tension


def coordinate_condition(rest: Rest, rows: tuple[int, ...]) -> float:
    """How far the pose moves for a unit move of the coordinates in `rows` (1 is best)."""
    return float(1.0 / np.linalg.svd(rest.freedom[list(rows)])[1].min())


def _elastic_hold(world: World, state: Array) -> tuple[Array, Array]:
    """Stretches the cables as the tensions at letting go will, so that no cable is plucked."""
    if world.stiffness_ea > 0.0:
        for _ in range(6):
            tension = tensions_at_rest(world, state[:3], state[3:7])
            held = world.length * (1.0 + tension / world.stiffness_ea)
            project(0.0, state, world._replace(stiffness_ea=0.0, length=held))
    return state[:3].copy(), state[3:7].copy()


def _rest(world: World, p: Array, q: Array, tension: Array) -> Rest:
    J, _ = jacobian_and_lengths(world, p, q)
    freedom = freedom_of(J)
    scale = np.array([1.0, 1.0, 1.0] + 3 * [1.0 / ROTATION_SCALE_M])
    moves = scale[:, None] * freedom
    stiffness = -moves.T @ _slope(world, p, q, tension)[:6, :6] @ moves
    lowest = np.linalg.eigvalsh(0.5 * (stiffness + stiffness.T)).min()
    return Rest(p, q, tension, bool(lowest > 0.5), freedom)


def freedom_of(J: Array) -> Array:
    """Null space of the length Jacobian, rotations counted with `ROTATION_SCALE_M`, (6, f)."""
    scaled_rows = J * np.array([1.0, 1.0, 1.0] + 3 * [1.0 / ROTATION_SCALE_M])
    return np.linalg.svd(scaled_rows)[2][len(J) :].T


def jacobian_and_lengths(world: World, p: Array, q: Array) -> tuple[Array, Array]:
    """Length Jacobian (n, 6) and lengths (n,) at a pose."""
    R = np.empty((3, 3))
    rotation_of(q, R)
    J, _, _, _, scalars = constraint_rows(p, R, np.zeros(3), np.zeros(3), world)
    return J, scalars[:, 0].copy()


def _residual(world: World, p: Array, q: Array, tension: Array) -> Array:
    out = np.empty(6 + len(tension))
    _balance(p, q, tension, world, out)
    return out


def _slope(world: World, p: Array, q: Array, tension: Array) -> Array:
    """Derivative of the residual by pose (shift, rotation vector) and tension, differences."""
    size = 6 + len(tension)
    out = np.empty((size, size))
    for k in range(size):
        step = 1e-5 if k < 6 else 1e-2
        sides = []
        for sign in (1.0, -1.0):
            move = np.zeros(size)
            move[k] = sign * step
            turned = q.copy()
            turn(turned, move[3:6])
            sides.append(_residual(world, p + move[:3], turned, tension + move[6:]))
        out[:, k] = (sides[0] - sides[1]) / (2.0 * step)
    return out


@njit(cache=True)
def _balance(p, q, tension, world, out):
    R, zero = np.empty((3, 3)), np.zeros(3)
    rotation_of(q, R)
    wrench = np.empty(6)
    applied_wrench(0.0, p, R, zero, zero, world, wrench)
    J, _, arms, _, scalars = constraint_rows(p, R, zero, zero, world)
    for i in range(tension.shape[0]):
        weight = 0.5 * world.density * scalars[i, 1]
        add_force(wrench, scaled(weight, world.gravity), arms[i])
        for k in range(6):
            wrench[k] -= J[i, k] * tension[i]
        held = world.length[i]
        if world.stiffness_ea > 0.0:
            held *= 1.0 + tension[i] / world.stiffness_ea
        out[6 + i] = scalars[i, 0] - held
    if world.bob_mass > 0.0:
        add_force(wrench, scaled(world.bob_mass, world.gravity), rotate(R, world.bob_pivot))
    out[:6] = wrench
