"""How a free motion answers to its initial state, the inertia and the effects: exact derivatives.

The collocation equations of every segment are linearised at once; one small solve a segment gives
its transition, and the chain of transitions the whole motion. The motion may violate the
equations: then the same solve gives the Newton correction (lifted, or multiple, shooting), so
long runs can start from measured samples instead of a simulation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cdpr.batch import evaluate, with_jacobian
from cdpr.collocation import interpolation, table
from cdpr.robot import Array
from cdpr.simulation import Motion


@dataclass(frozen=True, slots=True)
class Linearised:
    """A motion's first-order answer to its unknowns u = [zeta_0; rates_0; inertia; values].

    Columns are the 12 + 9 + k unknowns and, last, the correction at unchanged unknowns that
    closes the gaps of a motion that does not yet obey its equations (zero for a simulated one).

    Attributes:
        motion: the motion.
        states: change of [zeta; rates] at the segment starts, (s, 12, c + 1).
        accelerations: change of the node accelerations, (s, m, 6, c + 1).
        gap: largest violation of the equations, in metres and radians a segment.
    """

    motion: Motion
    states: Array
    accelerations: Array
    gap: float

    def at(self, times_s: Array) -> tuple[Array, Array]:
        """Change of zeta and of the rates at times (n,), each (n, 6, c + 1)."""
        motion = self.motion
        index, fractions = motion.locate(times_s)
        step = motion.steps_s[index, None, None]
        _, once, twice = interpolation(motion.accelerations.shape[1], fractions)
        changes = self.accelerations[index]
        start = self.states[index]
        rates = start[:, 6:] + step * np.einsum("nm,nmcp->ncp", once, changes)
        zetas = start[:, :6] + step * fractions[:, None, None] * start[:, 6:]
        return zetas + step**2 * np.einsum("nm,nmcp->ncp", twice, changes), rates

    def moved(self, change: Array) -> Motion:
        """The motion after a Newton step in the unknowns, (12 + 9 + k,)."""
        full = np.append(change, 1.0)
        states = self.states @ full
        motion = self.motion
        return replace(
            motion,
            inertia=motion.inertia + change[12:21],
            values=motion.values + change[21:],
            zetas=motion.zetas + states[:, :6],
            rates=motion.rates + states[:, 6:],
            accelerations=motion.accelerations + self.accelerations @ full,
        )


def linearise(motion: Motion) -> Linearised:
    """First-order answer of a motion to its unknowns.

    Args:
        motion: simulated, or a guess that does not obey the equations exactly.
    """
    t = table(motion.accelerations.shape[1])
    step = motion.steps_s[:, None, None]
    zetas = (
        motion.zetas[:, None]
        + step * t.nodes[:, None] * motion.rates[:, None]
        + step**2 * (t.twice @ motion.accelerations)
    )
    rates = motion.rates[:, None] + step * (t.once @ motion.accelerations)
    times = motion.starts_s[:, None] + motion.steps_s[:, None] * t.nodes
    function = with_jacobian(motion.model.acceleration, (1, 2, 3, 4))
    force, slopes = evaluate(function, times, zetas, rates, motion.inertia, motion.values)
    changes = _segment_changes(motion, force - motion.accelerations, slopes)
    states, gap = _chained(motion, changes)
    total = _in_unknowns(changes, states)
    defect = np.abs(motion.steps_s[:, None, None] ** 2 * (force - motion.accelerations)).max()
    return Linearised(motion, states, total, max(gap, float(defect)))


def _segment_changes(motion: Motion, defect: Array, slopes: Array) -> Array:
    """Node acceleration changes by [zeta_s; rates_s; inertia; values; 1], (s, m, 6, c + 1)."""
    s, m, _ = defect.shape
    t = table(m)
    by_zeta, by_rates, by_rest = slopes[..., :6], slopes[..., 6:12], slopes[..., 12:]
    step = motion.steps_s[:, None, None]
    right = np.concatenate(
        [
            by_zeta,
            by_rates + by_zeta * (step * t.nodes[:, None])[..., None],
            by_rest,
            defect[..., None],
        ],
        axis=-1,
    )
    step = step[..., None, None]
    matrix = -(step**2) * (t.twice[:, None, :, None] * by_zeta[:, :, :, None, :])
    matrix -= step * (t.once[:, None, :, None] * by_rates[:, :, :, None, :])
    matrix = matrix.reshape(s, 6 * m, 6 * m)
    matrix[:, np.arange(6 * m), np.arange(6 * m)] += 1.0
    return np.linalg.solve(matrix, right.reshape(s, 6 * m, -1)).reshape(s, m, 6, -1)


def _chained(motion: Motion, changes: Array) -> tuple[Array, float]:
    """State changes at the segment starts by the unknowns, and the largest gap between them."""
    s, m, _, columns = changes.shape
    t = table(m)
    step = motion.steps_s[:, None, None]
    ends = np.concatenate(
        [
            step**2 * np.einsum("m,smcp->scp", t.twice_end, changes),
            step * np.einsum("m,smcp->scp", t.once_end, changes),
        ],
        axis=1,
    )
    ends[:, np.arange(12), np.arange(12)] += 1.0
    ends[:, np.arange(6), np.arange(6, 12)] += motion.steps_s[:, None]
    states = np.zeros((s, 12, columns))
    states[0, np.arange(12), np.arange(12)] = 1.0
    jumps = _jumps(motion)
    for k in range(s - 1):
        states[k + 1] = ends[k, :, :12] @ states[k]
        states[k + 1, :, 12:] += ends[k, :, 12:]
        states[k + 1, :, -1] += jumps[k]
    return states, float(np.abs(jumps[:, :6]).max(initial=0.0))


def _jumps(motion: Motion) -> Array:
    """End state of each segment minus the start of the next, (s - 1, 12)."""
    t = table(motion.accelerations.shape[1])
    step = motion.steps_s[:, None]
    zetas = motion.zetas + step * motion.rates
    zetas = zetas + step**2 * np.einsum("m,smc->sc", t.twice_end, motion.accelerations)
    rates = motion.rates + step * np.einsum("m,smc->sc", t.once_end, motion.accelerations)
    return np.hstack([zetas, rates])[:-1] - np.hstack([motion.zetas, motion.rates])[1:]


def _in_unknowns(changes: Array, states: Array) -> Array:
    """Node acceleration changes by the unknowns of the whole motion, (s, m, 6, c + 1)."""
    total = np.einsum("smcx,sxp->smcp", changes[..., :12], states, optimize=True)
    total[..., 12:] += changes[..., 12:]
    return total
