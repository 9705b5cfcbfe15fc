"""The independent simulator against MuJoCo, published figures, conservation laws, differences."""

from __future__ import annotations

import math

import numpy as np
import pytest

from freeswing.cdpr.robot import Cable, Robot
from tests.oracle.mechanics.dynamics import derivative
from tests.oracle.mechanics.equilibrium import Rest, displaced, lengths_at, settle
from tests.oracle.mechanics.geometry import cable, length_acceleration, turn
from tests.oracle.mechanics.newton_euler import Motion, energy, simulate, start_state
from tests.oracle.mechanics.world import Array, Body, World, plain_world
from tests.oracle.scenes.effects import Scene, add_effect
from tests.oracle.scenes.robots import declared_robot, nominal_body, true_body, with_eyelets
from tests.oracle.witnesses.mujoco_swing import mujoco_swing

START = {"bologna-4": ((1.15, -0.18, -0.4), 0.05), "three-cable": ((-1.36, 0.97, -0.46), -0.55)}


def quaternion_of(phi: float, theta: float, chi: float) -> Array:
    q = np.array([1.0, 0.0, 0.0, 0.0])
    for vector in ((0.0, 0.0, chi), (0.0, theta, 0.0), (phi, 0.0, 0.0)):
        turn(q, np.array(vector))
    return q


def hanging(name: str, eyelets: bool = False, **fields: object) -> tuple[Robot, World, Rest]:
    robot = with_eyelets(declared_robot(name)) if eyelets else declared_robot(name)
    world = plain_world(robot, true_body(name, np.random.default_rng(1)))._replace(**fields)
    position, heading = START[name]
    p, q = np.array(position), quaternion_of(0.0, 0.0, heading)
    world = world._replace(length=lengths_at(world, p, q))
    return robot, world, settle(world, p, q)


def swing(world: World, rest: Rest, duration_s: float = 10.0, **options: float) -> Motion:
    p, q = displaced(world, rest, np.array([0.8, 0.6, 0.5])[: rest.freedom.shape[1]], 0.04, 0.15)
    return simulate(world, p, q, duration_s, **options)  # pyright: ignore[reportArgumentType]


def energies(world: World, motion: Motion) -> Array:
    states = np.hstack([motion.positions_m, motion.quaternions, motion.twists])
    padded = np.hstack([states, np.zeros((len(states), 6))])
    return np.array(
        [energy(t, s, world, True) for t, s in zip(motion.times_s, padded, strict=True)]
    )


def furthest_mm(a: Motion, b: Motion) -> float:
    return 1e3 * float(np.max(np.linalg.norm(a.positions_m - b.positions_m, axis=1)))


@pytest.mark.parametrize("name", ["bologna-4", pytest.param("three-cable", marks=pytest.mark.slow)])
def test_mujoco_swings_along(name: str) -> None:
    robot, world, rest = hanging(name, eyelets=True)
    motion = swing(world, rest)
    p, q = motion.positions_m[0], motion.quaternions[0]
    other = mujoco_swing(robot, true_body(name, np.random.default_rng(1)), p, q, 10.0)
    apart = furthest_mm(motion, other)
    turned = float(np.max(np.abs(motion.rotations - other.rotations)))
    assert apart < 0.005, f"{apart:.2e} mm apart in 10 s"
    assert turned < 1e-5, f"{turned:.2e} apart in rotation"


def test_mujoco_swings_along_from_a_twist() -> None:
    robot, world, rest = hanging("bologna-4", eyelets=True)
    twist = 0.3 * rest.freedom[:, 0] / np.array([1.0, 1.0, 1.0, 0.25, 0.25, 0.25])
    motion = simulate(world, rest.position_m, rest.quaternion, 2.0, twist)
    body = true_body("bologna-4", np.random.default_rng(1))
    other = mujoco_swing(robot, body, rest.position_m, rest.quaternion, 2.0, twist)
    apart = furthest_mm(motion, other)
    assert apart < 0.001, f"{apart:.2e} mm apart in 2 s"


