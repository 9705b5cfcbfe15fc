"""Robots, equilibria and swings that the tests of the model share."""

import sys

import numpy as np
import pytest

from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.free_motion import (
    admissible_rates,
    assemble,
    choose_free_coordinates,
    coordinate_indices,
)
from freeswing.cdpr.model.statics import equilibrium_at_lengths
from freeswing.cdpr.robot import Cable, Platform, Robot
from freeswing.cdpr.rotation import matrix_from_angles, quaternion_from_matrix
from tests.oracle.mechanics.world import Body
from tests.oracle.scenes.robots import declared_robot, with_eyelets

TABLE_2 = np.array(
    [
        [1.66, 1.32, 1.30, 1.52, 1.11, 1.38, 1.19, 1.16, 1.46, 1.43, 1.35, 1.52],
        [1.86, 1.58, 1.26, 1.26, 1.68, 1.39, 1.15, 1.17, 1.16, 1.37, 1.45, 1.12],
        [1.68, 1.99, 1.57, 1.27, 2.19, 1.36, 1.65, 1.63, 1.24, 1.27, 1.42, 1.17],
        [1.41, 1.76, 1.56, 1.50, 1.72, 1.32, 1.65, 1.59, 1.50, 1.30, 1.28, 1.54],
    ]
).T
MIDDLE = {
    "bologna-4": np.array([1.2, -0.2, -0.6, 0.0, 0.0, 0.0]),
    "three-cable": np.array([-1.36, 0.96, -0.46, 0.0, 0.0, -0.55]),
}
ROBOTS = ("bologna-4", pytest.param("three-cable", marks=pytest.mark.slow))


def robot_named(name, eyelets=False):
    robot = declared_robot(name)
    return with_eyelets(robot) if eyelets else robot


def ring(n, radius=0.03):
    """N cables round a platform that hangs below."""
    rng = np.random.default_rng(n)
    cables = []
    for k, a in enumerate(np.linspace(0.1, 0.1 + 2 * np.pi, n, endpoint=False)):
        out = np.array([np.cos(a), np.sin(a), 0.0])
        side = np.array([-np.sin(a), np.cos(a), 0.0])
        entry = 1.3 * out + [0.1, 0.0, 1.0] + rng.normal(0, 0.05, 3)
        attachment = 0.2 * out + [0.0, 0.0, 0.15] + rng.normal(0, 0.03, 3)
        down, inward = np.array([0.0, 0.0, -1.0]), -out
        cables.append(Cable(str(k + 1), entry, radius, attachment, inward, -side, down))
    platform = Platform(8.0, [0.0, 0.01, 0.1], [0.05, 0.06, 0.04, 0.001, -0.002, 0.0015])  # pyright: ignore[reportArgumentType]
    return Robot(f"ring-{n}", tuple(cables), platform=platform)


def random_states(robot, count, seed=0, spread=0.06, speed=0.4):
    """Poses and rates near the middle of a robot's workspace, (count, 6) each."""
    rng = np.random.default_rng(seed)
    middle = MIDDLE.get(robot.name, np.zeros(6))
    zetas = middle + spread * rng.normal(size=(count, 6))
    return zetas, speed * rng.normal(size=(count, 6))


def true_inertia(robot, seed=0):
    """The nominal inertia with all products of inertia present, (9,)."""
    rng = np.random.default_rng(seed)
    return robot.inertia + rng.normal(0.0, [0.005] * 3 + [0.001] * 3 + [0.0005] * 3)


def body_of(inertia, mass_kg=8.0):
    return Body(mass_kg, inertia[:3], inertia[3:])


def rest_of(model, inertia, lengths=None):
    name = model.robot.name
    lengths = TABLE_2[0] if lengths is None and name == "bologna-4" else lengths
    if lengths is None:
        lengths = evaluate(model.lengths, MIDDLE[name], model.start_values)[0]
    rest = equilibrium_at_lengths(model, lengths, MIDDLE[name], inertia)
    if rest is None or not (rest.stable and rest.taut):
        raise ValueError(f"{name} does not hang at {lengths}")
    return rest


def released(model, rest, way=0.1):
    """A pose (6,) `way` of the best free coordinates away from rest, at the same lengths."""
    free = choose_free_coordinates(model, rest.zeta[None])[0]
    shift = way * np.array([1.0, 0.7, -0.5])[: len(free)]
    path = rest.zeta[coordinate_indices(free)] + np.linspace(0, 1, 20)[:, None] * shift
    return assemble(model, free, rest.lengths_m, path, rest.zeta).zetas[-1]


def swing_start(name, effects=(), eyelets=False, speed=0.1, way=0.1, values=None):
    """Model, inertia, pose and rates of a swing that keeps all cables taut."""
    model = build_model(robot_named(name, eyelets), effects)
    rigid = build_model(model.robot)
    inertia = true_inertia(model.robot)
    zeta = released(rigid, rest_of(rigid, inertia), way)
    wish = speed * np.random.default_rng(5).normal(size=6)
    return model, inertia, zeta, admissible_rates(model, zeta, wish, inertia, values)


def differences(function, at, step=1e-5):
    """Central differences of order six of a function by a vector, columns last."""
    weights = ((1, 0.75), (2, -0.15), (3, 1 / 60))
    columns = []
    for k in range(len(at)):
        move = np.zeros(len(at))
        move[k] = step
        slopes = [w * (function(at + m * move) - function(at - m * move)) for m, w in weights]
        columns.append(sum(slopes) / step)
    return np.stack(columns, axis=-1)


def pose_of(zeta):
    """Position and quaternion w x y z of pose coordinates (6,)."""
    return zeta[:3], quaternion_from_matrix(matrix_from_angles(zeta[3:]))


def twist_of(model, zeta, rates):
    return evaluate(model.twist_map, zeta, rates)[0] @ rates


def report(*parts):
    """A line that pytest shows with -s, or where a test fails."""
    sys.stdout.write(" ".join(map(str, parts)) + "\n")
