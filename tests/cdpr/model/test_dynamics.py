"""Internal dynamics: W against the model, virtual work, power, batches, slopes, many cables."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.effects import catalogue
from freeswing.cdpr.model.batch import evaluate, with_jacobian
from freeswing.cdpr.model.elastic_motion import SPRUNG
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.free_motion import admissible_rates, choose_free_coordinates, free_basis
from freeswing.cdpr.model.internal_dynamics import body_regressor, internal_regressor, twist_of
from freeswing.cdpr.rotation import angle_rate_matrix, matrix_from_angles
from tests.cdpr.model_cases import (
    ROBOTS,
    differences,
    random_states,
    ring,
    robot_named,
    true_inertia,
)


def allowed_states(model, count, seed=0):
    zetas, rates = random_states(model.robot, count, seed)
    inertia = true_inertia(model.robot)
    pairs = zip(zetas, rates, strict=True)
    return zetas, np.array([admissible_rates(model, *pair, inertia) for pair in pairs]), inertia


def regressor_along(model, zetas, rates, second):
    turn, turn_rate = evaluate(model.twist_map, zetas, rates)
    twist, twist_rate = twist_of(turn, turn_rate, rates, second)
    rotations = matrix_from_angles(zetas[..., 3:])
    gravity = model.robot.gravity_m_s2
    return body_regressor(
        rotations, twist_rate[..., :3], twist[..., 3:], twist_rate[..., 3:], gravity
    )


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
def test_w_holds_the_models_motion_and_tensions(n):
    """Eqs. (18) and (20)-(22): W chi = -Xi^T tau, and nothing is left of W' chi'."""
    model = build_model(ring(n))
    zetas, rates, inertia = allowed_states(model, 20)
    second, tensions = evaluate(model.acceleration, 0.0, zetas, rates, inertia, [])
    regressor = regressor_along(model, zetas, rates, second)
    chi = np.concatenate([[1.0], inertia])
    rows = evaluate(model.cables, zetas, [])[3]
    rows[..., 3:] = rows[..., 3:] @ np.linalg.inv(angle_rate_matrix(zetas[:, 3:]))
    gap = np.abs(regressor @ chi + (np.swapaxes(rows, 1, 2) @ tensions[..., None])[..., 0]).max()
    free, amount = choose_free_coordinates(model, zetas)
    basis = free_basis(model, free, zetas, rates, np.zeros(0))
    left = np.abs(internal_regressor(regressor, basis.xi_perp) @ chi).max()
    assert gap < 1e-11, f"{n} cables: eq. (18) is off by {gap:.1e} m/s2"
    assert left < 1e-11 * amount, f"{n} cables: eq. (21) leaves {left:.1e} m/s2"


@pytest.mark.parametrize("name", ROBOTS)
def test_held_cables_do_not_lengthen_and_do_no_work(name):
    model = build_model(robot_named(name))
    zetas, rates, inertia = allowed_states(model, 20)
    second = evaluate(model.acceleration, 0.0, zetas, rates, inertia, [])[0]
    jacobian = evaluate(model.cables, zetas, [])[3]
    jacobian_rate = evaluate(model.cable_rates, zetas, rates, [])[0]
    lengthening = np.einsum("tnk,tk->tn", jacobian, second)
    lengthening += np.einsum("tnk,tk->tn", jacobian_rate, rates)
    assert np.abs(lengthening).max() < 1e-12, f"{np.abs(lengthening).max():.1e} m/s2"
    power = [
        _energy_slope(model, *state, inertia) for state in zip(zetas, rates, second, strict=True)
    ]
    assert np.abs(power).max() < 1e-8, f"energy changes by {np.abs(power).max():.1e} m2/s3"


def _energy_slope(model, zeta, rates, second, inertia, values=()):
    def total(state):
        return np.add(*evaluate(model.energy, state[:6], state[6:], inertia, values))

    return differences(total, np.concatenate([zeta, rates])) @ np.concatenate([rates, second])


def test_effects_take_the_power_they_should():
    """Drag's wrench times the twist is what the energy loses."""
    model = build_model(robot_named("bologna-4"), ("translational_drag", "rotational_drag"))
    zetas, rates, inertia = allowed_states(model, 10)
    values = np.array([0.3, 0.0, 0.02])
    second = evaluate(model.acceleration, 0.0, zetas, rates, inertia, values)[0]
    for zeta, rate, acceleration in zip(zetas, rates, second, strict=True):
        twist = evaluate(model.twist_map, zeta, rate)[0] @ rate
        taken = -0.3 * twist[:3] @ twist[:3] - 0.02 * twist[3:] @ twist[3:]
        lost = _energy_slope(model, zeta, rate, acceleration, inertia, values)
        assert lost == pytest.approx(taken, abs=1e-8)


