"""How swings die away: measured, by the declared model and by the one that was found.

Dry friction takes the same from every period, linear drag the same share, quadratic drag more from
the large ones: amplitude against time tells losses apart where runs are long enough.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.lengths.length_rows import measured_rates
from freeswing.ident.likelihood.fit_swings import LikelihoodFit

# Parts of a run over which speeds are averaged: two periods of the slowest mode and more.
PARTS = 5


def swing_decay(first: LikelihoodFit, final: LikelihoodFit) -> list[dict[str, Any]]:
    """Root mean square speed in each part of each run, m/s; none where poses were not measured.

    The speed is that of a point mass of the same kinetic energy, so that all directions and turns
    count: its square falls as the energy of the swing does.

    Args:
        first: without effects.
        final: with those that were found; of the same runs.
    """
    model = build_model(final.model.robot)
    told = []
    for before, after, samples in zip(first.motions, final.motions, final.samples, strict=True):
        if not samples.is_pose:
            return []
        times, inertia = samples.times_s, final.inertia
        states = [(samples.values, measured_rates(times, samples.values))]
        states += [motion.at(times)[:2] for motion in (before, after)]
        speeds = [_speeds(model, *state, inertia) for state in states]
        edges = np.linspace(times[0], times[-1], PARTS + 1)
        which = np.clip(np.searchsorted(edges, times, side="right") - 1, 0, PARTS - 1)
        measured, declared, found = (_means(one, which).tolist() for one in speeds)
        middles = (0.5 * (edges[1:] + edges[:-1]) - times[0]).tolist()
        told.append(
            {
                "run": samples.name,
                "times_s": middles,
                "measured_m_s": measured,
                "before_m_s": declared,
                "after_m_s": found,
            }
        )
    return told


def _speeds(model: Model, zetas: Array, rates: Array, inertia: Array) -> Array:
    """Squared speeds of a point of the same kinetic energy, (n,)."""
    mass = evaluate(model.mass_matrix, zetas, inertia, model.start_values)[0]
    return np.einsum("ti,tij,tj->t", rates, mass, rates)


def _means(squares: Array, which: np.ndarray) -> Array:
    count = np.bincount(which, minlength=PARTS)
    total = np.bincount(which, squares, minlength=PARTS)
    return np.sqrt(total / np.maximum(count, 1))
