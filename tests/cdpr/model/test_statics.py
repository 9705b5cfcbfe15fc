"""Equilibria: the paper's Table 2, tensions given, effects at rest, stability, frequencies."""

import numpy as np
import pytest

from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.free_motion import admissible_rates
from freeswing.cdpr.model.statics import (
    equilibria,
    equilibrium_at_lengths,
    equilibrium_at_tensions,
    modes,
)
from freeswing.cdpr.simulation.free_swing import simulate
from tests.cdpr.model_cases import (
    MIDDLE,
    TABLE_2,
    differences,
    report,
    rest_of,
    robot_named,
    swing_start,
    true_inertia,
)

MASS_KG = 12.0  # of the prototype; the paper keeps its tensions within 20 and 200 N


@pytest.mark.parametrize("column", range(12))
def test_table_2_hangs_stable_and_taut(column):
    model = build_model(robot_named("bologna-4"))
    inertia, middle = model.robot.inertia, MIDDLE["bologna-4"]
    rest = equilibrium_at_lengths(model, TABLE_2[column], middle, inertia)
    assert rest is not None
    tensions = MASS_KG * rest.tensions
    hertz = modes(model, rest, inertia).frequencies_hz
    report(f"column {column + 1}: P {rest.zeta[:3].round(3)} m, tensions {tensions.round(1)} N, ")
    report(f"  {hertz.round(3)} Hz")
    entries = model.robot.entries_m
    assert rest.stable
    assert rest.taut
    assert np.all((tensions > 20.0) & (tensions < 200.0)), tensions
    assert np.all(rest.zeta[:2] > entries[:, :2].min(axis=0)), rest.zeta
    assert np.all(rest.zeta[:2] < entries[:, :2].max(axis=0)), rest.zeta
    assert rest.zeta[2] < entries[:, 2].min(), rest.zeta
    assert np.abs(evaluate(model.lengths, rest.zeta, [])[0] - TABLE_2[column]).max() < 1e-10
    second, specific = evaluate(model.acceleration, 0.0, rest.zeta, np.zeros(6), inertia, [])
    assert np.abs(second).max() < 1e-9, f"moves at {np.abs(second).max():.1e} m/s2"
    assert np.abs(specific - rest.tensions).max() < 1e-9


def test_the_three_cable_robots_printed_pose():
    """Self-calibration 2019: 40 N in each cable, 8 kg."""
    model = build_model(robot_named("three-cable"))
    inertia, start = model.robot.inertia, MIDDLE["three-cable"]
    rest = equilibrium_at_tensions(model, np.full(3, 40.0 / 8.0), start, inertia)
    assert rest is not None
    assert rest.stable
    off = np.abs(rest.zeta - [-1.363, 0.963, -0.460, -0.056, -0.069, -0.557]).max()
    assert off < 2e-3, f"{off:.1e} from the printed pose"
    again = equilibrium_at_lengths(model, rest.lengths_m, start, inertia)
    assert again is not None
    assert np.abs(again.zeta - rest.zeta).max() < 1e-8
    assert np.abs(again.tensions - 5.0).max() < 1e-7, again.tensions


def test_all_equilibria_are_found_and_sorted():
    model = build_model(robot_named("bologna-4"))
    inertia = model.robot.inertia
    found = equilibria(model, np.random.default_rng(0), inertia, lengths_m=TABLE_2[5], starts=25)
    assert found[0].stable
    assert found[0].taut
    for rest in found:
        jacobian = evaluate(model.cables, rest.zeta, [])[3]
        gradient = evaluate(model.lagrangian, rest.zeta, rest.tensions, inertia, [])[1]
        assert np.abs(gradient).max() < 1e-9
        free = np.linalg.svd(jacobian)[2][4:]
        hessian = evaluate(model.lagrangian, rest.zeta, rest.tensions, inertia, [])[2]
        assert rest.stable == bool(np.linalg.eigvalsh(free @ hessian @ free.T)[0] > 0.0)
    with pytest.raises(ValueError, match="not both and not neither"):
        equilibria(model, np.random.default_rng(0), inertia)


