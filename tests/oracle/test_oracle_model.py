"""The product's free motion beside MuJoCo and the independent integrator, effect by effect."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.free_motion import admissible_rates
from freeswing.cdpr.robot import Robot
from freeswing.cdpr.rotation import angle_rate_matrix, matrix_from_angles
from freeswing.cdpr.simulation.free_swing import simulate as product_simulate
from tests.oracle.mechanics.equilibrium import displaced, lengths_at, settle, tensions_at_rest
from tests.oracle.mechanics.geometry import turn
from tests.oracle.mechanics.newton_euler import Motion, project, simulate, start_state
from tests.oracle.mechanics.world import Array, World, plain_world
from tests.oracle.recorded.sessions import tait_bryan
from tests.oracle.scenes.robots import declared_robot, true_body, with_eyelets
from tests.oracle.witnesses.mujoco_swing import mujoco_swing

START = {"bologna-4": ((1.15, -0.18, -0.4), 0.05), "three-cable": ((-1.36, 0.97, -0.46), -0.55)}
MASS_KG = 8.0


@cache
def released(name: str, eyelets: bool = False) -> tuple[Robot, World, Array, Array]:
    """Robot, plain world and a pose to let go from, 4 cm or 0.15 rad off the rest pose."""
    declared = declared_robot(name)
    robot = with_eyelets(declared) if eyelets else declared
    body = true_body(name, np.random.default_rng(1))
    world = plain_world(robot, body)
    position, heading = START[name]
    p, q = np.array(position), np.array([1.0, 0.0, 0.0, 0.0])
    turn(q, np.array([0.0, 0.0, heading]))
    world = world._replace(length=lengths_at(world, p, q))
    rest = settle(world, p, q)
    way = np.array([0.8, 0.6, 0.5])[: rest.freedom.shape[1]]
    return robot, world, *displaced(world, rest, way, 0.04, 0.15)


def product_motion(
    robot: Robot,
    name: str,
    p: Array,
    q: Array,
    times_s: Array,
    values: dict[str, float],
    twist: Array | None = None,
) -> tuple[Array, Array]:
    """Positions and rotations by the product, `values` being "effect.parameter" -> number."""
    model = build_model(robot, tuple(dict.fromkeys(key.split(".")[0] for key in values)))
    unknown = set(values) - set(model.names)
    assert not unknown, f"{unknown} not among {model.names}"
    numbers = model.start_values
    numbers[[model.names.index(key) for key in values]] = list(values.values())
    body = true_body(name, np.random.default_rng(1))
    inertia = np.concatenate([body.com_m, body.specific_inertia_m2])
    zeta = np.concatenate([p, tait_bryan(q[None])[0]])
    rates = np.zeros(6) if twist is None else twist.copy()
    rates[3:] = np.linalg.solve(angle_rate_matrix(zeta[3:]), rates[3:])
    rates = admissible_rates(model, zeta, rates, inertia, numbers)
    span = (0.0, float(times_s[-1]))
    motion = product_simulate(model, zeta, rates, span, inertia, numbers)
    found = motion.at(times_s)[0]
    return found[:, :3], matrix_from_angles(found[:, 3:])


def apart_mm(positions: Array, motion: Motion) -> float:
    return 1e3 * float(np.max(np.linalg.norm(positions - motion.positions_m, axis=1)))


@pytest.mark.parametrize("name", sorted(START))
def test_product_beside_mujoco(name: str) -> None:
    robot, _, p, q = released(name, eyelets=True)
    other = mujoco_swing(robot, true_body(name, np.random.default_rng(1)), p, q, 10.0)
    positions, rotations = product_motion(robot, name, p, q, other.times_s, {})
    apart = apart_mm(positions, other)
    turned = float(np.max(np.abs(rotations - other.rotations)))
    assert apart < 0.02, f"{apart:.2e} mm apart in 10 s"
    assert turned < 1e-4, f"{turned:.2e} apart in rotation"


@pytest.mark.parametrize("name", sorted(START))
def test_product_beside_newton_and_euler_over_pulleys(name: str) -> None:
    robot, world, p, q = released(name)
    other = simulate(world, p, q, 10.0)
    positions, rotations = product_motion(robot, name, p, q, other.times_s, {})
    apart = apart_mm(positions, other)
    turned = float(np.max(np.abs(rotations - other.rotations)))
    assert apart < 1e-4, f"{apart:.2e} mm apart in 10 s"
    assert turned < 1e-6, f"{turned:.2e} apart in rotation"


def _moved(row: int, shift: tuple[float, float, float]) -> Array:
    moved = np.zeros((4, 3))
    moved[row] = shift
    return moved


def _linear_tether(robot: str, stiffness: float, anchor: tuple[float, float, float]):
    """A line without unstretched length, tied to P: told by its pull at the product's place."""
    entries = declared_robot(robot).entries_m
    mean = entries.mean(axis=0)
    depth = 0.7 * np.sqrt(np.mean(np.sum((entries - mean) ** 2, axis=1)))
    pull = stiffness * (np.array(anchor) - mean + [0.0, 0.0, depth])
    named = {f"tether.pull_{axis}_m_s2": pull[k] for k, axis in enumerate("xyz")}
    return {"tether.stiffness_1_s2": stiffness, "tether.rest_share": 0.0, **named}


