"""Every effect against the independent simulator's physics, one instant at a time."""

import math

import numpy as np
import pytest

from freeswing.cdpr.effects import catalogue
from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.free_motion import admissible_rates
from freeswing.cdpr.rotation import exp_rotation, matrix_from_angles
from freeswing.cdpr.simulation.free_swing import simulate
from tests.cdpr.model_cases import (
    ROBOTS,
    body_of,
    pose_of,
    random_states,
    report,
    robot_named,
    swing_start,
    true_inertia,
    twist_of,
)
from tests.oracle.mechanics.dynamics import derivative
from tests.oracle.mechanics.newton_euler import start_state
from tests.oracle.mechanics.world import plain_world

MASS = 8.0
TIME_S = 0.37


def _offset_rows(values):
    return np.reshape(values, (-1, 3))


def _axes(world, values):
    turns = exp_rotation(np.column_stack([values.reshape(-1, 2), np.zeros(len(world.radius))]))
    return np.swapaxes(turns, 1, 2) @ world.swivel


def _tilted(world, values):
    return exp_rotation(np.array([*values, 0.0])) @ world.gravity


def _harmonic(values):
    """Cosine and sine parts as two oscillators: Hz, phase, force, chirp."""
    cosine, sine, hz = MASS * values[:3], MASS * values[3:6], values[6]
    return np.array([[hz, math.pi / 2, *cosine, 0.0], [hz, 0.0, *sine, 0.0]])


def _spring(world, values):
    """A line from P to its anchor, by stiffness and unstretched length."""
    mean = world.entry.mean(axis=0)
    spread = np.sqrt(np.mean(np.sum((world.entry - mean) ** 2, axis=1)))
    to_anchor = values[1:4] / (values[0] * (1.0 - values[4]))
    return {
        "tether_stiffness": MASS * values[0],
        "tether_anchor": mean - [0.0, 0.0, 0.7 * spread] + to_anchor,
        "tether_point": values[5:],
        "tether_rest": values[4] * float(np.linalg.norm(to_anchor)),
    }


# Product values, and what the same physics is called in the independent simulator, whose forces
# are not per mass.
TRANSLATED = {
    "translational_drag": (
        [0.3, 0.7],
        lambda w, v: {"drag": v[0] * MASS, "drag_point": v[1] * w.com},
    ),
    "quadratic_drag": (
        [0.8, 0.4],
        lambda w, v: {"drag_quadratic": v[0] * MASS, "drag_point": v[1] * w.com},
    ),
    "rotational_drag": ([0.02], lambda w, v: {"drag_angular": v[0] * MASS}),
    "swivel_friction": ([0.003], lambda w, v: {"swivel_coulomb": MASS * v[0] + 0 * w.radius}),
    "swivel_viscous": ([0.02], lambda w, v: {"swivel_viscous": MASS * v[0] + 0 * w.radius}),
    "pulley_friction": ([0.03], lambda w, v: {"bending": v[0] + 0 * w.radius}),
    "cable_mass": ([0.004], lambda w, v: {"density": MASS * v[0]}),
    "gravity_tilt": ([0.03, -0.05], lambda w, v: {"gravity": _tilted(w, v)}),
    "anchor_offset": (None, lambda w, v: {"entry": w.entry + _offset_rows(v)}),
    "attachment_offset": (None, lambda w, v: {"attach": w.attach + _offset_rows(v)}),
    "pulley_radius": (None, lambda w, v: {"radius": w.radius + v}),
    "pulley_axis": (None, lambda w, v: {"swivel": _axes(w, v)}),
    "tether": ([1.5, 0.6, -0.4, 0.8, 0.6, 0.1, -0.05, 0.07], _spring),
    "torsion_spring": (
        [0.2, 0.05],
        lambda w, v: {"torsion": MASS * v[0], "torsion_yaw": v[1] / v[0]},
    ),
    "constant_force": ([0.1, -0.2, 0.05], lambda w, v: {"force": MASS * v}),
    "harmonic_force": (
        [0.1, 0.2, -0.1, 0.05, -0.2, 0.1, 2.3],
        lambda w, v: {"oscillators": _harmonic(v)},
    ),
}
ELSEWHERE = {
    "platform_frame",
    "yielding_clamp",
    "cable_elasticity",
    "winch_creep",
    "cable_length_bias",
    "marker_offset",
    "clock_offset",
}


