"""Free motion: conserved quantities, MuJoCo and the independent simulator beside it, stretch."""

import numpy as np
import pytest

from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.elastic_motion import SPRUNG, elastic_values
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.free_motion import admissible_rates
from freeswing.cdpr.simulation.free_swing import simulate
from tests.cdpr.model_cases import (
    ROBOTS,
    body_of,
    pose_of,
    released,
    report,
    rest_of,
    ring,
    robot_named,
    swing_start,
    true_inertia,
    twist_of,
)
from tests.oracle.mechanics.newton_euler import simulate as independent_swing
from tests.oracle.mechanics.world import plain_world
from tests.oracle.witnesses.mujoco_swing import mujoco_swing

TIMES_S = np.arange(1001) / 100.0


def swung(name, effects=(), values=None, duration_s=10.0, **options):
    model, inertia, zeta, rates = swing_start(name, effects, values=values, **options)
    return simulate(model, zeta, rates, (0.0, duration_s), inertia, values)


def world_of(motion, **fields):
    world = plain_world(motion.model.robot, body_of(motion.inertia))
    told = evaluate(motion.model.told, 0.0, *_start(motion), motion.inertia, motion.values)[0]
    return world._replace(length=told, **fields)


def _start(motion):
    return motion.zetas[0], motion.rates[0]


def beside(motion, world, duration_s=10.0):
    """Largest distance of P from the independent simulator's, mm."""
    other = independent_swing(
        world, *pose_of(motion.zetas[0]), duration_s, twist_of(motion.model, *_start(motion))
    )
    ours = motion.at(other.times_s)[0]
    tensions = motion.tensions(other.times_s)
    apart = np.linalg.norm(ours[:, :3] - other.positions_m, axis=1).max()
    return 1e3 * float(apart), float(np.abs(tensions - other.tensions_n / 8.0).max())


@pytest.mark.parametrize("way", [0.05, 0.2])
@pytest.mark.parametrize("name", ROBOTS)
def test_lengths_and_energy_are_kept(name, way):
    motion = swung(name, way=way)
    zetas, rates, _ = motion.at(TIMES_S)
    lengths = evaluate(motion.model.lengths, zetas, [])[0]
    kinetic, potential = evaluate(motion.model.energy, zetas, rates, motion.inertia, [])
    drift = np.abs(lengths - lengths[0]).max()
    lost = np.abs(kinetic + potential - kinetic[0] - potential[0]).max() / kinetic.max()
    report(f"{name}, {way} rad: drift {drift:.1e} m, energy {lost:.1e} of the swing's")
    assert drift < 1e-9, f"lengths drift by {drift:.1e} m"
    assert lost < 1e-8, f"energy drifts by {lost:.1e} of the swing's"


@pytest.mark.parametrize("name", ROBOTS)
def test_mujoco_swings_beside_it(name):
    motion = swung(name, eyelets=True, way=0.3, speed=0.3)
    model = motion.model
    twist = twist_of(model, *_start(motion))
    other = mujoco_swing(
        model.robot, body_of(motion.inertia), *pose_of(motion.zetas[0]), 10.0, twist
    )
    poses = motion.at(other.times_s)[0]
    apart = 1e3 * np.linalg.norm(poses[:, :3] - other.positions_m, axis=1).max()
    reach = 1e3 * np.ptp(other.positions_m, axis=0).max()
    report(f"{name}: {apart:.4f} mm from MuJoCo in 10 s of a {reach:.0f} mm swing")
    assert reach > 20.0, f"the swing reaches {reach:.1f} mm only"
    assert apart < 0.02, f"{apart:.4f} mm"


@pytest.mark.parametrize("name", ROBOTS)
def test_newton_euler_with_pulleys_swings_beside_it(name):
    motion = swung(name)
    apart, tensions = beside(motion, world_of(motion))
    assert apart < 1e-4, f"{apart:.1e} mm"
    assert tensions < 1e-5, f"tensions {tensions:.1e} m/s2 apart"


def test_dry_friction_ends_a_swing_as_the_independent_simulators_does():
    """Smoothed below 0.002 rad/s here and below 0.0002 there: that is the difference."""
    values = np.array([0.006 / 8.0])
    motion = swung("bologna-4", ("swivel_friction",), values, way=0.15)
    world = world_of(motion)
    apart, _ = beside(motion, world._replace(swivel_coulomb=np.full(4, 0.006)))
    without, _ = beside(motion, world)
    report(f"{apart:.6f} mm apart, {without:.1f} mm without the effect")
    assert apart < 1e-4 * without, f"{apart:.3f} mm of {without:.2f} mm"


