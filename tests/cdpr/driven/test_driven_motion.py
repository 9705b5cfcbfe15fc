import numpy as np
import pytest

from freeswing.cdpr.driven.model import build_driven
from freeswing.cdpr.driven.motion import MOST_DECAY, simulate_driven, substeps_for
from freeswing.cdpr.driven.slopes import motion_slope, moved, pose_map
from freeswing.cdpr.driven.statics import CENTRE, holding_currents, static_pose
from freeswing.cdpr.model.batch import evaluate
from tests.cdpr.driven_robots import inca, odd_robot, random_states
from tests.oracle.witnesses.mujoco_driven import DrivenBody, mujoco_driven

ONES = np.ones(8)
TABLE_1 = DrivenBody(
    mass_kg=0.289,
    com_m=np.zeros(3),
    inertia_com=np.diag([1.49e-4, 2.07e-4, 2.07e-4]),
    spring_N_m=14.4 * ONES,
    spring_drum_m=0.006 * ONES,
    drum_m=0.0175 * ONES,
    motor_inertia=3.88e-5 * ONES,
    viscous=6.68e-5 * ONES,
    torque_constant=0.0603 * ONES,
    time_constant_s=0.0013,
)


def random_bits(rate_hz, seconds, seed):
    """Currents of 0 or 1 A, each held for half a period of rate_hz, at 1 kHz."""
    hold = round(500 / rate_hz)
    bits = np.random.default_rng(seed).integers(0, 2, (int(1000 * seconds / hold), 8))
    return np.repeat(bits, hold, axis=0).astype(float)


def apart(poses, others):
    """Largest distance in metres and turn in radians."""
    sign = np.sign(np.sum(poses[:, 3:] * others[:, 3:], axis=1))[:, None]
    turn = 2 * np.linalg.norm(poses[:, 3:] - sign * others[:, 3:], axis=1)
    return np.linalg.norm(poses[:, :3] - others[:, :3], axis=1).max(), turn.max()


@pytest.mark.parametrize(("rate_hz", "seed"), [(1, 4), (5, 4), (5, 5)])
def test_the_motion_is_mujocos(rate_hz, seed):
    model = inca()
    theta = model.theta({"coulomb_N_m": 0.0})
    start = static_pose(model, np.zeros(8), theta).pose
    references = random_bits(rate_hz, 3.0, seed)
    found = simulate_driven(model, np.concatenate([start, np.zeros(6)]), references, 1000.0, theta)
    expected = mujoco_driven(model.robot, TABLE_1, start, references, 1000.0, references[0])
    travel = np.ptp(expected[:, :3], axis=0).max()
    assert travel > 0.5, f"travels {travel:.2f} m: nothing was compared"
    metres, radians = apart(found.poses, expected)
    assert metres < 1e-6, f"{metres * 1e3:.6f} mm apart"
    assert radians < 1e-5, f"{radians * 1e3:.4f} mrad apart"


def test_energy_is_kept_under_constant_currents():
    model = build_driven(odd_robot())
    free = {name: 0.0 for name in ("coulomb_N_m", "viscous_N_m_s")}
    theta = model.theta(free)
    currents = np.linspace(0.2, 0.9, 8)
    references = np.tile(currents, (5001, 1))
    start = random_states(1)[0]
    found = simulate_driven(model, start, references, 1000.0, theta)
    kinetic, potential = evaluate(model.energy, found.states, found.currents_A, theta)
    drift = np.abs(kinetic + potential - kinetic[0] - potential[0]).max()
    assert drift < 1e-9 * kinetic.max(), f"drift {drift / kinetic.max():.1e} of the kinetic energy"


def test_tensions_do_the_work_of_the_motion():
    """Virtual work: the tensions' power on the platform is its gain of energy."""
    model = build_driven(odd_robot())
    states = random_states(20)
    currents = np.random.default_rng(5).uniform(0, 2, (20, 8))
    acceleration, tensions, _ = evaluate(model.motion, states, currents, model.declared)
    shift = 1e-6
    ahead, behind = (moved(states[:, :7], s * shift * states[:, 7:]) for s in (1.0, -1.0))
    lengths = [evaluate(model.lengths, poses, model.declared)[0] for poses in (ahead, behind)]
    rates = (lengths[0] - lengths[1]) / (2 * shift)
    power = -np.sum(tensions * rates, axis=1)
    mass, com, inertia = model.robot.platform.mass_kg, model.robot.platform.com_m, None
    xx, yy, zz, xy, xz, yz = mass * model.robot.platform.specific_inertia_m2  # pyright: ignore[reportOperatorIssue]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    gained = []
    for state, second in zip(states, acceleration, strict=True):
        turn = _matrix(state[3:7])
        v, w, a, alpha = state[7:10], state[10:], second[:3], second[3:]
        centre = v + turn @ np.cross(w, com)  # pyright: ignore[reportArgumentType, reportCallIssue]
        fall = a + turn @ (np.cross(alpha, com) + np.cross(w, np.cross(w, com)))  # pyright: ignore[reportArgumentType, reportCallIssue]
        central = inertia - mass * (com @ com * np.eye(3) - np.outer(com, com))  # pyright: ignore[reportArgumentType, reportCallIssue, reportOptionalOperand]
        force = mass * (fall - model.robot.gravity_m_s2)
        gained.append(force @ centre + w @ (central @ alpha))
    worst = np.abs(power - gained).max() / np.abs(gained).max()
    assert worst < 1e-7, f"{worst:.1e} apart"


