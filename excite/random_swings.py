"""Random swings, as large as the limits let them be: the library that plans are chosen from."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.model.statics import Equilibrium, equilibrium_at_lengths
from freeswing.excite.swing import (
    Bench,
    Course,
    Swing,
    furthest,
    in_workspace,
    keeps_limits,
    released,
    swing_from,
    workspace,
)

_PROBE_S = 2.5
_MARGIN = 0.97
_TRIES = 4


def random_swing(bench: Bench, rng: np.random.Generator, most_tries: int = 400) -> Swing:
    """A random equilibrium and a random release from it, as large as the limits let it be.

    Raises:
        ValueError: when `most_tries` random poses give no swing within the limits.
    """
    for _ in range(most_tries):
        equilibrium = _random_equilibrium(bench, rng)
        if equilibrium is None:
            continue
        try:
            swing = _largest_swing(bench, equilibrium, rng)
        except (ValueError, np.linalg.LinAlgError):
            continue
        if swing is not None and keeps_limits(bench, swing):
            return swing
    raise ValueError(
        f"none of {most_tries} random poses gives a swing within the limits "
        f"{bench.limits.tension_N} N: widen them, or check platform.mass_kg"
    )


def _largest_swing(bench: Bench, rest: Equilibrium, rng: np.random.Generator) -> Swing | None:
    """Scale a random push until the first limit is met, by short simulations, then simulate."""
    push = rng.standard_normal(6 - bench.model.robot.n_cables)
    push *= 0.05 / np.linalg.norm(push)
    for attempt in range(_TRIES):
        pose = released(bench, rest, push)
        course = bench.course(pose, _PROBE_S, 1e-6)
        room = _room(bench, course, rest)
        if attempt and 1.0 <= room < 1.15:
            break
        push = push * np.clip(_MARGIN * room, 0.25, 4.0)
    for shrink in (1.0, 0.93, 0.85):
        swing = swing_from(bench, released(bench, rest, shrink * push), rest)
        if keeps_limits(bench, swing):
            return swing
    return None


def _room(bench: Bench, course: Course, rest: Equilibrium) -> float:
    """How many times larger the swing could be, if everything grew with its size."""
    low, high = bench.limits.tension_N
    still = bench.mass_kg * rest.tensions
    drop = np.maximum(still - course.tensions_N.min(axis=0), 1e-9)
    rise = np.maximum(course.tensions_N.max(axis=0) - still, 1e-9)
    reach = np.maximum(furthest(bench, course, rest), 1e-9)
    ratios = [(still - low) / drop, (high - still) / rise, bench.reach_limits / reach]
    return float(max(min(ratio.min() for ratio in ratios), 0.0))


def _random_equilibrium(bench: Bench, rng: np.random.Generator) -> Equilibrium | None:
    low, high = workspace(bench)
    tilt = np.array([0.3, 0.3, 0.7]) * rng.uniform(-1, 1, 3)
    pose = np.concatenate([rng.uniform(low, high), tilt])
    try:
        rest = equilibrium_at_lengths(bench.model, bench.lengths(pose), pose, bench.inertia)
    except np.linalg.LinAlgError:
        return None
    if rest is None or not (rest.stable and rest.taut):
        return None
    tensions, limits = bench.mass_kg * rest.tensions, bench.limits
    is_taut = tensions.min() > 1.05 * limits.tension_N[0]
    is_light = tensions.max() < 0.97 * limits.tension_N[1]
    is_clear = bench.amplification(rest.zeta[None]) < 0.9 * limits.amplification
    is_upright = np.abs(rest.zeta[3:5]).max() < 1.0
    fits = is_taut and is_light and is_clear and is_upright and in_workspace(bench, rest.zeta)
    return rest if fits else None
