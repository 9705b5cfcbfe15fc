"""The model against the paper's matrices in roll, pitch, yaw, written apart (tests/oracle)."""

import numpy as np
import pytest

from freeswing.cdpr.driven.motion import simulate_driven
from freeswing.cdpr.model.batch import evaluate
from tests.cdpr.driven_robots import inca
from tests.oracle.witnesses.driven_plant import Plant

ONES = np.ones(8)


def plant(model, **changes):
    numbers = {
        "outputs": model.robot.entries_m,
        "arms": model.robot.attachments_m,
        "mass": 0.289,
        "inertia": np.array([1.49e-4, 2.07e-4, 2.07e-4]),
        "drum": 0.0175 * ONES,
        "spring": 14.4 * ONES,
        "motor": 3.88e-5 * ONES,
        "viscous": 6.68e-5 * ONES,
        "coulomb": 4.4e-3 * ONES,
        "torque": 0.0603 * ONES,
        "lag_s": 0.0013,
    }
    return Plant(**(numbers | changes))


def added(value, motor):
    """One motor's number other than the rest's."""
    return value * np.eye(8)[motor]


@pytest.mark.parametrize(
    ("effect", "number", "field", "amount", "base"),
    [
        (None, None, None, 0.0, 0.0),
        ("coulomb_friction", "added_5_N_m", "coulomb", 2.4e-3, 4.4e-3),
        ("viscous_friction", "added_3_N_m_s", "viscous", 3e-4, 6.68e-5),
        ("spring_constant", "added_8_N_m", "spring", 1.4, 14.4),
        ("torque_constant", "added_1_N_m_A", "torque", 3e-3, 0.0603),
        ("drum_radius", "added_2_m", "drum", 3.5e-4, 0.0175),
    ],
)
def test_accelerations_are_the_papers(effect, number, field, amount, base):
    model = inca(() if effect is None else (effect,))
    theta, changes = model.declared, {}
    if effect is not None:
        theta = model.theta({f"{effect}.{number}": amount})
        motor = int(number.split("_")[1]) - 1
        changes = {field: base * ONES + added(amount, motor)}
    paper, generator = plant(model, **changes), np.random.default_rng(6)
    plain = inca()
    worst = size = 0.0
    for _ in range(12):
        x, rates = generator.uniform(-0.3, 0.3, 6), generator.normal(size=6)
        currents = generator.uniform(0.0, 2.0, 8)
        _, _, turn, spin = paper.lines(x)
        omega = spin @ rates[3:]
        state = np.concatenate([x[:3], paper.quaternion(x), rates[:3], turn.T @ omega])
        found = evaluate(model.motion, state, currents, theta)[0]
        second = paper.second_rates(x, rates, currents)
        small = 1e-6 * rates
        spin_rate = (paper.lines(x + small)[3] - paper.lines(x - small)[3]) / 2e-6
        alpha = spin @ second[3:] + spin_rate @ rates[3:]
        expected = np.concatenate([second[:3], turn.T @ alpha])
        worst = max(worst, np.abs(found - expected).max() / np.abs(expected).max())
        without = evaluate(plain.motion, state, currents, plain.declared)[0]
        size = max(size, np.abs(found - without).max())
    assert worst < 1e-7, f"{worst:.1e} apart"
    assert effect is None or size > 1e-2, f"the effect is {size:.1e}: nothing was compared"


def test_a_motion_with_dry_friction_is_the_papers():
    model = inca()
    references = np.repeat(np.random.default_rng(9).integers(0, 2, (2, 8)), 50, axis=0) * 1.0
    paper, x = plant(model), np.array([0.02, -0.03, -0.15, 0.1, -0.05, 0.08])
    state = np.concatenate([x[:3], paper.quaternion(x), np.zeros(6)])
    found = simulate_driven(model, state, references, 1000.0, currents_A=np.zeros(8))  # pyright: ignore[reportArgumentType]
    expected = paper.motion(x, references, 1000.0, np.zeros(8))  # pyright: ignore[reportArgumentType]
    travel = np.ptp(expected[:, :3], axis=0).max()
    gap = np.abs(found.states[:, :3] - expected[:, :3]).max()
    assert gap < 2e-7, f"{gap * 1e3:.6f} mm apart after {travel * 1e3:.0f} mm of travel"
