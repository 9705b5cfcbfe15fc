"""Equilibria from lengths or tensions, their stability, and small oscillations about them.

Equilibria are stationary points of potential + multipliers . lengths; at given lengths the
multipliers are unknown (FIDIM 2022, sec. 4; self-calibration 2019, eqs. 9-13), at given tensions
they are the tensions. All forces are per unit of platform mass. Effects count with what they do
at rest at time zero: constant and spring forces, tilted gravity, cable weight, biased and
stretched cables.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.model.batch import Bound, evaluate, only
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array, finite
from freeswing.cdpr.rotation import matrix_from_angles

TOLERANCE = 1e-11
SWEEPS = 60


@dataclass(frozen=True, slots=True)
class Equilibrium:
    """A platform at rest.

    Attributes:
        zeta: pose coordinates, (6,).
        lengths_m: cable lengths as the winches would tell them, (n,): the geometric ones unless
            effects lengthen the cables.
        tensions: specific tensions tau / m, (n,), positive when taut.
        stable: whether the energy has a strict minimum under the constraints.
        taut: whether every tension is positive.
    """

    zeta: Array
    lengths_m: Array
    tensions: Array
    stable: bool
    taut: bool


@dataclass(frozen=True, slots=True)
class Modes:
    """Small free oscillations about an equilibrium (eqs. 37-39).

    Attributes:
        frequencies_hz: ascending, (6 - n,).
        shapes: d zeta of each mode with unit specific modal mass, (6, 6 - n).
        stiffness: free-motion stiffness in an orthonormal basis of the free directions.
        mass: the specific mass matrix in the same basis.
    """

    frequencies_hz: Array
    shapes: Array
    stiffness: Array
    mass: Array


def equilibrium_at_lengths(
    model: Model,
    lengths_m: Array,
    start: Array,
    inertia: Array,
    values: Array | None = None,
) -> Equilibrium | None:
    """The equilibrium that damped Newton reaches from `start`, or None where it reaches none.

    Args:
        model: the robot.
        lengths_m: as the winches tell them, (n,).
        start: pose, (6,).
        inertia: `INERTIA_NAMES` values, (9,).
        values: effect values, (k,).

    Raises:
        ValueError: for wrong shapes or numbers that are not finite.
    """
    values = model.start_values if values is None else values
    system = _System(model, inertia, values)
    n = model.robot.n_cables
    lengths_m, start = finite("lengths_m", lengths_m, n), finite("start", start, 6)
    zeta, multipliers = np.array(start, dtype=np.float64), None
    for _ in range(SWEEPS):
        gradient, hessian, lengths, jacobian = system.at(zeta, multipliers)
        if multipliers is None:
            multipliers = -np.linalg.lstsq(jacobian.T, gradient, rcond=None)[0]
            gradient, hessian, lengths, jacobian = system.at(zeta, multipliers)
        gap = lengths - lengths_m
        if max(np.abs(gradient).max(), np.abs(gap).max()) < TOLERANCE:
            return _classified(system, zeta, multipliers)
        free = _null_space(jacobian)
        step = -np.linalg.pinv(jacobian) @ gap
        # Along the free directions the energy must fall: flip the eigenvalues that would climb.
        if free.size:
            reduced = free.T @ hessian @ free
            eigenvalues, vectors = np.linalg.eigh(reduced)
            slope = vectors.T @ (free.T @ (gradient + hessian @ step))
            step = step - free @ (vectors @ (slope / np.maximum(np.abs(eigenvalues), 1e-3)))
        step *= min(1.0, 0.3 / max(np.abs(step).max(), 1e-300))
        zeta = zeta + step
        multipliers = -np.linalg.lstsq(
            jacobian.T, gradient - jacobian.T @ multipliers + hessian @ step, rcond=None
        )[0]
        if not np.isfinite(zeta).all():
            return None
    return None


def equilibrium_at_tensions(
    model: Model,
    tensions: Array,
    start: Array,
    inertia: Array,
    values: Array | None = None,
) -> Equilibrium | None:
    """The equilibrium under constant specific tensions (n,) that damped Newton reaches.

    Stability is that of a platform whose winches hold tensions, not lengths: the whole Hessian
    must be positive definite.

    Raises:
        ValueError: for wrong shapes or numbers that are not finite.
    """
    values = model.start_values if values is None else values
    system = _System(model, inertia, values)
    tensions = finite("tensions", tensions, model.robot.n_cables)
    start = finite("start", start, 6)
    zeta = np.array(start, dtype=np.float64)
    for _ in range(3 * SWEEPS):
        gradient, hessian, lengths, _ = system.at(zeta, tensions)
        eigenvalues, vectors = np.linalg.eigh(hessian)
        if np.abs(gradient).max() < TOLERANCE:
            stable = bool(eigenvalues[0] > 0.0)
            return Equilibrium(zeta, lengths, tensions.copy(), stable, bool((tensions > 0).all()))
        step = -vectors @ ((vectors.T @ gradient) / np.maximum(np.abs(eigenvalues), 1e-3))
        zeta = zeta + step * min(1.0, 0.3 / max(np.abs(step).max(), 1e-300))
        if not np.isfinite(zeta).all():
            return None
    return None


def equilibria(
    model: Model,
    generator: np.random.Generator,
    inertia: Array,
    lengths_m: Array | None = None,
    tensions: Array | None = None,
    starts: int = 40,
    values: Array | None = None,
) -> tuple[Equilibrium, ...]:
    """All distinct equilibria found from many random starts below the pulleys.

    Args:
        model: the robot.
        generator: source of the starts.
        inertia: `INERTIA_NAMES` values, (9,).
        lengths_m: given lengths, (n,), or
        tensions: given specific tensions, (n,); exactly one of the two.
        starts: how many.
        values: effect values, (k,).

    Raises:
        ValueError: when not exactly one of lengths and tensions is given.
    """
    if (lengths_m is None) == (tensions is None):
        raise ValueError("give either lengths_m or tensions, not both and not neither")
    given = np.zeros(0) if tensions is None else tensions
    found: list[Equilibrium] = []
    for start in random_poses(model, generator, starts):
        if lengths_m is not None:
            reached = equilibrium_at_lengths(model, lengths_m, start, inertia, values)
        else:
            reached = equilibrium_at_tensions(model, given, start, inertia, values)
        if reached is not None and not any(_same(reached, known) for known in found):
            found.append(reached)
    return tuple(sorted(found, key=lambda e: (not e.stable, not e.taut, e.zeta[2])))


def random_poses(model: Model, generator: np.random.Generator, count: int) -> Array:
    """Poses (count, 6) spread over the box below the cable entries, tilted by up to 0.5 rad.

    Source:
        FIDIM 2022, sec. 5.1: random equilibria in the workspace.
    """
    entries = model.robot.entries_m
    low, high = entries.min(axis=0), entries.max(axis=0)
    down = -model.robot.gravity_m_s2 / np.linalg.norm(model.robot.gravity_m_s2)
    span = float(np.linalg.norm(high - low)) or 1.0
    fractions = generator.uniform(size=(count, 3))
    depth = generator.uniform(0.2, 1.5, size=(count, 1)) * span
    positions = low + fractions * (high - low) - depth * down
    return np.hstack([positions, generator.uniform(-0.5, 0.5, size=(count, 3))])


def modes(
    model: Model, equilibrium: Equilibrium, inertia: Array, values: Array | None = None
) -> Modes:
    """Frequencies and shapes of the free motion about an equilibrium at locked winches.

    Raises:
        ValueError: when the equilibrium is not stable, nothing can move, or the inertia is that
            of no body.
    """
    values = model.start_values if values is None else values
    zeta = equilibrium.zeta
    _, _, hessian = evaluate(model.lagrangian, zeta, equilibrium.tensions, inertia, values)
    free = _null_space(evaluate(only(model.cables, 3), zeta, values)[0])
    if not free.size:
        raise ValueError(f"{model.robot.n_cables} cables leave no free motion, hence no modes")
    stiffness = free.T @ hessian @ free
    mass = free.T @ evaluate(model.mass_matrix, zeta, inertia, values)[0] @ free
    lightest = float(np.linalg.eigvalsh(mass)[0])
    if not lightest > 0.0:
        raise ValueError(
            f"inertia {inertia} is not that of a body: its mass matrix has eigenvalue "
            f"{lightest:.2e}, must be above 0"
        )
    unit = np.linalg.inv(np.linalg.cholesky(mass)).T
    squares, vectors = np.linalg.eigh(unit.T @ stiffness @ unit)
    vectors = unit @ vectors
    if squares[0] <= 0.0:
        raise ValueError(
            f"the equilibrium at {np.array2string(zeta, precision=3)} is not stable "
            f"(smallest squared frequency {squares[0]:.3g} rad^2/s^2)"
        )
    return Modes(np.sqrt(squares) / (2 * np.pi), free @ vectors, stiffness, mass)


def _null_space(jacobian: Array) -> Array:
    """Orthonormal directions that no row sees, (6, 6 - rank)."""
    _, singular, rows = np.linalg.svd(jacobian)
    return rows[int(np.sum(singular > 1e-12 * singular[0])) :].T


def _same(first: Equilibrium, second: Equilibrium) -> bool:
    """Whether two poses are one; the same orientation may have other angles."""
    turns = matrix_from_angles(np.array([first.zeta[3:], second.zeta[3:]]))
    apart = max(np.abs(first.zeta[:3] - second.zeta[:3]).max(), np.abs(turns[0] - turns[1]).max())
    return bool(apart < 1e-6)


def _classified(system: _System, zeta: Array, multipliers: Array) -> Equilibrium:
    _, hessian, lengths, jacobian = system.at(zeta, multipliers)
    free = _null_space(jacobian)
    reduced = np.linalg.eigvalsh(free.T @ hessian @ free) if free.size else np.ones(1)
    stable, taut = bool(reduced[0] > 0.0), bool((multipliers > 0.0).all())
    return Equilibrium(zeta, lengths, multipliers, stable, taut)


class _System:
    """Gradient and Hessian of the Lagrangian, told lengths and Jacobian, at one pose."""

    def __init__(self, model: Model, inertia: Array, values: Array) -> None:
        self._lagrangian = Bound(only(model.lagrangian, 1, 2), 1)
        self._cables = Bound(only(model.cables, 3), 1)
        self._told = Bound(model.told, 1)
        inertia = finite("inertia", inertia, 9)
        values = finite("values", values, len(model.parameters))
        for bound, place in ((self._lagrangian, 2), (self._told, 3)):
            bound.inputs[place][:] = inertia
            bound.inputs[place + 1][:] = values
        self._cables.inputs[1][:] = values

    def at(self, zeta: Array, multipliers: Array | None) -> tuple[Array, Array, Array, Array]:
        lagrangian, cables, told = self._lagrangian, self._cables, self._told
        lagrangian.inputs[0][0] = cables.inputs[0][0] = told.inputs[1][0] = zeta
        lagrangian.inputs[1][:] = 0.0 if multipliers is None else multipliers
        for bound in (lagrangian, cables, told):
            bound.run()
        return (
            lagrangian.outputs[0][0].copy(),
            lagrangian.outputs[1][0].T.copy(),
            told.outputs[0][0].copy(),
            cables.outputs[0][0].T.copy(),
        )