def test_winches_creep():
    creep = np.array([1e-4, -5e-5, 2e-5, 4e-5])
    motion = swung("bologna-4", ("winch_creep",), creep)
    lengths = evaluate(motion.model.lengths, motion.at(TIMES_S)[0], creep)[0]
    off = np.abs(lengths - lengths[0] - TIMES_S[:, None] * creep).max()
    apart, _ = beside(motion, world_of(motion, creep=creep))
    assert off < 1e-9, f"{off:.1e} m"
    assert apart < 1e-4, f"{apart:.1e} mm"


@pytest.mark.parametrize(("compliance", "limit_mm"), [(8e-6, 0.006), (8e-5, 0.15)])
def test_quasi_static_stretch_is_the_slow_part_of_full_stretch(compliance, limit_mm):
    """Second order in the compliance: 8 kg on EA = 1 MN and 100 kN, 1 ms of relaxation."""
    values = np.array([compliance, 1e-3 * compliance])
    slow = swung("bologna-4", ("cable_elasticity",), values)
    state = (0.0, *_start(slow), slow.inertia, values)
    unstretched = evaluate(slow.model.told, *state)[0]
    model = build_model(slow.model.robot, SPRUNG)
    full_values = elastic_values(model, compliance, unstretched)
    full = simulate(model, *_start(slow), (0.0, 10.0), slow.inertia, full_values)
    rigid = simulate(build_model(slow.model.robot), *_rigid_start(slow), (0.0, 10.0), slow.inertia)
    poses = [motion.at(TIMES_S)[0][:, :3] for motion in (slow, full, rigid)]
    apart = 1e3 * np.abs(poses[0] - poses[1]).max()
    effect = 1e3 * np.abs(poses[2] - poses[1]).max()
    told = evaluate(slow.model.told, TIMES_S, *slow.at(TIMES_S)[:2], slow.inertia, values)[0]
    drift = 1e3 * np.abs(told - told[0]).max()
    report(f"{compliance}: {apart:.4f} mm apart, the effect {effect:.2f} mm, drift {drift:.4f} mm")
    assert apart < limit_mm, f"{apart:.4f} mm"
    assert effect > 5 * apart, f"the effect is {effect:.3f} mm only"
    assert drift < limit_mm, f"{drift:.4f} mm"


def _rigid_start(motion):
    zeta, rates = _start(motion)
    model = build_model(motion.model.robot)
    return zeta, admissible_rates(model, zeta, rates, motion.inertia)


@pytest.mark.parametrize("eyelets", [False, True])
def test_full_stretch_is_the_independent_simulators(eyelets):
    stiffness = 2e4
    model, inertia, zeta, _ = swing_start("bologna-4", eyelets=eyelets)
    elastic = build_model(model.robot, SPRUNG)
    told = evaluate(model.lengths, zeta, [])[0] - 0.002
    values = elastic_values(elastic, 8.0 / stiffness, told, 0.0 if eyelets else 1e-3)
    motion = simulate(elastic, zeta, np.zeros(6), (0.0, 4.0), inertia, values)
    if eyelets:
        other = mujoco_swing(
            model.robot, body_of(inertia), *pose_of(zeta), 4.0, None, 100.0, stiffness, told
        )
        apart = 1e3 * np.abs(motion.at(other.times_s)[0][:, :3] - other.positions_m).max()
    else:
        world = world_of(motion, stiffness_ea=stiffness, relaxation=1e-3)
        apart = beside(motion, world, 4.0)[0]
    assert apart < 2e-3, f"{apart:.1e} mm"


def test_springs_and_stretch_keep_energy():
    robot = robot_named("bologna-4")
    model = build_model(robot, SPRUNG)
    rigid = build_model(robot)
    inertia = true_inertia(robot)
    zeta = released(rigid, rest_of(rigid, inertia))
    told = evaluate(rigid.lengths, zeta, [])[0] - 0.0006
    values = elastic_values(model, 1e-4, told, 0.0)
    motion = simulate(model, zeta, np.zeros(6), (0.0, 5.0), inertia, values)
    energy = np.add(*evaluate(model.energy, *motion.at(TIMES_S[:501])[:2], inertia, values))
    kinetic = evaluate(model.energy, *motion.at(TIMES_S[:501])[:2], inertia, values)[0].max()
    lost = np.ptp(energy) / kinetic
    assert lost < 1e-8, f"{lost:.1e} of the kinetic energy"


