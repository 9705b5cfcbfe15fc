"""Where in a recording the platform swings freely.

A free swing obeys one law in its own coordinates: acceleration is a smooth function of position
and velocity, linear for small swings (FIDIM 2022, eq. 37), here to second order because pulleys
and pendulums are not linear. A hand on the platform, or a platform held still away from
equilibrium, breaks it. The law is fitted to the cleanest four seconds, then extended both ways as
far as it holds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.robot import Array

# Two periods of the slowest mode of a metre of cable: less, and the law's terms fit anything.
REFERENCE_S = 4.0
_STEP_S = 0.25
_LOCAL_S = 0.3
# Residual over acceleration up to which a stretch counts as a swing: 12 % of its variance, which
# smoothed noise of small swings and their curvature may take; a hand takes most of it.
FOLLOWS = 0.35
# Local residual over the swing's acceleration that ends the free motion at first: a push of a
# quarter of it moves the platform as much as what is to be identified does. Later passes let go
# half more than what the stretch already holds.
GROWN = 0.25
# A hand that lets go is smoothed into what follows, below what ends the free motion: a third of
# `_LOCAL_S` is left out.
_MARGIN_S = 0.1
_MOST_MODES = 3
_RATE_HZ = 25.0  # enough for signals that stop at 10 Hz


def free_window(
    times_s: Array, values: Array, velocities: Array, accelerations: Array, scale: Array
) -> tuple[float, float]:
    """Start and end of the longest free swing around the cleanest stretch.

    Args:
        times_s: (n,), regular but for gaps.
        values: smoothed coordinates, (n, n_c).
        velocities: (n, n_c).
        accelerations: (n, n_c).
        scale: what makes the coordinates comparable: 1 for metres, a lever in m for angles, (n_c,).

    Raises:
        ValueError: when no stretch of `REFERENCE_S` swings freely, with how far the best is off.
    """
    step = max(1, round(1.0 / (_RATE_HZ * float(np.median(np.diff(times_s))))))
    times_s = times_s[::step]
    values, velocities, accelerations = (
        array[::step] for array in (values, velocities, accelerations)
    )
    modes = _principal(velocities * scale)
    centred = values - np.median(values, axis=0)
    value, velocity, acceleration = (
        array * scale @ modes for array in (centred, velocities, accelerations)
    )
    state = [value, velocity, acceleration]
    stretches = _stretches(times_s)
    if not stretches:
        raise ValueError(
            f"no window_s given, and {times_s[-1] - times_s[0]:.1f} s of samples hold no unbroken "
            f"{REFERENCE_S:g} s to look for a free swing in"
        )
    liveliness = np.array([np.sqrt(np.mean(acceleration[s] ** 2)) for s in stretches])
    misfit = np.array([_misfit(value, velocity, acceleration, stretch) for stretch in stretches])
    candidate = np.where(liveliness > 0.1 * np.median(liveliness), misfit, np.inf)
    best = int(np.argmin(candidate))
    if not candidate[best] <= FOLLOWS:
        raise ValueError(
            f"no window_s given and no free swing found: at best {100 * misfit[best]:.0f} % of the "
            f"acceleration does not follow from the pose (a swing leaves under "
            f"{100 * FOLLOWS:.0f} %); state window_s"
        )
    free = stretches[best]
    for _ in range(3):
        free = _grown(times_s, state, free)
    start, end = times_s[free][0], times_s[free][-1]
    return float(start + _MARGIN_S), float(end)


def _principal(velocities: Array) -> Array:
    """Directions that the motion really takes, (n_c, k): the dependent coordinates add nothing."""
    _, sizes, axes = np.linalg.svd(velocities, full_matrices=False)
    kept = min(int((sizes > 0.05 * sizes[0]).sum()), _MOST_MODES)
    return np.asarray(axes[:kept].T, dtype=np.float64)


def _stretches(times_s: Array) -> list[slice]:
    """Slices of `REFERENCE_S` without a gap, a quarter of a second apart."""
    period = float(np.median(np.diff(times_s)))
    length = round(REFERENCE_S / period) + 1
    step = max(1, round(_STEP_S / period))
    return [
        slice(first, first + length)
        for first in range(0, len(times_s) - length + 1, step)
        if times_s[first + length - 1] - times_s[first] < REFERENCE_S + 1.5 * period
    ]


def _law(value: Array, velocity: Array, acceleration: Array, where: slice) -> Array:
    """Least-squares coefficients of acceleration on the terms of the law, (n_terms, k)."""
    found = np.linalg.lstsq(_terms(value, velocity)[where], acceleration[where], rcond=None)
    return np.asarray(found[0], dtype=np.float64)


def _terms(value: Array, velocity: Array) -> Array:
    pairs = np.triu_indices(value.shape[1])
    squares = [array[:, pairs[0]] * array[:, pairs[1]] for array in (value, velocity)]
    return np.column_stack([np.ones(len(value)), value, velocity, *squares])


def _misfit(value: Array, velocity: Array, acceleration: Array, where: slice) -> float:
    """Residual of the law over the acceleration, both root mean square."""
    law = _law(value, velocity, acceleration, where)
    residual = acceleration[where] - _terms(value, velocity)[where] @ law
    size = np.sqrt(np.mean(acceleration[where] ** 2))
    return float(np.sqrt(np.mean(residual**2)) / size) if size > 0.0 else np.inf


def _grown(times_s: Array, state: list[Array], free: slice) -> slice:
    """The unbroken stretch around `free` in which the law fitted there holds."""
    value, velocity, acceleration = state
    law = _law(value, velocity, acceleration, free)
    residual = np.linalg.norm(acceleration - _terms(value, velocity) @ law, axis=1)
    period = float(np.median(np.diff(times_s)))
    local = np.sqrt(_moving_mean(residual**2, max(1, round(_LOCAL_S / period))))
    swing = np.sqrt(np.mean(np.sum(acceleration[free] ** 2, axis=1)))
    limit = max(1.5 * float(np.max(local[free])), GROWN * swing)
    holds = local <= limit
    holds[free] = True
    broken = np.concatenate([[True], np.diff(times_s) > 1.5 * period])
    start, end = free.start, free.stop - 1
    while start > 0 and holds[start - 1] and not broken[start]:
        start -= 1
    while end + 1 < len(times_s) and holds[end + 1] and not broken[end + 1]:
        end += 1
    return slice(start, end + 1)


def _moving_mean(values: Array, width: int) -> NDArray[np.float64]:
    kernel = np.ones(width)
    share = np.convolve(np.ones(len(values)), kernel, "same")
    return np.asarray(np.convolve(values, kernel, "same") / share, dtype=np.float64)