# World fields (of a platform of `MASS_KG`, the product's forces being over the mass), the product's
# values, and by how much of the effects' own size the two may differ: smooth effects agree to
# integration error, |v| is rounded at 0.1 mm/s in the product, dry friction is smoothed over
# 0.0002 rad/s here and 0.002 rad/s there.
SMOOTH, ROUNDED, DRY = 1e-5, 1e-3, 5e-3
EFFECTS = {
    "forces": (
        {
            "drag": 0.05 * MASS_KG,
            "drag_angular": 0.005 * MASS_KG,
            "swivel_viscous": np.full(4, 0.01 * MASS_KG),
            "force": np.array([0.05, -0.03, 0.02]) * MASS_KG,
            "oscillators": np.array([[1.7, 0.0, 0.02 * MASS_KG, 0.0, 0.0, 0.0]]),
            "tether_stiffness": 0.5 * MASS_KG,
            "tether_anchor": np.array([2.0, 1.0, 0.4]),
            "torsion": 0.1 * MASS_KG,
            "torsion_yaw": 0.2,
        },
        {
            "translational_drag.rate_1_s": 0.05,
            "translational_drag.centre_fraction": 0.0,
            "rotational_drag.rate_m2_s": 0.005,
            "swivel_viscous.rate_m2_s": 0.01,
            "constant_force.force_x_m_s2": 0.05,
            "constant_force.force_y_m_s2": -0.03,
            "constant_force.force_z_m_s2": 0.02,
            "harmonic_force.sine_x_m_s2": 0.02,
            "harmonic_force.frequency_hz": 1.7,
            "torsion_spring.stiffness_m2_s2": 0.1,
            "torsion_spring.moment_m2_s2": 0.1 * 0.2,
            **_linear_tether("bologna-4", 0.5, (2.0, 1.0, 0.4)),
        },
        SMOOTH,
    ),
    "geometry": (
        {
            "entry": _moved(2, (0.004, -0.003, 0.005)),
            "attach": _moved(0, (-0.002, 0.003, 0.001)),
            "radius": np.array([0.003, 0.0, 0.0, -0.002]),
            "creep": np.array([1e-4, 0.0, -2e-4, 0.0]),
        },
        {
            "anchor_offset.offset_3_x_m": 0.004,
            "anchor_offset.offset_3_y_m": -0.003,
            "anchor_offset.offset_3_z_m": 0.005,
            "attachment_offset.offset_1_x_m": -0.002,
            "attachment_offset.offset_1_y_m": 0.003,
            "attachment_offset.offset_1_z_m": 0.001,
            "pulley_radius.difference_1_m": 0.003,
            "pulley_radius.difference_4_m": -0.002,
            "winch_creep.rate_1_m_s": 1e-4,
            "winch_creep.rate_3_m_s": -2e-4,
        },
        SMOOTH,
    ),
    "heavy cables and quadratic drag": (
        {"density": 0.002 * MASS_KG, "drag_quadratic": 0.1 * MASS_KG},
        {
            "cable_mass.linear_density_over_mass_1_m": 0.002,
            "quadratic_drag.coefficient_1_m": 0.1,
            "quadratic_drag.centre_fraction": 0.0,
        },
        ROUNDED,
    ),
    "swivel friction": (
        {"swivel_coulomb": np.full(4, 0.001 * MASS_KG)},
        {"swivel_friction.torque_m2_s2": 0.001},
        DRY,
    ),
    "pulley friction": (
        {"bending": np.full(4, 0.03)},
        {"pulley_friction.coefficient": 0.03},
        DRY,
    ),
}
ADDED = ("entry", "attach", "radius")