def independent(world, zeta, rates, model):
    """Accelerations of P and of the angles' twist, and specific tensions."""
    position, quaternion = pose_of(zeta)
    state = start_state(world, position, quaternion, twist_of(model, zeta, rates))
    out, tensions = np.empty(19), np.zeros(len(world.radius))
    derivative(TIME_S, state, world, out, tensions)
    return out[7:13], tensions / MASS


def product(model, zeta, rates, inertia, values):
    second, tensions = evaluate(model.acceleration, TIME_S, zeta, rates, inertia, values)
    turn, turn_rate = evaluate(model.twist_map, zeta, rates)
    return turn @ second + turn_rate @ rates, tensions


def values_for(model, name):
    values = TRANSLATED[name][0]
    if values is not None:
        return np.array(values, dtype=float)
    rng = np.random.default_rng(1)
    return np.array([p.scale for p in model.parameters]) * rng.normal(size=len(model.parameters))


def test_every_effect_is_tested():
    assert set(catalogue()) == set(TRANSLATED) | ELSEWHERE


@pytest.mark.parametrize("robot_name", ROBOTS)
@pytest.mark.parametrize("name", sorted(TRANSLATED))
def test_effect_is_the_independent_simulators(name, robot_name):
    robot = robot_named(robot_name)
    model, bare = build_model(robot, (name,)), build_model(robot)
    inertia, values = true_inertia(robot), values_for(model, name)
    plain = plain_world(robot, body_of(inertia))
    world = plain._replace(**TRANSLATED[name][1](plain, values))
    worst = size = 0.0
    for zeta, rates in zip(*random_states(robot, 12, speed=1.0), strict=True):
        speeds = evaluate(bare.cables, zeta, [])[4:] @ rates
        if np.abs(speeds).min() < 0.1:
            continue  # dry friction is smoothed below 0.002 rad/s here, 0.0002 there
        expected, expected_tensions = independent(world, zeta, rates, model)
        found, tensions = product(model, zeta, rates, inertia, values)
        without = product(bare, zeta, rates, inertia, [])[0]
        apart = max(np.abs(found - expected).max(), np.abs(tensions - expected_tensions).max())
        worst, size = max(worst, apart), max(size, np.abs(found - without).max())
    report(f"{name} on {robot_name}: {worst:.1e} m/s2 apart, the effect {size:.1e}")
    assert size > 1e-4, f"the effect is {size:.1e} m/s2: nothing was compared"
    # The load of pulley friction is that without friction: a coefficient squared is left out.
    limit = 2e-3 * size if name == "pulley_friction" else 1e-8 * size + 1e-9
    assert worst < limit, f"{worst:.1e} m/s2 apart, the effect {size:.1e}"


@pytest.mark.parametrize("name", sorted(catalogue()))
def test_start_values_leave_the_model_as_it_is(name):
    robot = robot_named("bologna-4")
    model, bare = build_model(robot, (name,)), build_model(robot)
    zetas, rates = random_states(robot, 5)
    inertia = true_inertia(robot)
    allowed = [admissible_rates(bare, *state, inertia) for state in zip(zetas, rates, strict=True)]
    arguments = (TIME_S, zetas, np.array(allowed), inertia)
    for function in ("acceleration", "told", "measured"):
        found = evaluate(getattr(model, function), *arguments, model.start_values)
        plain = evaluate(getattr(bare, function), *arguments, [])
        apart = max(np.abs(a - b).max() for a, b in zip(found, plain, strict=True))
        assert apart < 1e-11, f"{function} differs by {apart:.1e}"


@pytest.mark.parametrize("name", sorted(catalogue()))
def test_parameters_are_named_and_plausible(name):
    model = build_model(robot_named("bologna-4"), (name,))
    assert len(set(model.names)) == len(model.names) == len(model.start_values) > 0
    for parameter in model.parameters:
        assert parameter.low <= parameter.start <= parameter.high, parameter
        assert 0.0 < parameter.scale <= parameter.high - parameter.low, parameter