def test_eight_elastic_cables_carry_a_platform():
    robot = ring(8)
    model = build_model(robot, SPRUNG)
    lengths = evaluate(model.lengths, np.zeros(6), model.start_values)[0]
    values = elastic_values(model, 1e-4, lengths - 1e-3, 5e-3)
    motion = simulate(model, np.zeros(6), np.zeros(6), (0.0, 3.0), robot.inertia, values)  # pyright: ignore[reportArgumentType]
    states = motion.at(TIMES_S[:301])[:2]
    energy = np.add(*evaluate(model.energy, *states, robot.inertia, values))
    moved = np.abs(states[0][:, :3]).max()
    assert np.diff(energy).max() < 1e-8, f"energy grows by {np.diff(energy).max():.1e} m2/s2"
    assert energy[0] - energy[-1] > 1e-4, f"{energy[0] - energy[-1]:.1e} m2/s2 were lost"
    assert moved < 0.03, f"it moved by {moved:.3f} m"


def test_samples_between_and_beyond():
    motion = swung("bologna-4", duration_s=1.0)
    at, step = np.linspace(0.05, 0.95, 50), 1e-4
    before, middle, after = (motion.at(at + k * step) for k in (-1, 0, 1))
    assert np.abs((after[0] - before[0]) / (2 * step) - middle[1]).max() < 1e-5
    assert np.abs((after[1] - before[1]) / (2 * step) - middle[2]).max() < 1e-3
    with pytest.raises(ValueError, match=r"0\.000000 to 1\.5.* outside the motion"):
        motion.at(np.array([0.0, 1.5]))


def test_tighter_tolerances_change_nothing_that_matters():
    model, inertia, zeta, rates = swing_start("bologna-4", way=0.2)
    usual, tight = (
        simulate(model, zeta, rates, (0.0, 10.0), inertia, tolerance_m=tolerance)
        for tolerance in (1e-10, 1e-13)
    )
    apart = np.abs(usual.at(TIMES_S)[0] - tight.at(TIMES_S)[0]).max()
    assert apart < 1e-8, f"{apart:.1e}"


def test_wrong_starts_are_named():
    model, inertia, zeta, rates = swing_start("bologna-4")
    span = (0.0, 1.0)
    with pytest.raises(ValueError, match=r"lengthen cable .*admissible_rates"):
        simulate(model, zeta, rates + 0.01 * np.eye(6)[0], span, inertia)
    with pytest.raises(ValueError, match=r"rates is .*finite"):
        simulate(model, zeta, rates * np.nan, span, inertia)
    with pytest.raises(ValueError, match=r"inertia has shape \(3,\)"):
        simulate(model, zeta, rates, span, inertia[:3])
    with pytest.raises(ValueError, match="end must come after"):
        simulate(model, zeta, rates, (1.0, 1.0), inertia)
    with pytest.raises(ValueError, match=r"values has shape \(2,\), must be \(0,\)"):
        simulate(model, zeta, rates, span, inertia, np.zeros(2))
    turned = zeta.copy()
    turned[4] = np.pi / 2
    with pytest.raises(ValueError, match="theta is 90"):
        simulate(model, turned, rates, span, inertia)


def test_a_motion_onto_the_swivel_axis_is_named():
    """A bead on one cable swings in a plane through the pulley's axis, where it cannot turn."""
    robot = ring(1)
    cable, inertia = robot.cables[0], np.array([0, 0, 0, 0.05, 0.05, 0.05, 0, 0, 0])
    inertia[:3] = cable.attachment_m
    zeta, speed = np.zeros(6), np.zeros(6)
    reach = 0.4 * cable.swivel_x - [0.0, 0.0, 1.0]
    zeta[:3] = cable.entry_m - cable.attachment_m + reach
    speed[:3] = -3.0 * cable.swivel_x
    model = build_model(robot)
    rates = admissible_rates(model, zeta, speed, inertia)
    with pytest.raises(ValueError, match=r"cannot be followed beyond 0\.\d+ s"):
        simulate(model, zeta, rates, (0.0, 2.0), inertia)
