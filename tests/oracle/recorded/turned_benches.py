"""A bench with an object in several orientations: its whole tensor, as a user would have recorded.

Two wires leave roll free beside yaw: each orientation shows two moments of the object and the
product between them. Three leave yaw alone: each orientation shows the moment about the vertical,
so that six tell the tensor. What the files do not say: drag.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.oracle.mechanics.world import Array, Body, World, plain_world
from tests.oracle.recorded.benches import (
    DECLARED_KG,
    DRAG_N_M_S,
    GRAVITY,
    LOAD_COM_M,
    LOAD_KG,
    PLATFORM_COM_M,
    PLATFORM_KG_M2,
    RATE_HZ,
    UNWANTED_M_S,
    WIRE_M,
    _ends,
    _record,
    _swing,
    _write_robot,
)

# Three ways to lay an object: as it is, on its side, on its front; each as a quaternion w x y z.
HALF = float(np.sqrt(0.5))
LAID = ((1.0, 0.0, 0.0, 0.0), (HALF, HALF, 0.0, 0.0), (HALF, 0.0, HALF, 0.0))
# Three more on a wedge: the vertical halfway between two of its axes, each pair in turn.
COS, SIN = float(np.cos(np.pi / 8.0)), float(np.sin(np.pi / 8.0))
WEDGED = (
    (COS, SIN, 0.0, 0.0),
    (COS, 0.0, SIN, 0.0),
    (HALF * COS, HALF * COS, -HALF * SIN, HALF * SIN),
)
WAYS = {2: LAID, 3: (*LAID, *WEDGED)}  # that tell a whole tensor, by the number of wires
UNDER_M = np.array([0.01, -0.005, -0.06])  # its origin below the wires' ends: roll is then stable
MOMENTS_KG_M2 = np.array([0.0062, 0.0071, 0.0093])
AXES = (0.35, -0.2, 0.5)  # rad, about x, y, z: its principal axes are nobody's


@dataclass(frozen=True, slots=True)
class TurnedTruth:
    """The object: tensor about its own centre in its own frame, (3, 3), and that centre."""

    tensor_kg_m2: Array
    com_m: Array


def turn_of(quaternion: tuple[float, float, float, float]) -> Array:
    """R of a unit quaternion w x y z."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _object_tensor() -> Array:
    axes = np.eye(3)
    for axis, angle in zip(np.eye(3), AXES, strict=True):
        axes = axes @ turn_of((np.cos(angle / 2), *(np.sin(angle / 2) * axis).tolist()))
    return np.asarray(axes @ np.diag(MOMENTS_KG_M2) @ axes.T)


def make_turned_bench(
    folder: Path,
    seed: int,
    duration_s: float = 10.0,
    each: int = 2,
    wires: int = 2,
    ways: Sequence[tuple[float, float, float, float]] | None = None,
    wider: float = 1.0,
    swayed_m_s: float = UNWANTED_M_S,
) -> TurnedTruth:
    """Write the session: `each` runs of the empty platform, then of each orientation.

    Args:
        folder: made when not there.
        seed: of noise and releases.
        duration_s: of each run.
        each: so many runs of a kind.
        wires: 2 or 3.
        ways: to lay the object, quaternions w x y z; None: those that tell its whole tensor.
        wider: twists by hand over the usual ones.
        swayed_m_s: of the sway at the start, one deviation of x and y.
    """
    ways = WAYS[wires] if ways is None else ways
    rng = np.random.default_rng(seed)
    (folder / "runs").mkdir(parents=True, exist_ok=True)
    told = LOAD_COM_M + rng.normal(0.0, 0.001, 3)
    lines = ['format = "freeswing-session/1"', 'name = "turned"', 'robot = "robot.toml"']
    lines += [f"frame_rate_hz = {RATE_HZ}", "", "[[loads]]", 'name = "object"']
    lines += [f"mass_kg = {LOAD_KG}", "mass_std_kg = 0.0005"]
    lines += [f"com_m = {told.tolist()}", "com_std_m = 0.001"]
    for k, laid in enumerate([None] * each + [one for one in ways for _ in range(each)]):
        name = f"run-{k + 1:02d}"
        motion = _swing(_world(wires, laid), rng, duration_s, RATE_HZ, 0.0, wider, swayed_m_s)
        _record(folder / "runs" / f"{name}.csv", motion, rng, "poses")
        lines += ["", "[[runs]]", f'name = "{name}"', 'role = "identify"']
        lines += [f"cable_lengths_m = {[WIRE_M] * wires}", "cable_lengths_std_m = 0.001"]
        lines += [f'trajectory = "runs/{name}.csv"']
        if laid is not None:
            place = f"t_platform_load_m = {UNDER_M.tolist()}"
            lines.append(
                f'loads = [{{ name = "object", q_platform_load = {list(laid)}, {place} }}]'
            )
    (folder / "session.toml").write_text("\n".join([*lines, ""]))
    _write_robot(folder / "robot.toml", wires, _ends(wires))
    return TurnedTruth(_object_tensor(), LOAD_COM_M)


def _world(wires: int, laid: tuple[float, float, float, float] | None) -> World:
    from freeswing.cdpr.robot import Cable, Robot

    ends = _ends(wires)
    up = np.array([0.0, 0.0, WIRE_M])
    cables = tuple(Cable(str(k), end + up, 0.0, end) for k, end in enumerate(ends))
    robot = Robot("bench", cables, np.array([0.0, 0.0, -GRAVITY]))
    bodies = [(DECLARED_KG, PLATFORM_COM_M, np.diag(PLATFORM_KG_M2))]
    if laid is not None:
        turn = turn_of(laid)
        centre = turn @ LOAD_COM_M + UNDER_M
        bodies.append((LOAD_KG, centre, turn @ _object_tensor() @ turn.T))
    mass = sum(body[0] for body in bodies)
    first = np.sum([body[0] * body[1] for body in bodies], axis=0)
    second = np.sum([one[2] + one[0] * _spread(one[1]) for one in bodies], axis=0)
    entries = (second / mass)[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    world = plain_world(robot, Body(mass, first / mass, entries), np.full(wires, WIRE_M))
    return world._replace(drag_angular=DRAG_N_M_S)


def _spread(place: Array) -> Array:
    return np.asarray(place @ place * np.eye(3) - np.outer(place, place))