def test_stable_equilibria_are_least_energy():
    model, inertia, zeta, _ = swing_start("bologna-4")
    rest = rest_of(model, inertia)

    def potential(at):
        return evaluate(model.energy, at, np.zeros(6), inertia, [])[1]

    assert potential(zeta) > potential(rest.zeta)
    gradient = evaluate(model.lagrangian, rest.zeta, np.zeros(4), inertia, [])[1]
    assert np.abs(differences(potential, rest.zeta) - gradient).max() < 1e-8


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("constant_force", [0.3, -0.2, 0.1]),
        ("gravity_tilt", [0.02, -0.03]),
        ("tether", [1.0, 0.5, -0.5, 0.3, 0.5, 0.05, 0.1, -0.1]),
        ("torsion_spring", [0.3, 0.1]),
        ("cable_mass", [0.004]),
        ("cable_elasticity", [2e-4, 2e-7]),
        ("cable_length_bias", [0.004, -0.003, 0.002, 0.001]),
        ("pulley_axis", [0.03, -0.02, 0.02, 0.04, 0.01, 0.03, -0.02, 0.01]),
    ],
)
def test_a_platform_at_rest_stays_with_effects(effect, values):
    model = build_model(robot_named("bologna-4"), (effect,))
    inertia, values = true_inertia(model.robot), np.array(values)
    start = rest_of(build_model(model.robot), inertia)
    rest = equilibrium_at_lengths(model, TABLE_2[0], start.zeta, inertia, values)
    assert rest is not None
    moved = np.abs(rest.zeta - start.zeta).max()
    state = (0.0, rest.zeta, np.zeros(6), inertia, values)
    second, tensions = evaluate(model.acceleration, *state)
    told = evaluate(model.told, *state)[0]
    assert moved > 1e-4, f"the effect moves the rest by {moved:.1e} only"
    assert np.abs(second).max() < 1e-9, f"moves at {np.abs(second).max():.1e} m/s2"
    assert np.abs(told - TABLE_2[0]).max() < 1e-10
    assert np.abs(tensions - rest.tensions).max() < 1e-9


@pytest.mark.parametrize("name", ["bologna-4", "three-cable"])
def test_small_swings_have_the_modes_frequencies(name):
    model = build_model(robot_named(name))
    inertia = true_inertia(model.robot)
    rest = rest_of(model, inertia)
    found = modes(model, rest, inertia)
    for hertz, shape in zip(found.frequencies_hz, found.shapes.T, strict=True):
        rates = admissible_rates(model, rest.zeta, 1e-4 * shape, inertia)
        quarter = np.array([0.25, 0.5, 1.0]) / hertz
        motion = simulate(model, rest.zeta, rates, (0.0, quarter[-1]), inertia)
        moved, speeds, _ = motion.at(quarter)
        reach = np.abs(moved[0] - rest.zeta).max()
        back = np.abs(moved[1:] - rest.zeta).max() / reach
        turned = np.abs(speeds[1] + rates).max() / np.abs(rates).max()
        assert back < 1e-3, f"{hertz:.3f} Hz: {back:.1e} of the swing left after half a period"
        assert turned < 1e-3, f"{hertz:.3f} Hz: {turned:.1e}"


def test_a_top_heavy_platform_is_not_stable_and_has_no_modes():
    model = build_model(robot_named("bologna-4"))
    inertia = model.robot.inertia
    rest = rest_of(model, inertia)
    high = inertia.copy()
    high[2], high[3:5] = 2.0, high[3:5] + 4.0
    with pytest.raises(ValueError, match="not stable"):
        modes(model, rest, high)
    with pytest.raises(ValueError, match="not that of a body"):
        modes(model, rest, inertia * [1, 1, 10, 1, 1, 1, 1, 1, 1])
    found = equilibrium_at_lengths(model, rest.lengths_m, rest.zeta, high)
    assert found is None or np.abs(found.zeta - rest.zeta).max() > 0.1


def test_wrong_inputs_are_named():
    model = build_model(robot_named("bologna-4"))
    start, inertia = MIDDLE["bologna-4"], model.robot.inertia
    with pytest.raises(ValueError, match=r"lengths_m has shape \(3,\), must be \(4,\)"):
        equilibrium_at_lengths(model, np.ones(3), start, inertia)
    with pytest.raises(ValueError, match=r"start is .*finite"):
        equilibrium_at_lengths(model, np.ones(4), start * np.nan, inertia)
    with pytest.raises(ValueError, match=r"tensions has shape"):
        equilibrium_at_tensions(model, np.ones(3), start, inertia)
