"""Start poses to try where the stated tensions lead nowhere: many directions and scales of tension.

The stated tensions serve only as a first guess (FORMATS, "Start pose and excitation"), and may be
far off. Rest poses of eq. (9) at many tensions are cheap, and so is what each of them leaves of the
readings when every other pose follows from the readings alone: the best few are worth a whole fit.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from freeswing.homing.fit_start_pose import LOSS_LIMIT
from freeswing.homing.guess_from_tensions import TensionEnergy, stable_starts

if TYPE_CHECKING:
    from freeswing.homing.fit_start_pose import StartProblem
    from freeswing.homing.homing_files import ReadingNoise, Readings

Array = NDArray[np.float64]

# Sums of all tensions over the weight: a suspended platform hangs at 1.05 with steep cables, at 4
# with flat ones; beyond, the cables of the robots known to us are stretched almost straight.
SCALES = (1.05, 1.4, 2.0, 2.8, 4.0)
# One cable against another: a factor of 1.7 either way, which downhill steps bridge.
FACTORS = (0.6, 1.0, 1.7)
WORTH_A_FIT = 12  # of the ranked starts: with 13 rows a fit takes a tenth of a second
ROWS = 13  # that lie far apart tell a wrong start as surely as all of them, and five times sooner
_STEPS = 20
_DAMPING = 1e-6
_SMALLEST_STEP = 1e-7


def many_starts(energy: TensionEnergy, n_cables: int) -> Array:
    """Distinct stable rests over tension direction and scale, (k, 6).

    Source:
        Ida, Merlet, Carricato 2019, eq. (9), over many tensions.
    """
    factors = FACTORS if n_cables < 4 else (FACTORS[0], FACTORS[2])
    shares = np.array(list(itertools.product(factors, repeat=n_cables)))
    shares = np.unique(np.round(shares / shares.sum(axis=1, keepdims=True), 9), axis=0)
    found = []
    for scale in SCALES:
        even = stable_starts(energy, np.full(n_cables, scale / n_cables))
        for pose in even:
            rest = energy.settle(np.tile(pose, (len(shares), 1)), scale * shares)
            found.append(np.concatenate([pose[None], rest.poses[rest.settled]]))
    if not found:
        return np.zeros((0, 6))
    poses = np.concatenate(found)
    _, first = np.unique(np.round(poses, 3), axis=0, return_index=True)
    return poses[np.sort(first)]


def far_rows(readings: Readings) -> NDArray[np.intp]:
    """The start's row and those whose readings lie farthest apart, `ROWS` of them, rising.

    Source:
        Gonzalez 1985, Clustering to Minimize the Maximum Intercluster Distance.
    """
    table = np.nan_to_num(np.hstack([readings.sigma_rad, readings.length_m]))
    chosen, distance = [0], np.linalg.norm(table - table[0], axis=1)
    while len(chosen) < min(ROWS, len(table)):
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(table - table[chosen[-1]], axis=1))
    return np.sort(chosen)


def rank_starts(problem: StartProblem, noise: ReadingNoise, starts: Array) -> list[Array]:
    """Poses (N, 6) of the starts that explain the readings best, the best first.

    A start tells what swivels and lengths a reading of zero stands for; every other pose follows
    from its readings, begun at the pose with the nearest readings, which are steps of a procedure.

    Args:
        problem: the readings and their model.
        noise: of the readings.
        starts: start poses, (k, 6).

    Source:
        Ida, Merlet, Carricato 2019, eqs. (16) to (21).
    """
    borders = np.array([problem.start_border(start)[: 2 * problem.n] for start in starts])
    poses = np.repeat(starts[:, None], len(problem.data), axis=1)
    costs = np.zeros(len(starts))
    for row, parent in _by_neighbours(problem.whitened_readings(noise)):
        poses[:, row], cost = _place(problem, noise, row, poses[:, parent], borders)
        costs += cost
    order = np.argsort(costs)[:WORTH_A_FIT]
    return [poses[k] for k in order if np.isfinite(costs[k])]


def _by_neighbours(readings: Array) -> list[tuple[int, int]]:
    """Rows with the row that each is begun from: the nearest of those placed before (Prim)."""
    distance = np.linalg.norm(readings - readings[0], axis=1)
    parent = np.zeros(len(readings), dtype=int)
    left, order = set(range(1, len(readings))), []
    while left:
        row = min(left, key=lambda k: (distance[k], k))
        left.remove(row)
        order.append((row, int(parent[row])))
        nearer = np.linalg.norm(readings - readings[row], axis=1)
        parent = np.where(nearer < distance, row, parent)
        distance = np.minimum(distance, nearer)
    return order


def _place(
    problem: StartProblem, noise: ReadingNoise, row: int, begun: Array, borders: Array
) -> tuple[Array, Array]:
    """One row's pose for every start (k, 6), and half its robust sum of squares (k,).

    Found by plain least squares, since a row has hardly more readings than unknowns.
    """
    poses, best, costs = begun, begun, np.full(len(begun), np.inf)
    damping = np.full(len(begun), _DAMPING)
    residuals, slopes = problem.one_row(noise, row, poses, borders)
    for _ in range(_STEPS):
        trial = 0.5 * (residuals**2).sum(axis=1)
        better = trial < costs  # false where a pose has left the model's domain
        costs, best = np.where(better, trial, costs), np.where(better[:, None], poses, best)
        damping = np.where(better, np.maximum(damping / 10, _DAMPING), damping * 30)
        if not better.all():
            residuals, slopes = problem.one_row(noise, row, best, borders)
        residuals, slopes = np.nan_to_num(residuals), np.nan_to_num(slopes)
        normal = slopes.swapaxes(1, 2) @ slopes
        diagonal = np.einsum("kpp->kp", normal)
        np.einsum("kpp->kp", normal)[...] += damping[:, None] * diagonal + 1e-12
        step = -np.linalg.solve(normal, np.einsum("kmp,km->kp", slopes, residuals)[..., None])[
            ..., 0
        ]
        poses = best + step
        if np.abs(step).max() < _SMALLEST_STEP:
            break
        residuals, slopes = problem.one_row(noise, row, poses, borders)
    final = _huber(problem.one_row(noise, row, best, borders)[0])
    return best, np.where(np.isfinite(costs), final, np.inf)


def _huber(residuals: Array) -> Array:
    size = np.abs(residuals)
    inside = np.minimum(size, LOSS_LIMIT)
    return (0.5 * inside**2 + LOSS_LIMIT * (size - inside)).sum(axis=1)
