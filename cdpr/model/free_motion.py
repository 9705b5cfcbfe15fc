"""Kinematics with the winches locked: free and dependent coordinates (FIDIM 2022, sec. 2.2).

Any 6 - n of the pose coordinates may serve as free ones; how well they do is a number, and the
choice matters downstream only for what was measured.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from freeswing.cdpr.model.assembly import Assembly, Follower, follow
from freeswing.cdpr.model.batch import evaluate, only
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import POSE_COORDINATES, Array, finite

RATE_SWEEPS = 3  # rigid cables are done in one
MOST_RATE_SWEEPS = 30  # cables that stretch take some 3 % of the slip along from sweep to sweep
NO_SLIP_M_S = 1e-10  # a thousandth of what a simulation refuses


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


def split_coordinates(model: Model, free: tuple[str, ...]) -> tuple[list[int], list[int]]:
    """Where the free coordinates stand in the pose, and where those that follow.

    Raises:
        ValueError: when they are not 6 - n different ones.
    """
    chosen = coordinate_indices(free)
    n = model.robot.n_cables
    if n > 5:
        raise ValueError(f"{n} cables leave no free coordinates; there are some for 1 to 5")
    if len(chosen) != 6 - n or len(set(chosen)) != 6 - n:
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
    chosen, dependent = split_coordinates(model, free)
    jacobian = evaluate(only(model.cables, 3), zeta, values)[0]
    jacobian_rate = evaluate(only(model.cable_rates, 0), zeta, rates, values)[0]
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

    Source:
        Golub, Van Loan 2013, Matrix Computations, sec. 2.6: condition, of FIDIM 2022, eq.
        (6).
    """
    values = model.start_values if values is None else values
    chosen, dependent = split_coordinates(model, free)
    size = float(np.sqrt(np.mean(np.sum(model.robot.attachments_m**2, axis=1))))
    scale = np.array([1.0, 1.0, 1.0, size, size, size])
    jacobian = evaluate(only(model.cables, 3), zeta, values)[0] / scale
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

    Closest in metres and radians per second alike.

    Args:
        model: the robot.
        zeta: pose, (6,).
        rates: wished rates, (6,).
        inertia: `INERTIA_NAMES` values, (9,).
        values: effect values, (k,).
        time_s: time since the start of the run.

    Raises:
        ValueError: for wrong shapes or numbers that are not finite.

    Source:
        FIDIM 2022, eq. (5), by the pseudo-inverse: Golub, Van Loan 2013, Matrix
        Computations, sec. 5.5.
    """
    values = model.start_values if values is None else values
    zeta, rates = finite("zeta", zeta, 6), finite("rates", rates, 6)
    jacobian = evaluate(only(model.cables, 3), zeta, values)[0]
    inverse = np.linalg.pinv(jacobian)
    for sweep in range(MOST_RATE_SWEEPS):
        slip = evaluate(model.slip, time_s, zeta, rates, inertia, values)[0]
        if sweep >= RATE_SWEEPS and np.abs(slip).max() < NO_SLIP_M_S:
            break
        rates = rates - inverse @ slip
    return rates


def assemble(
    model: Model,
    free: tuple[str, ...],
    lengths_m: Array,
    free_values: Array,
    start: Array,
    values: Array | None = None,
    tolerance_m: float = 1e-11,
) -> Assembly:
    """Dependent coordinates at given lengths, from sample to sample in one assembly mode (eq. 44).

    Args:
        model: the robot.
        free: names of the free coordinates.
        lengths_m: geometric cable lengths, (n,).
        free_values: free coordinates, (n_t, 6 - n), finite.
        start: a pose, (6,); its assembly mode is followed to the first sample and on.
        values: effect values, (k,).
        tolerance_m: residual of the lengths.

    Raises:
        ValueError: for wrong shapes or numbers that are not finite, and naming the sample at which
            the mode ends (at a singularity of the free coordinates); it never jumps to another.
    """
    values = model.start_values if values is None else values
    chosen, dependent = split_coordinates(model, free)
    follower = Follower(only(model.cables, 0, 3), values, chosen, dependent, tolerance_m)
    return follow(follower, tuple(free), lengths_m, free_values, start)
