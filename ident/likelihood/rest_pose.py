"""Where a platform rests, in the angle branch in which it was measured.

R = Rx(phi) Ry(theta) Rz(chi) names an orientation twice, (phi, theta, chi) and
(phi + pi, pi - theta, chi + pi), and each angle up to whole turns. What is measured has taken one
of these names; a rest pose from a search has taken any.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.statics import Equilibrium, equilibrium_at_lengths, random_poses
from freeswing.cdpr.robot import Array
from freeswing.cdpr.rotation import angles_from_matrix, exp_rotation

STARTS = 12
FURTHER_STARTS = 40  # anywhere below the pulleys, where no hanging pose leads to a rest
TURN = 2.0 * np.pi
TILTED_RAD = 0.5  # starts about the platform's hanging orientation: up to 30 degrees off
SAME_M = 1e-6  # two searches that end so close have found one rest pose


def branches(zeta: Array) -> tuple[Array, Array]:
    """The two names of a pose (6,)."""
    other = np.array(zeta)
    other[3:] = zeta[3] + np.pi, np.pi - zeta[4], zeta[5] + np.pi
    return np.array(zeta), other


def named_like(zeta: Array, columns: Sequence[int], measured: Array) -> Array:
    """The name of a pose (6,) whose coordinates are nearest to measured ones.

    Args:
        zeta: the pose.
        columns: which coordinates were measured.
        measured: their values, (len(columns),); NaN: not known.

    Angles that were not measured come out within half a turn of zero.

    Source:
        Ida, Merlet, Carricato 2019, eq. (1): two sets of angles for every rotation.
    """
    target = np.zeros(6)
    known = np.zeros(6, dtype=bool)
    for place, value in zip(columns, measured, strict=True):
        if np.isfinite(value):
            target[place], known[place] = value, True
    best, least = np.array(zeta), np.inf
    for one in branches(zeta):
        one[3:] -= TURN * np.round((one[3:] - target[3:]) / TURN)
        # Among equals the smaller angles: a tie must not be settled by rounding errors.
        off = one - target
        cost = float(np.sum(off[known] ** 2) + 1e-6 * np.sum(off[3:] ** 2))
        if cost < least:
            best, least = one, cost
    return best


def rest_near(
    model: Model,
    lengths_m: Array,
    inertia: Array,
    columns: Sequence[int],
    measured: Array,
    run: str,
) -> Equilibrium:
    """The stable rest pose with taut wires that is nearest to measured coordinates.

    Args:
        model: the robot.
        lengths_m: wire lengths, (n,).
        inertia: `INERTIA_NAMES` values, (9,).
        columns: which coordinates were measured.
        measured: their means over the run.
        run: its name, for messages.

    Raises:
        ValueError: when there is none.
    """
    good = _rests(model, lengths_m, inertia, hanging_poses(model, lengths_m, inertia, STARTS))
    if not good:
        anywhere = random_poses(model, np.random.default_rng(0), FURTHER_STARTS)
        good = _rests(model, lengths_m, inertia, anywhere)
    if not good:
        raise ValueError(
            f"run {run}: no stable rest pose with taut wires at lengths {np.round(lengths_m, 4)} "
            "m: check cable_lengths_m, the geometry and com_m"
        )
    named = [named_like(one.zeta, columns, measured) for one in good]
    off = [np.nansum((zeta[list(columns)] - measured) ** 2) for zeta in named]
    best = int(np.argmin(off))
    rest = good[best]
    return Equilibrium(named[best], rest.lengths_m, rest.tensions, True, True)


def _rests(model: Model, lengths_m: Array, inertia: Array, starts: Array) -> list[Equilibrium]:
    """The different stable rest poses with taut wires that searches from some starts end in."""
    good: list[Equilibrium] = []
    for start in starts:
        one = equilibrium_at_lengths(model, lengths_m, start, inertia)
        if one is None or not (one.stable and one.taut):
            continue
        if not any(np.abs(one.zeta - known.zeta).max() < SAME_M for known in good):
            good.append(one)
    return good


def hanging_poses(model: Model, lengths_m: Array, inertia: Array, count: int) -> Array:
    """Poses (count, 6) to look for a rest pose from, the hanging one first.

    The platform hangs as its attachments match the entries and its centre of mass lies lowest
    (Kabsch 1976): so the poses turn with the frames, whatever way their axes point.
    """
    robot = model.robot
    entries, attachments = robot.entries_m, robot.attachments_m
    down = robot.gravity_m_s2 / np.linalg.norm(robot.gravity_m_s2)
    above, below = entries - entries.mean(axis=0), attachments - attachments.mean(axis=0)
    flat = above - np.outer(above @ down, down)
    low = inertia[:3] - attachments.mean(axis=0)
    # Across all wires the centre of mass points down; where it lies among them it says nothing.
    left, _, right = np.linalg.svd(flat.T @ below + np.outer(down, low) * np.linalg.norm(above))
    sign = np.diag([1.0, 1.0, np.linalg.det(left @ right)])
    hanging = left @ sign @ right
    generator = np.random.default_rng(0)
    found = []
    for index in range(count):
        off = generator.uniform(-1.0, 1.0, 3) * (TILTED_RAD if index else 0.0)
        rotation = hanging @ exp_rotation(off)
        depth = float(np.mean(lengths_m)) * (1.0 - 0.5 * generator.uniform() * (index > 0))
        place = entries.mean(axis=0) + depth * down - rotation @ attachments.mean(axis=0)
        found.append(np.concatenate([place, angles_from_matrix(rotation[None])[0]]))
    return np.array(found)


def taut_equilibrium(model: Model, lengths_m: Array, inertia: Array, run: str) -> Equilibrium:
    """The stable rest pose with taut wires where nothing was measured: that of small angles.

    Raises:
        ValueError: when none is found, naming the run.
    """
    return rest_near(model, lengths_m, inertia, (), np.zeros(0), run)
