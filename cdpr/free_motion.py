"""Kinematics with the winches locked: free and dependent coordinates (FIDIM 2022, sec. 2.2).

Any 6 - n of the pose coordinates may serve as free ones; how well they do is a number, and the
choice matters downstream only for what was measured.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from cdpr.batch import Bound, evaluate
from cdpr.model import Model
from cdpr.robot import POSE_COORDINATES, Array


@dataclass(frozen=True, slots=True)
class FreeBasis:
    """How the pose follows its free coordinates.

    Attributes:
        zeta_map: d zeta / d zeta_f, (..., 6, 6 - n).
        zeta_map_rate: its time derivative, (..., 6, 6 - n).
        xi_perp: Xi-perp = D zeta_map, so that the twist is Xi-perp zeta_f_dot (eq. 6).
        xi_perp_rate: its time derivative (eq. 7).
    """

    zeta_map: Array
    zeta_map_rate: Array
    xi_perp: Array
    xi_perp_rate: Array


def coordinate_indices(names: tuple[str, ...]) -> list[int]:
    """Positions of the named coordinates in zeta.

    Raises:
        ValueError: for a name that is not one of x y z phi theta chi.
    """
    unknown = [name for name in names if name not in POSE_COORDINATES]
    if unknown:
        raise ValueError(f"{unknown} are not among the pose coordinates {POSE_COORDINATES}")
    return [POSE_COORDINATES.index(name) for name in names]


def _split(model: Model, free: tuple[str, ...]) -> tuple[list[int], list[int]]:
    chosen = coordinate_indices(free)
    n = model.robot.n_cables
    if len(set(chosen)) != 6 - n:
        raise ValueError(f"{n} cables leave {6 - n} free coordinates, got {free}")
    return chosen, [i for i in range(6) if i not in chosen]


def free_basis(
    model: Model, free: tuple[str, ...], zeta: Array, rates: Array, values: Array
) -> FreeBasis:
    """Maps from the free coordinates' rates to the pose's rates and twist.

    Args:
        model: the robot.
        free: names of the 6 - n free coordinates.
        zeta: poses, (..., 6).
        rates: their rates, (..., 6).
        values: effect values, (k,).

    Returns:
        A `FreeBasis`.

    Raises:
        ValueError: when the number of free coordinates is not 6 - n, or they do not determine the
            others at one of the poses (singular dependent block).
    """
    chosen, dependent = _split(model, free)
    jacobian = evaluate(model.cables, zeta, values)[3]
    jacobian_rate = evaluate(model.cable_rates, zeta, rates, values)[0]
    block = jacobian[..., dependent]
    zeta_map = np.zeros((*zeta.shape[:-1], 6, len(chosen)))
    zeta_map[..., chosen, :] = np.eye(len(chosen))
    try:
        zeta_map[..., dependent, :] = -np.linalg.solve(block, jacobian[..., chosen])
        zeta_map_rate = np.zeros_like(zeta_map)
        zeta_map_rate[..., dependent, :] = -np.linalg.solve(block, jacobian_rate @ zeta_map)
    except np.linalg.LinAlgError as error:
        raise ValueError(
            f"free coordinates {free} do not determine the pose (singular dependent block); "
            'use free_coordinates = "auto"'
        ) from error
    turn, turn_rate = evaluate(model.twist_map, zeta, rates)
    xi_perp_rate = turn_rate @ zeta_map + turn @ zeta_map_rate
    return FreeBasis(zeta_map, zeta_map_rate, turn @ zeta_map, xi_perp_rate)


def amplification(
    model: Model, free: tuple[str, ...], zeta: Array, values: Array | None = None
) -> Array:
    """How many times more the whole pose moves than the free coordinates do, at poses (..., 6).

    The conditioning number of a choice of free coordinates: the largest singular value of
    d zeta / d zeta_f with angles scaled to metres by the size of the platform. Beyond about 20,
    noise in the free coordinates swamps the dependent ones. Infinite where they are singular.
    """
    values = model.start_values if values is None else values
    chosen, dependent = _split(model, free)
    size = float(np.sqrt(np.mean(np.sum(model.robot.attachments_m**2, axis=1))))
    scale = np.array([1.0, 1.0, 1.0, size, size, size])
    jacobian = evaluate(model.cables, zeta, values)[3] / scale
    block = jacobian[..., dependent]
    smallest = np.linalg.svd(block, compute_uv=False)[..., -1]
    singular = smallest < 1e-9 * np.linalg.norm(jacobian, axis=(-2, -1))
    safe = np.where(singular[..., None, None], np.eye(len(dependent)), block)
    follow = -np.linalg.solve(safe, jacobian[..., chosen])
    amount = np.sqrt(1.0 + np.linalg.norm(follow, ord=2, axis=(-2, -1)) ** 2)
    return np.where(singular, np.inf, amount)


def choose_free_coordinates(
    model: Model, zetas: Array, values: Array | None = None
) -> tuple[tuple[str, ...], float]:
    """The free coordinates whose worst amplification over the poses (m, 6) is smallest.

    Returns:
        Their names, in the order of the pose coordinates, and that amplification.
    """
    count = 6 - model.robot.n_cables
    choices = list(combinations(POSE_COORDINATES, count))
    worst = [float(np.max(amplification(model, free, zetas, values))) for free in choices]
    best = int(np.argmin(worst))
    return choices[best], worst[best]


def admissible_rates(
    model: Model,
    zeta: Array,
    rates: Array,
    inertia: Array,
    values: Array | None = None,
    time_s: float = 0.0,
) -> Array:
    """The rates closest to `rates`, (6,), that the cables allow, creeping ones included.

    Args:
        model: the robot.
        zeta: pose, (6,).
        rates: wished rates, (6,).
        inertia: `INERTIA_NAMES` values, (9,).
        values: effect values, (k,).
        time_s: time since the start of the run.
    """
    values = model.start_values if values is None else values
    jacobian = evaluate(model.cables, zeta, values)[3]
    for _ in range(3):
        slip = evaluate(model.slip, time_s, zeta, rates, inertia, values)[0]
        rates = rates - np.linalg.pinv(jacobian) @ slip
    return rates


@dataclass(frozen=True, slots=True)
class Assembly:
    """Poses that have given lengths and free coordinates.

    Attributes:
        zetas: (n_t, 6).
        determinants: sign-carrying det of the dependent block, scaled, (n_t,): zero at a
            singularity, where assembly modes meet.
    """

    zetas: Array
    determinants: Array


def assemble(
    model: Model,
    free: tuple[str, ...],
    lengths_m: Array,
    free_values: Array,
    start: Array,
    values: Array | None = None,
    tolerance_m: float = 1e-11,
) -> Assembly:
    """Dependent coordinates at given lengths by Newton, from sample to sample (eq. 44).

    Args:
        model: the robot.
        free: names of the free coordinates.
        lengths_m: cable lengths, (n,).
        free_values: free coordinates, (n_t, 6 - n), finite, closely sampled.
        start: a pose near the first sample, (6,); it settles the assembly mode.
        values: effect values, (k,).
        tolerance_m: residual of the lengths.

    Raises:
        ValueError: naming the sample at which Newton fails, or at which the dependent block
            changes the sign of its determinant (a jump to another assembly mode).
    """
    values = model.start_values if values is None else values
    chosen, dependent = _split(model, free)
    bound = Bound(model.cables, 1)
    bound.inputs[1][:] = values
    zetas = np.empty((len(free_values), 6))
    determinants = np.empty(len(free_values))
    zeta = np.array(start, dtype=np.float64)
    sign = 0.0
    for sample, wanted in enumerate(free_values):
        step = wanted - zeta[chosen]
        jacobian = bound.outputs[3][0].T
        if sample:
            zeta[dependent] -= np.linalg.solve(jacobian[:, dependent], jacobian[:, chosen] @ step)
        zeta[chosen] = wanted
        residual = _newton(bound, zeta, dependent, lengths_m, tolerance_m)
        block = bound.outputs[3][0].T[:, dependent]
        determinants[sample] = float(np.linalg.det(block))
        sign = sign or np.sign(determinants[sample])
        if residual > tolerance_m or np.sign(determinants[sample]) != sign:
            raise ValueError(
                f"sample {sample}: the cable lengths and the free coordinates {free} = "
                f"{np.array2string(np.asarray(wanted), precision=5)} give no pose continuous with "
                f"the last one (length residual {residual:.2e} m, determinant "
                f"{determinants[sample]:.1e}); the free coordinates pass a singularity there: "
                'measure others, or set free_coordinates = "auto"'
            )
        zetas[sample] = zeta
    return Assembly(zetas, determinants)


def _newton(
    bound: Bound, zeta: Array, dependent: list[int], lengths_m: Array, tolerance_m: float
) -> float:
    """Newton on the dependent coordinates of `zeta`, in place of a copy; the last residual."""
    residual = np.inf
    for _ in range(12):
        bound.inputs[0][0] = zeta
        bound.run()
        error = bound.outputs[0][0] - lengths_m
        residual = float(np.abs(error).max())
        if not np.isfinite(residual) or residual <= tolerance_m:
            return residual
        zeta[dependent] -= np.linalg.solve(bound.outputs[3][0].T[:, dependent], error)
    return residual