def test_mujoco_stretches_along() -> None:
    stiff = 2e4
    robot, world, rest = hanging("bologna-4", eyelets=True, stiffness_ea=stiff)
    motion = swing(world, rest, 4.0)
    body = true_body("bologna-4", np.random.default_rng(1))
    p, q = motion.positions_m[0], motion.quaternions[0]
    other = mujoco_swing(robot, body, p, q, 4.0, stiffness_ea_n=stiff, unstretched_m=world.length)
    apart = furthest_mm(motion, other)
    assert apart < 0.001, f"{apart:.2e} mm apart in 4 s"


def test_published_start_pose_of_the_three_cable_robot() -> None:
    world = plain_world(declared_robot("three-cable"), nominal_body("three-cable"))
    p, q = np.array([-1.363, 0.963, -0.460]), quaternion_of(-0.056, -0.069, -0.557)
    lengths = lengths_at(world, p, q)
    world = world._replace(length=lengths)
    rest = settle(world, p, q)
    moved = 1e3 * float(np.linalg.norm(rest.position_m - p))
    assert lengths == pytest.approx([1.470, 1.509, 1.543], abs=0.002), lengths
    assert rest.tensions_n == pytest.approx([40.0, 40.0, 40.0], abs=0.3), rest.tensions_n
    assert rest.stable
    assert moved < 10.0, f"{moved:.2f} mm from the printed pose"


@pytest.mark.parametrize("radius", [0.0, 0.025])
def test_cable_derivatives_against_differences(radius: float) -> None:
    rng = np.random.default_rng(4)
    robot = declared_robot("bologna-4")
    t, n, w = np.empty(3), np.empty(3), np.empty(3)
    for c in robot.cables:
        point = np.array([1.1, -0.1, -0.3]) + rng.normal(0.0, 0.1, 3)
        velocity, axes = rng.normal(size=3), np.array([c.swivel_x, c.swivel_y, c.swivel_z])

        def length(shift: float, point=point, velocity=velocity, axes=axes, c=c) -> float:
            where = point + shift * velocity
            scratch = np.empty((3, 3))
            return cable(c.entry_m, radius, axes, where, scratch[0], scratch[1], scratch[2])[0]

        _, rho, psi, s = cable(c.entry_m, radius, axes, point, t, n, w)
        slope = (length(1e-5) - length(-1e-5)) / 2e-5
        bend = (length(1e-3) - 2.0 * length(0.0) + length(-1e-3)) / 1e-6
        found = length_acceleration(radius, t, n, w, rho, psi, s, velocity)
        assert slope == pytest.approx(t @ velocity, abs=1e-8)
        assert bend == pytest.approx(found, abs=1e-5)


@pytest.mark.parametrize("name", sorted(START))
def test_energy_and_lengths_are_kept(name: str) -> None:
    _, world, rest = hanging(name)
    motion = swing(world, rest)
    stored = energies(world, motion)
    still = simulate(world, rest.position_m, rest.quaternion, 0.0)
    of_the_swing = stored[0] - energies(world, still)[0]
    drift = float(np.ptp(stored)) / of_the_swing
    assert drift < 1e-8, f"energy drift {drift:.1e} of {of_the_swing:.2g} J"
    assert motion.drift_m < 1e-12, f"length drift {motion.drift_m:.1e} m"


def test_energy_is_kept_by_springs_and_stretch() -> None:
    anchor = np.array([1.2, 0.8, 0.3])
    tether = {"tether_stiffness": 15.0, "tether_rest": 0.4, "tether_anchor": anchor}
    _, world, rest = hanging("bologna-4", torsion=1.0, stiffness_ea=3e4, **tether)
    drift = float(np.ptp(energies(world, swing(world, rest, 5.0))))
    assert drift < 1e-6, f"energy drift {drift:.1e} J"


def test_step_halving() -> None:
    _, world, rest = hanging("bologna-4")
    reference = swing(world, rest, 3.0, step_s=1e-4)
    steps = (5e-3, 2.5e-3, 5e-4)
    gaps = [furthest_mm(swing(world, rest, 3.0, step_s=h), reference) for h in steps]
    assert gaps[0] / gaps[1] > 12.0, f"order below 4: {gaps} mm"
    assert gaps[2] < 1e-6, f"{gaps} mm at 5, 2.5 and 0.5 ms"


