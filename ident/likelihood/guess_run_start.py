"""Where the likelihood fit starts each run: a pose and rates at the first sample, from the samples.

Full poses are smoothed. Free coordinates alone are completed by the cable lengths; where they
pass too close to a singularity for that, small oscillations about the equilibrium are fitted.
"""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.free_motion import assemble
from freeswing.cdpr.model.statics import Equilibrium, modes
from freeswing.cdpr.robot import POSE_COORDINATES, Array
from freeswing.ident.likelihood.rest_pose import rest_near
from freeswing.ident.likelihood.run_residuals import Samples

SMOOTHED_S = (0.1, 0.15, 0.2, 0.3, 0.4)
SMOOTHED_DEGREE = 4
LEAST_SMOOTHED = 8  # samples
SMOOTH = 2.0  # times the residual over the shortest span up to which a longer one still follows
MODAL_S = 1.5
LEAD_IN = 40


def first_state(model: Model, samples: Samples, inertia: Array) -> Array:
    """Start state [zeta; rates], (12,), of a run.

    Args:
        model: the equations that the fit will use.
        samples: of the run.
        inertia: first inertia, (9,).

    Raises:
        ValueError: when the samples or lengths cannot give a state, saying why.
    """
    if samples.coordinates == POSE_COORDINATES:
        return np.concatenate(_smoothed_start(samples.times_s, samples.values))
    if samples.lengths_m is None:
        raise ValueError(
            f"run {samples.name}: only {', '.join(samples.coordinates)} are measured and "
            "cable_lengths_m is not given: give the lengths that the winches held, or measure "
            "full poses"
        )
    means = samples.values.mean(axis=0)
    columns, lengths = samples.columns, samples.lengths_m
    rest = rest_near(model, lengths, inertia, columns, means, samples.name)
    try:
        return _assembled_start(model, samples, rest)
    except (ValueError, np.linalg.LinAlgError):
        return _modal_start(model, samples, rest, inertia)


def _smoothed_start(times_s: Array, values: Array) -> tuple[Array, Array]:
    """Value and rate at the first sample of a polynomial through the first samples.

    Over as long a span as the polynomial follows: fast modes turn round within 0.4 s.
    """
    start, shortest = None, None
    for span in SMOOTHED_S:
        inside = _first(times_s, span)
        since = times_s[inside] - times_s[0]
        polynomial = np.polynomial.polynomial.polyfit(since, values[inside], SMOOTHED_DEGREE)
        off = values[inside] - np.polynomial.polynomial.polyval(since, polynomial).T
        size = np.sqrt(np.sum(off**2, axis=0) / max(1, len(since) - SMOOTHED_DEGREE - 1))
        shortest = size if shortest is None else shortest
        if start is not None and not (size <= SMOOTH * shortest).all():
            break
        start = polynomial[0], polynomial[1]
    if start is None:
        raise ValueError("no sample to start from")
    return start


def _first(times_s: Array, span_s: float) -> Array:
    """Which samples lie within a span from the first, at least so many as a start needs."""
    inside = times_s <= times_s[0] + span_s
    inside[:LEAST_SMOOTHED] = True
    return inside


def _assembled_start(model: Model, samples: Samples, rest: Equilibrium) -> Array:
    """Dependent coordinates from the lengths (FIDIM 2022, eq. 44), then smoothed."""
    inside = _first(samples.times_s, SMOOTHED_S[-1])
    free = samples.values[inside]
    fractions = np.linspace(0.0, 1.0, LEAD_IN, endpoint=False)[:, None]
    home = rest.zeta[samples.columns]
    path = np.vstack([home + fractions * (free[0] - home), free])
    names = samples.coordinates
    lengths = rest.lengths_m if samples.lengths_m is None else samples.lengths_m
    poses = assemble(model, names, lengths, path, rest.zeta).zetas[LEAD_IN:]
    return np.concatenate(_smoothed_start(samples.times_s[inside], poses))


def _modal_start(model: Model, samples: Samples, rest: Equilibrium, inertia: Array) -> Array:
    """Small oscillations (FIDIM 2022, eqs. 38, 39) fitted to the first samples."""
    shapes = modes(model, rest, inertia)
    inside = samples.times_s <= samples.times_s[0] + MODAL_S
    phase = (
        2 * np.pi * np.outer(samples.times_s[inside] - samples.times_s[0], shapes.frequencies_hz)
    )
    columns = samples.columns
    seen = shapes.shapes[columns]
    design = np.concatenate(
        [np.cos(phase)[:, None] * seen, np.sin(phase)[:, None] * seen], axis=2
    ).reshape(-1, 2 * shapes.shapes.shape[1])
    right = (samples.values[inside] - rest.zeta[columns]).reshape(-1)
    amplitudes = np.linalg.lstsq(design, right, rcond=1e-4)[0]
    cosine, sine = np.split(amplitudes, 2)
    rates = shapes.shapes @ (2 * np.pi * shapes.frequencies_hz * sine)
    return np.concatenate([rest.zeta + shapes.shapes @ cosine, rates])