@pytest.mark.parametrize("name", [None, *sorted(catalogue())])
def test_acceleration_and_tension_slopes_are_differences(name):
    model = build_model(robot_named("bologna-4"), () if name is None else (name,))
    zetas, rates, inertia = allowed_states(model, 1, seed=3)
    values = model.start_values + [0.3 * p.scale for p in model.parameters]
    whole = np.concatenate([zetas[0], rates[0], inertia, values])
    for output in (0, 1):

        def function(at, output=output):
            parts = np.split(at, [6, 12, 21])
            return evaluate(model.acceleration, 0.2, *parts)[output]

        slopes = evaluate(
            with_jacobian(model.acceleration, (1, 2, 3, 4), output),
            *(0.2, zetas[0], rates[0], inertia, values),
        )[1]
        worst = np.abs(differences(function, whole, 2e-4) - slopes)
        relative = (worst / (1.0 + np.abs(slopes))).max()
        assert relative < 1e-7, f"output {output}: {relative:.1e}"


def test_batches_are_loops():
    model = build_model(robot_named("bologna-4"), ("cable_mass",))
    zetas, rates, inertia = allowed_states(model, 1500 + 37)
    times = np.linspace(0, 1, len(zetas))
    arguments = (times, zetas, rates, inertia, [0.003])
    together = evaluate(model.acceleration, *arguments)
    one_by_one = [
        evaluate(model.acceleration, t, z, r, inertia, [0.003])
        for t, z, r in zip(times[::100], zetas[::100], rates[::100], strict=True)
    ]
    for k in (0, 1):
        alone = np.array([one[k] for one in one_by_one])
        assert np.array_equal(together[k][::100], alone)
    grid = zetas[:12].reshape(3, 4, 6)
    shaped = evaluate(model.cables, grid, [0.003])
    assert [part.shape for part in shaped] == [(3, 4, 4)] * 3 + [(3, 4, 4, 6)] * 3
    assert evaluate(model.lengths, np.zeros((0, 6)), [0.003])[0].shape == (0, 4)
    with pytest.raises(ValueError, match="last axis must be 6"):
        evaluate(model.lengths, np.zeros((5, 4)), [0.003])


@pytest.mark.parametrize("n", [6, 7, 8])
def test_six_cables_and_more_have_kinematics_and_forces_but_no_free_motion(n):
    model = build_model(ring(n), ("translational_drag",))
    zeta, inertia = np.zeros(6), model.robot.inertia
    jacobian = evaluate(model.cables, zeta, model.start_values)[3]
    assert np.linalg.matrix_rank(jacobian) == 6
    gradient = evaluate(model.lagrangian, zeta, np.zeros(n), inertia, model.start_values)[1]
    tensions = np.linalg.lstsq(jacobian.T, -gradient, rcond=None)[0]
    state = (0.0, zeta, np.zeros(6), tensions, inertia, model.start_values)
    still = np.abs(evaluate(model.pulled, *state)[0]).max()
    assert still < 1e-12, f"{still:.1e} m/s2 under balanced tensions"
    with pytest.raises(ValueError, match=f"{n} cables hold the platform.*5 or fewer"):
        evaluate(model.acceleration, 0.0, zeta, zeta, inertia, model.start_values)
    with pytest.raises(ValueError, match="no free coordinates"):
        free_basis(model, (), zeta, zeta, model.start_values)


@pytest.mark.parametrize("n", [6, 7, 8])
def test_six_cables_and_more_can_have_a_late_clock(n):
    model = build_model(ring(n), ("clock_offset",))
    rates = np.array([0.1, 0.2, 0.3, 0.0, 0.0, 0.5])
    seen = evaluate(model.measured, 0.0, np.zeros(6), rates, model.robot.inertia, [0.01])[0]
    assert np.allclose(seen, [0.0, 0.0, 0.0, *(-0.01 * rates[3:])])


def test_held_and_pulled_motions_agree():
    model = build_model(robot_named("bologna-4"), ("pulley_friction", "tether"))
    zetas, rates, inertia = allowed_states(model, 5)
    values = [0.0, 1.0, 0.2, -0.1, 0.3, 0.4, 0.1, 0.0, 0.05]
    second, tensions = evaluate(model.acceleration, 0.1, zetas, rates, inertia, values)
    pulled = evaluate(model.pulled, 0.1, zetas, rates, tensions, inertia, values)[0]
    assert np.abs(pulled - second).max() < 1e-12


def test_models_refuse_what_they_cannot_be_built_from():
    robot = robot_named("bologna-4")
    with pytest.raises(ValueError, match="no effect is called 'drag'"):
        build_model(robot, ("drag",))
    with pytest.raises(ValueError, match="named twice"):
        build_model(robot, ("tether", "tether"))
    with pytest.raises(ValueError, match="give a tuple"):
        build_model(robot, "tether")  # pyright: ignore[reportArgumentType]


def test_a_pickled_model_has_the_functions_of_whoever_built_the_same():
    """What is derived from them, Jacobians and tapes, need not be made again."""
    robot = robot_named("bologna-4")
    model = replace(build_model(robot, ("translational_drag",)), correlations=np.eye(2))
    came = pickle.loads(pickle.dumps(model))
    assert came.acceleration is model.acceleration is build_model(robot, model.effects).acceleration
    np.testing.assert_array_equal(came.correlations, np.eye(2))
    other = build_model(robot, SPRUNG)
    came = pickle.loads(pickle.dumps(other))
    assert came.names == other.names
    assert came.acceleration.n_instructions() == other.acceleration.n_instructions()