@pytest.mark.parametrize(
    ("fields", "power"),
    [
        ({"drag": 0.5}, lambda v, w: 0.5 * (v @ v)),
        ({"drag_quadratic": 2.0}, lambda v, w: 2.0 * (v @ v) ** 1.5),
        ({"drag_angular": 0.05}, lambda v, w: 0.05 * (w @ w)),
    ],
    ids=["translational", "quadratic", "rotational"],
)
def test_drag_takes_its_power(fields, power) -> None:
    _, world, rest = hanging("bologna-4", **fields)
    motion = swing(world, rest, 5.0, rate_hz=1000.0)
    lost = energies(world, motion)[[0, -1]] @ [1.0, -1.0]
    rates = [power(twist[:3], twist[3:]) for twist in motion.twists]
    taken = float(np.trapezoid(rates, motion.times_s))
    assert taken > 1e-4
    assert lost == pytest.approx(taken, rel=1e-5), f"lost {lost} J, taken {taken} J"


@pytest.mark.parametrize("name", ["swivel_friction", "swivel_viscous", "pulley_friction"])
def test_bearing_friction_takes_its_power(name: str) -> None:
    _, world, rest = hanging("bologna-4")
    scene = Scene(world, np.zeros(3), 0.0, np.zeros(4))
    rough = add_effect(scene, name, "medium", np.random.default_rng(0)).world
    motion = swing(rough, rest, 3.0, rate_hz=2000.0)
    lost = energies(rough, motion)[[0, -1]] @ [1.0, -1.0]
    angles = np.array(
        [
            [_angles(rough, k, p + R @ rough.attach[k]) for k in range(4)]
            for p, R in zip(motion.positions_m, motion.rotations, strict=True)
        ]
    )
    swivel, wrap = np.diff(np.unwrap(angles, axis=0), axis=0).transpose(2, 0, 1)
    viscous = rough.swivel_viscous * swivel**2 * 2000.0
    load = 0.5 * (motion.tensions_n[1:] + motion.tensions_n[:-1])
    dry = rough.swivel_coulomb * np.abs(swivel) + rough.bending * 0.025 * load * np.abs(wrap)
    taken = float(np.sum(viscous + dry))
    assert lost == pytest.approx(taken, rel=0.01), f"lost {lost} J, taken {taken} J"


def _angles(world: World, k: int, point: Array) -> tuple[float, float]:
    t, n, w = np.empty(3), np.empty(3), np.empty(3)
    psi = cable(world.entry[k], world.radius[k], world.swivel[k], point, t, n, w)[2]
    x, y, _ = world.swivel[k] @ (point - world.entry[k])
    return math.atan2(y, x), psi


def test_conical_pendulum_turns_at_its_textbook_rate() -> None:
    length, radius, depth = 1.25, 0.75, 1.0
    robot = Robot("one", (Cable("1", np.zeros(3), 0.0, np.zeros(3)),))
    tiny = Body(2.0, np.zeros(3), np.array([1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0]))
    world = plain_world(robot, tiny, np.array([length]))
    rate = math.sqrt(9.80665 / depth)
    twist = np.array([0.0, rate * radius, 0.0, 0.0, 0.0, 0.0])
    motion = simulate(world, np.array([radius, 0.0, -depth]), np.eye(4)[0], 3.0, twist)
    expected = radius * np.array([math.cos(3.0 * rate), math.sin(3.0 * rate), -depth / radius])
    apart = 1e3 * float(np.linalg.norm(motion.positions_m[-1] - expected))
    tension = 2.0 * 9.80665 * length / depth
    assert apart < 1e-6, f"{apart:.1e} mm off"
    assert motion.tensions_n[:, 0] == pytest.approx(tension, rel=1e-9)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