def test_effects_combine_in_any_order():
    robot, names = robot_named("bologna-4"), ("tether", "cable_mass", "pulley_radius")
    zetas, rates = random_states(robot, 4)
    inertia, found = true_inertia(robot), []
    for order in (names, names[::-1]):
        model = build_model(robot, order)
        values = [0.7 * p.scale for p in model.parameters]
        found.append(evaluate(model.acceleration, 0.0, zetas, rates, inertia, values)[0])
    apart = np.abs(found[0] - found[1]).max()
    assert apart < 1e-12, f"{apart:.1e}"


def test_eyelets_have_no_bearing_friction():
    robot = robot_named("bologna-4", eyelets=True)
    names = ("swivel_friction", "swivel_viscous", "pulley_friction")
    model, bare = build_model(robot, names), build_model(robot)
    zetas, rates = random_states(robot, 4)
    arguments = (0.0, zetas, rates, true_inertia(robot))
    with_friction = evaluate(model.acceleration, *arguments, [0.1, 0.5, 0.3])[0]
    apart = np.abs(with_friction - evaluate(bare.acceleration, *arguments, [])[0]).max()
    assert apart < 1e-12, f"{apart:.1e}"


def test_marker_is_measured_beside_p():
    robot = robot_named("bologna-4")
    model, offset = build_model(robot, ("marker_offset",)), np.array([0.01, -0.02, 0.03])
    zetas, rates = random_states(robot, 5)
    seen = evaluate(model.measured, 0.0, zetas, rates, true_inertia(robot), offset)[0]
    expected = zetas[:, :3] + matrix_from_angles(zetas[:, 3:]) @ offset
    assert np.abs(seen[:, :3] - expected).max() < 1e-15
    assert np.array_equal(seen[:, 3:], zetas[:, 3:])


def test_biased_cables_are_longer_than_told():
    robot = robot_named("bologna-4")
    model, biases = build_model(robot, ("cable_length_bias",)), np.array([3, -1, 2, 5]) * 1e-3
    zetas, rates = random_states(robot, 5)
    told = evaluate(model.told, 0.0, zetas, rates, true_inertia(robot), biases)[0]
    lengths = evaluate(model.lengths, zetas, biases)[0]
    assert np.abs(lengths - told - biases).max() < 1e-15


def test_torsion_spring_turns_on_through_a_full_turn():
    model = build_model(robot_named("bologna-4"), ("torsion_spring",))
    zeta, values = np.array([1.2, -0.2, -0.6, 0.1, 0.2, 3.0]), np.array([0.3, 0.0])
    inertia = true_inertia(model.robot)
    turns = zeta + np.linspace(0.0, 1.0, 101)[:, None] * np.eye(6)[5]
    forces = evaluate(model.lagrangian, turns, np.zeros(4), inertia, values)[1][:, 5]
    jump = np.abs(np.diff(forces)).max()
    assert jump < 0.02, f"the spring jumps by {jump:.2f} m2/s2 in 0.01 rad past half a turn"


def test_orientations_lag_by_the_clocks_offset():
    model = build_model(robot_named("bologna-4"), ("clock_offset",))
    zetas, rates = random_states(model.robot, 5)
    delay = 1e-5
    seen = evaluate(model.measured, 0.0, zetas, rates, true_inertia(model.robot), np.array([delay]))
    error = np.abs(seen[0][:, 3:] - (zetas - delay * rates)[:, 3:]).max()
    assert error < 1e-9, f"{error:.3g} rad"
    assert np.array_equal(seen[0][:, :3], zetas[:, :3])


def test_a_long_lag_is_that_of_the_motion_itself():
    model, inertia, zeta, rates = swing_start("bologna-4")
    motion, delay = simulate(model, zeta, rates, (0.0, 4.0), inertia), 0.02
    late = build_model(model.robot, ("clock_offset",))
    times = np.linspace(0.5, 3.5, 301)
    zetas, rates, _ = motion.at(times)
    seen = evaluate(late.measured, times, zetas, rates, inertia, np.array([delay]))[0]
    true = motion.at(times - delay)[0]
    error, size = np.abs(seen - true)[:, 3:].max(), np.abs(zetas - true)[:, 3:].max()
    assert error < 0.01 * size, f"{error:.2g} of {size:.2g} rad"