@pytest.mark.parametrize("effects", EFFECTS)
def test_effects_beside_newton_and_euler(effects: str) -> None:
    """From the same pose, at the least twist that the winches allow.

    The difference between the two is held against how far the effects move the platform.
    """
    fields, values, share = EFFECTS[effects]
    robot, world, p, q = released("bologna-4")
    plain = _of_mass(world)
    fields = {key: getattr(plain, key) + v if key in ADDED else v for key, v in fields.items()}
    changed = plain._replace(**fields)
    changed = changed._replace(length=lengths_at(changed, p, q))
    state = start_state(changed, p, q)
    project(0.0, state, changed)
    twist = state[7:13]
    other, without = simulate(changed, p, q, 6.0, twist), simulate(plain, p, q, 6.0)
    positions, _ = product_motion(robot, "bologna-4", p, q, other.times_s, values, twist)
    size, apart = apart_mm(without.positions_m, other), apart_mm(positions, other)
    assert size > 0.05, f"the effect moves the platform by {size:.3g} mm only"
    assert apart < share * size + 1e-4, f"{apart:.2e} mm apart, the effect being {size:.3g} mm"


def test_turned_gravity_beside_newton_and_euler() -> None:
    robot, world, p, q = released("bologna-4")
    tilt = np.array([0.012, -0.007, 0.0])
    angle = float(np.linalg.norm(tilt))
    axis, down = tilt / angle, world.gravity
    gravity = down * np.cos(angle) + np.cross(axis, down) * np.sin(angle)
    other = simulate(world._replace(gravity=gravity), p, q, 6.0)
    values = {"gravity_tilt.tilt_x_rad": tilt[0], "gravity_tilt.tilt_y_rad": tilt[1]}
    positions, _ = product_motion(robot, "bologna-4", p, q, other.times_s, values)
    size = apart_mm(simulate(world, p, q, 6.0).positions_m, other)
    apart = apart_mm(positions, other)
    assert apart < 1e-3 * size, f"{apart:.2e} mm apart, the effect being {size:.3g} mm"


def test_elastic_cables_beside_real_springs() -> None:
    """Stretch by the tensions of rigid cables against cables that really vibrate.

    The departure grows with the square of the stretch: 12 % of the effect at 1 MN, 26 % at
    400 kN, as much as the effect itself at 100 kN, where the platform rolls at 11 Hz on its
    cables while the tensions of this swing have parts at 4 to 8 Hz.
    """
    robot, world, p, q = released("bologna-4")
    stiff = 1e6
    world = _of_mass(world)
    held = world.length / (1.0 + tensions_at_rest(world, p, q) / stiff)
    other = simulate(world._replace(stiffness_ea=stiff, relaxation=1e-3, length=held), p, q, 6.0)
    values = {
        "cable_elasticity.mass_over_stiffness_s2_m": MASS_KG / stiff,
        "cable_elasticity.damping_s3_m": 1e-3 * MASS_KG / stiff,
    }
    positions, _ = product_motion(robot, "bologna-4", p, q, other.times_s, values)
    size = apart_mm(simulate(world, p, q, 6.0).positions_m, other)
    apart = apart_mm(positions, other)
    assert apart < 0.15 * size, f"{apart:.2e} mm apart, the effect being {size:.3g} mm"


def _of_mass(world: World) -> World:
    """The same specific inertia on `MASS_KG`."""
    share = MASS_KG / world.mass
    return world._replace(mass=MASS_KG, inertia=world.inertia * share)