def test_one_to_five_cables_keep_their_lengths(n: int) -> None:
    rng = np.random.default_rng(n)
    angles = np.linspace(0.0, 2.0 * math.pi, n, endpoint=False)
    cables = tuple(
        Cable(
            str(k),
            np.array([1.2 * math.cos(a), 1.2 * math.sin(a), 1.0]),
            0.03,
            np.array([0.2 * math.cos(a), 0.2 * math.sin(a), 0.1 * (k % 2)]),
            np.array([-math.sin(a), math.cos(a), 0.0]),
            np.array([0.0, 0.0, 1.0]),
            np.array([math.cos(a), math.sin(a), 0.0]),
        )
        for k, a in enumerate(angles)
    )
    world = plain_world(Robot("ring", cables), nominal_body("bologna-4"))
    p, q = np.array([0.05, 0.0, -0.1]), quaternion_of(0.02, 0.03, 0.04)
    world = world._replace(length=lengths_at(world, p, q))
    motion = simulate(world, p, q, 0.5)
    state = start_state(world, p, q, rng.normal(size=6))
    derivative(0.0, state, world, np.empty(19), np.zeros(n))
    assert motion.drift_m < 1e-12, f"{motion.drift_m:.1e} m"
    assert np.all(np.isfinite(motion.positions_m))


@pytest.mark.parametrize(
    "fields",
    [
        {"stiffness_ea": 2e4, "relaxation": 1e-3},
        {"density": 0.03},
        {"gravity": np.array([0.2, -0.1, -9.8])},
        {"force": np.array([1.0, 0.5, 0.0])},
        {"bob_mass": 0.3, "bob_length": 0.2, "bob_pivot": np.array([0.1, 0.0, 0.05])},
        {"torsion": 1.5, "torsion_yaw": 0.3},
    ],
    ids=lambda fields: next(iter(fields)),
)
def test_at_rest_it_stays(fields) -> None:
    _, world, rest = hanging("bologna-4", **fields)
    motion = simulate(world, rest.position_m, rest.quaternion, 1.0)
    away = float(np.max(np.abs(motion.positions_m - rest.position_m)))
    assert rest.stable
    assert away < 1e-8, f"{away:.1e} m"


def test_heavy_cable_swings_at_its_textbook_rate() -> None:
    """A bead on a heavy straight cable is a compound pendulum: w2 = g (m + M/2) / (L (m + M/3))."""
    length, bead, cable_mass, angle = 1.5, 0.4, 0.2, 1e-3
    robot = Robot("one", (Cable("1", np.zeros(3), 0.0, np.zeros(3)),))
    body = Body(bead, np.zeros(3), np.array([1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0]))
    world = plain_world(robot, body, np.array([length]))._replace(density=cable_mass / length)
    start = length * np.array([math.sin(angle), 0.0, -math.cos(angle)])
    motion = simulate(world, start, np.eye(4)[0], 4.0)
    rate = math.sqrt(9.80665 * (bead + cable_mass / 2.0) / (length * (bead + cable_mass / 3.0)))
    expected = start[0] * np.cos(rate * motion.times_s)
    off = float(np.max(np.abs(motion.positions_m[:, 0] - expected))) / start[0]
    assert off < 1e-5, f"{off:.1e} of the amplitude"


def test_a_hook_that_yields_makes_a_pendulum_longer() -> None:
    """By tension over what holds it sideways: a spring of k and a wire's m g / L in a row."""
    length, mass, angle, hook, stiff = 1.2, 0.4, 2e-3, 400.0, 2e5
    robot = Robot("one", (Cable("1", np.zeros(3), 0.0, np.zeros(3)),))
    body = Body(mass, np.zeros(3), np.array([1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0]))
    pull = mass * 9.80665
    world = plain_world(robot, body, np.array([length]))
    world = world._replace(stiffness_ea=stiff, relaxation=1e-3, hook=np.array([hook]))
    hangs = length * (1.0 + pull / stiff) + pull / hook
    start = np.array([hangs * math.sin(angle), 0.0, -length * (1.0 + pull / stiff)])
    motion = simulate(world, start, np.eye(4)[0], 4.0)
    expected = start[0] * np.cos(math.sqrt(9.80665 / hangs) * motion.times_s)
    off = float(np.max(np.abs(motion.positions_m[:, 0] - expected))) / start[0]
    assert off < 1e-3, f"{off:.1e} of the amplitude"  # 9.8 mm left out would be 3e-2
