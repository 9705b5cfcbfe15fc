import numpy as np

from freeswing.cdpr.driven.linear import linear_model, modes
from freeswing.cdpr.driven.model import build_driven
from freeswing.cdpr.model.batch import evaluate
from tests.cdpr.driven_robots import inca, odd_robot

TILTED = np.array([0.2, -0.1, 0.15, 0.2, -0.15, 0.3])


def rotation(angles):
    (sr, sp, sy), (cr, cp, cy) = np.sin(angles), np.cos(angles)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def jacobian_tilde(robot, x):
    """R_pm^-1 J A_v of the paper's section 3.1, (n, 6)."""
    turn, (_, sp, sy), (_, cp, cy) = rotation(x[3:]), np.sin(x[3:]), np.cos(x[3:])
    spin = np.array([[cy * cp, -sy, 0], [sy * cp, cy, 0], [-sp, 0, 1]])
    arms = robot.attachments_m @ turn.T
    lines = x[:3] + arms - robot.entries_m
    lengths = np.linalg.norm(lines, axis=1)
    along = lines / lengths[:, None]
    return np.hstack([along, np.cross(arms, along) @ spin]) / 0.0175, lengths, spin, turn


def closed_form(robot, x):
    """M_o, C_o, K_o as (16) has them, its derivative of J~ by central differences."""
    j, lengths, spin, turn = jacobian_tilde(robot, x)
    inertia = turn @ np.diag([1.49e-4, 2.07e-4, 2.07e-4]) @ turn.T
    mass = np.zeros((6, 6))
    mass[:3, :3], mass[3:, 3:] = 0.289 * np.eye(3), spin.T @ inertia @ spin
    keq = 14.4 * 0.006**2
    columns = []
    for k in range(6):
        step = 1e-6 * np.eye(6)[k]
        slope = (jacobian_tilde(robot, x + step)[0] - jacobian_tilde(robot, x - step)[0]) / 2e-6
        columns.append(slope.T @ (keq * lengths / 0.0175))
    stiff = j.T @ (keq * j) + np.array(columns).T
    return mass + 3.88e-5 * j.T @ j, 6.68e-5 * j.T @ j, stiff


def test_the_closed_form_of_the_paper():
    model = inca()
    for x in (np.zeros(6), TILTED):
        linear = linear_model(model, x)
        mass, damping, stiff = closed_form(model.robot, x)
        for name, found, expected, limit in (
            ("M_o", linear.mass, mass, 1e-12),
            ("C_o", linear.damping, damping, 1e-12),
            ("K_o", linear.stiffness, stiff, 1e-8),  # the paper's derivative, by differences here
        ):
            worst = np.abs(found - expected).max() / np.abs(expected).max()
            assert worst < limit, f"{name}: {worst:.1e} apart"


def second_rates(model, theta, x, rates, wrench):
    """X'' of the nonlinear plant under a wrench in base axes, by its own acceleration."""
    turn = rotation(x[3:])
    spin = jacobian_tilde(model.robot, x)[2]
    ahead = jacobian_tilde(model.robot, x + 1e-6 * rates)[2]
    behind = jacobian_tilde(model.robot, x - 1e-6 * rates)[2]
    omega = spin @ rates[3:]
    half = _quaternion(turn)
    state = np.concatenate([x[:3], half, rates[:3], turn.T @ omega])
    gains = evaluate(model.wrench_matrix, state[:7], theta)[0]
    local = np.concatenate([wrench[:3], turn.T @ wrench[3:]])
    acceleration = evaluate(model.motion, state, np.linalg.pinv(gains) @ local, theta)[0]
    second = np.linalg.solve(spin, turn @ acceleration[3:] - (ahead - behind) / 2e-6 @ rates[3:])
    return np.concatenate([acceleration[:3], second])


def _quaternion(turn):
    w = 0.5 * np.sqrt(1 + np.trace(turn))
    skew = turn - turn.T
    return np.array([w, skew[2, 1] / 4 / w, skew[0, 2] / 4 / w, skew[1, 0] / 4 / w])


def test_the_linear_model_is_the_plants_difference_quotient():
    for model in (inca(), build_driven(odd_robot())):
        theta = model.theta({"coulomb_N_m": 0.0})
        linear = linear_model(model, TILTED, theta)
        columns = []
        for k in range(12):
            gaps = []
            for step in (2e-4, 1e-4):  # Richardson: the quotients' error falls by 16
                shift = step * np.eye(12)[k]
                ahead, behind = (
                    second_rates(model, theta, TILTED + s * shift[:6], s * shift[6:], linear.wrench)
                    for s in (1, -1)
                )
                gaps.append((ahead - behind) / (2 * step))
            columns.append((4 * gaps[1] - gaps[0]) / 3)
        expected = np.array(columns).T
        worst = np.abs(linear.A[6:] - expected).max() / np.abs(expected).max()
        assert worst < 1e-8, f"{model.robot.name}: {worst:.1e} apart"


def test_modes_of_the_inca():
    found = modes(linear_model(inca(), np.zeros(6)))
    rates = [mode.rate_rad_s for mode in found]
    assert np.allclose(rates, [4.318, 4.677, 4.936, 26.37, 28.23, 37.95], rtol=1e-3), rates
    assert [mode.words for mode in found[:3]] == ["only z", "only y", "only x"]


def test_at_rest_of_low_rates_the_gain_is_the_springs():
    linear = linear_model(inca(), np.zeros(6))
    gains = np.linalg.svd(linear.response(np.array([1e-6]))[0, :3, :3])[1]
    assert np.allclose(gains, 0.0739, rtol=1e-2), gains