def _matrix(q):
    w, x, y, z = q
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross


def test_a_batch_is_a_loop():
    model = inca()
    states, currents = random_states(7), np.random.default_rng(1).uniform(0, 2, (7, 8))
    together = evaluate(model.motion, states, currents, model.declared)
    alone = [
        evaluate(model.motion, *one, model.declared) for one in zip(states, currents, strict=True)
    ]
    for k, result in enumerate(together):
        assert np.array_equal(result, np.array([one[k] for one in alone]))


def test_slopes_are_differences():
    model = build_driven(odd_robot(), ("spring_constant", "platform_payload"))
    chosen = ("arm_m", "drum_m", "mass_kg", "Ixy_kg_m2", "spring_constant.added_5_N_m")
    theta = model.theta({"platform_payload.mass_kg": 0.05, "platform_payload.x_m": 0.1})
    state, currents = random_states(1, seed=3)[0], np.linspace(0, 1, 8)
    _, by_state, by_currents, by_chosen = evaluate(
        motion_slope(model, chosen), state, currents, theta
    )

    def at(state, currents, theta):
        return evaluate(model.motion, state, currents, theta)[0]

    found, expected = [], []
    for k in range(6):
        shift = np.zeros(6)
        shift[k] = 1e-6
        ahead, behind = (
            at(np.concatenate([moved(state[:7], s * shift), state[7:]]), currents, theta)
            for s in (1, -1)
        )
        expected.append((ahead - behind) / 2e-6)
        found.append((by_state[:, :7] @ pose_map(state[:7]))[:, k])
    for k, name in enumerate(chosen):
        step = np.zeros(len(theta))
        step[model.index(name)] = 1e-4 * abs(theta[model.index(name)]) or 1e-3
        size = step.max()
        expected.append(
            (at(state, currents, theta + step) - at(state, currents, theta - step)) / (2 * size)
        )
        found.append(by_chosen[:, k])
    for k in range(8):
        step = np.eye(8)[k]
        expected.append(at(state, currents + step, theta) - at(state, currents, theta))
        found.append(by_currents[:, k])
    worst = max(
        np.abs(f - e).max() / (1 + np.abs(e).max()) for f, e in zip(found, expected, strict=True)
    )
    assert worst < 2e-6, f"{worst:.1e} apart"


def test_at_zero_current_it_hangs_209_mm_below_the_centre():
    model = inca()
    rest = static_pose(model, np.zeros(8))
    assert abs(rest.pose[2] + 0.2093) < 1e-4, rest.pose
    state = np.concatenate([rest.pose, np.zeros(6)])
    still = evaluate(model.motion, state, np.zeros(8), model.declared)[0]
    assert np.abs(still).max() < 1e-10


def test_currents_that_hold_the_centre_do():
    model = inca()
    currents = holding_currents(model, CENTRE)
    state = np.concatenate([CENTRE, np.zeros(6)])
    still = evaluate(model.motion, state, currents, model.declared)[0]
    assert np.abs(still).max() < 1e-10
    assert np.allclose(static_pose(model, currents).pose, CENTRE, atol=1e-9)
    with pytest.raises(ValueError, match=r"takes .* A in motor"):
        holding_currents(model, np.array([1.1, 0, 0, 1.0, 0, 0, 0]))


def test_dry_friction_is_followed_whatever_the_step():
    model = inca()
    start = np.concatenate([static_pose(model, np.zeros(8)).pose, np.zeros(6)])
    references = random_bits(2, 1.5, seed=8)
    coarse = simulate_driven(model, start, references, 1000.0)
    fine = simulate_driven(model, start, references, 1000.0, least=16)
    gap = np.abs(coarse.angles_rad(CENTRE) - fine.angles_rad(CENTRE)).max()
    assert gap < 1e-4, f"{gap * 1e3:.3f} mrad apart (an encoder step is 1.5)"


def test_steps_follow_the_fastest_friction():
    model = inca()
    theta = model.theta({"coulomb_N_m": 44e-3})
    decay = 44e-3 / 0.1 / 3.88e-5 + 6.68e-5 / 3.88e-5
    assert substeps_for(model, 0.99 * MOST_DECAY / decay, theta) == 1
    assert substeps_for(model, 1.01 * MOST_DECAY / decay, theta) == 2
    assert substeps_for(model, 1e-3, model.declared) == 2
    with pytest.raises(ValueError, match="motor_inertia_kg_m2"):
        substeps_for(model, 1.0, model.declared)


def test_six_cables_will_do_and_five_will_not():
    model = build_driven(odd_robot(6))
    assert evaluate(model.motion, random_states(1)[0], np.ones(6), model.declared)[0].shape == (6,)
    with pytest.raises(ValueError, match="n >= 6"):
        build_driven(odd_robot(5))


def test_a_platform_that_is_pulled_away_is_lost():
    model = inca()
    theta = model.theta({"spring_N_m": 0.0, "coulomb_N_m": 0.0})
    start = np.concatenate([CENTRE, np.zeros(6)])
    with pytest.raises(ValueError, match=r"the platform is at|frames away"):
        simulate_driven(model, start, np.zeros((3000, 8)), 1000.0, theta)
