"""One run of a scene: draw a rest pose and a release, integrate, check that cables stay taut."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tests.oracle.mechanics.equilibrium import (
    NoEquilibriumError,
    Rest,
    coordinate_condition,
    displaced,
    lengths_at,
    settle,
    tensions_at_rest,
)
from tests.oracle.mechanics.geometry import turn
from tests.oracle.mechanics.newton_euler import Motion, simulate
from tests.oracle.mechanics.world import Array, World
from tests.oracle.scenes.effects import Scene, random_direction

LEAST_REST_TENSION_N = 6.0
LEAST_TENSION_N = 2.0
MOST_TILT_RAD = 0.5
MOST_DRAWS = 300
REACH_M = (0.02, 0.05)
REACH_RAD = (math.radians(4.0), math.radians(10.0))
# Box of P and spread of the heading that rest poses are searched from, by number of cables.
WORKSPACE = {
    4: ((0.75, -0.55, -0.75), (1.55, 0.30, -0.15), 0.0, 0.15),
    3: ((-1.60, 0.70, -0.90), (-1.10, 1.25, -0.30), -0.55, 0.20),
}


@dataclass(frozen=True, slots=True)
class TrueRun:
    """What really happened in one run.

    Attributes:
        world: physics with the run's own lengths, phases and stop.
        rest: the rest pose.
        release_m: P where the platform was let go, (3,).
        release_quaternion: w, x, y, z there, (4,).
        motion: the free motion that followed.
        draws: tries it took.
    """

    world: World
    rest: Rest
    release_m: Array
    release_quaternion: Array
    motion: Motion
    draws: int


def workspace(n_cables: int) -> tuple[Array, Array, float, float]:
    """Lower and upper corner of the search box, heading and its half width."""
    low, high, heading, spread = WORKSPACE[n_cables]
    return np.array(low), np.array(high), heading, spread


def draw_run(
    scene: Scene,
    rng: np.random.Generator,
    duration_s: float,
    rate_hz: float,
    free_rows: tuple[int, ...] | None = None,
    reach_share: float = 1.0,
) -> TrueRun:
    """A run with all cables taut throughout; draws again until there is one.

    Args:
        scene: the truth, effects included.
        rng: source of the draws.
        duration_s: length of the free motion.
        rate_hz: sampling rate.
        free_rows: pose rows that alone will be measured; they must then describe the motion well.
        reach_share: scales the displacement that the platform is released from.

    Raises:
        NoEquilibriumError: after 300 fruitless draws.
    """
    for draw in range(1, MOST_DRAWS + 1):
        world = _run_world(scene, rng)
        try:
            world, rest = _draw_rest(world, rng, free_rows)
        except NoEquilibriumError:
            continue
        way = rng.normal(size=rest.freedom.shape[1])
        reach = reach_share * rng.uniform(*REACH_M), reach_share * rng.uniform(*REACH_RAD)
        p, q = displaced(world, rest, way, *reach)
        if tensions_at_rest(world, p, q).min() < 2.0 * LEAST_TENSION_N:
            continue
        world = _with_stop(scene, world, rest, p)
        motion = simulate(world, p, q, duration_s, rate_hz=rate_hz)
        if motion.tensions_n.min() >= LEAST_TENSION_N:
            return TrueRun(world, rest, p, q, motion, draw)
    raise NoEquilibriumError(f"no run with taut cables in {MOST_DRAWS} draws")


def _run_world(scene: Scene, rng: np.random.Generator) -> World:
    if not scene.random_phase:
        return scene.world
    rows = scene.world.oscillators.copy()
    rows[:, 1] = rng.uniform(0.0, math.tau, len(rows))
    return scene.world._replace(oscillators=rows, hunting_phase=rng.uniform(0.0, math.tau))


def _draw_rest(
    world: World, rng: np.random.Generator, free_rows: tuple[int, ...] | None
) -> tuple[World, Rest]:
    low, high, heading, spread = workspace(len(world.radius))
    p, q = rng.uniform(low, high), np.array([1.0, 0.0, 0.0, 0.0])
    turn(q, np.array([0.0, 0.0, heading + rng.uniform(-spread, spread)]))
    turn(q, rng.uniform(0.0, 0.08) * random_direction(rng, flat=True))
    world = world._replace(length=lengths_at(world, p, q))
    rest = settle(world, p, q)
    tilt = 2.0 * math.asin(min(1.0, math.hypot(rest.quaternion[1], rest.quaternion[2])))
    away = float(np.linalg.norm(rest.position_m - p))
    if not rest.stable or rest.tensions_n.min() < LEAST_REST_TENSION_N:
        raise NoEquilibriumError(f"stable {rest.stable}, tensions {rest.tensions_n} N")
    if tilt > MOST_TILT_RAD or away > 0.35:
        raise NoEquilibriumError(f"tilt {tilt:.2f} rad, {away:.2f} m from where it was sought")
    if free_rows is not None and coordinate_condition(rest, free_rows) > 6.0:
        raise NoEquilibriumError("the measured coordinates describe the motion poorly")
    return world, rest


def _with_stop(scene: Scene, world: World, rest: Rest, release_m: Array) -> World:
    """A stop on the far side of the rest pose, reached at a share of the displacement."""
    if scene.stop_share is None:
        return world
    way = rest.position_m - release_m
    normal = way / np.linalg.norm(way)
    lift = world.com[2] * np.array([0.0, 0.0, 1.0])
    offset = float(normal @ (rest.position_m + lift) + scene.stop_share * np.linalg.norm(way))
    return world._replace(wall_normal=normal, wall_offset=offset)
