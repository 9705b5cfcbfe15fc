"""Derivatives of motions by start, inertia, effects, geometry and lengths against differences."""

from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.elastic_motion import SPRUNG, elastic_values
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.free_motion import (
    admissible_rates,
    assemble,
    choose_free_coordinates,
    coordinate_indices,
    free_basis,
)
from freeswing.cdpr.simulation.free_swing import simulate
from freeswing.cdpr.simulation.sensitivity import Factors, linearise, linearise_beside
from freeswing.cdpr.simulation.start_state import by_free_coordinates, start_slopes
from tests.cdpr.model_cases import differences, swing_start

TIMES_S = np.linspace(0.0, 1.5, 16)
TIGHT = 1e-13


def close(found, expected):
    """Largest difference over the size of each column."""
    size = np.abs(expected).max(axis=(0, 1)) + 1e-3
    return float((np.abs(found - expected) / size).max())


@pytest.mark.parametrize(
    ("effects", "values"),
    [
        ((), []),
        (("translational_drag", "harmonic_force"), [0.2, 0.5, 0.1, 0, 0.1, 0, 0.1, 0, 1.5]),
        (("swivel_viscous", "cable_mass", "pulley_radius"), [0.01, 0.002, 1e-3, 0, -1e-3, 0]),
    ],
)
def test_by_inertia_and_effects(effects, values):
    values = np.array(values, dtype=float)
    model, inertia, zeta, rates = swing_start("bologna-4", effects, values=values, speed=0.0)
    motion = simulate(model, zeta, rates, (0.0, 1.5), inertia, values, TIGHT)
    found, found_rates = linearise(motion).at(TIMES_S)

    def moved(shared):
        other = simulate(model, zeta, rates, (0.0, 1.5), shared[:9], shared[9:], TIGHT)
        return np.stack(other.at(TIMES_S)[:2])

    expected = differences(moved, np.concatenate([inertia, values]), 1e-4)
    columns = slice(12, 21 + len(values))
    worst = max(
        close(found[:, :, columns], expected[0]), close(found_rates[:, :, columns], expected[1])
    )
    assert worst < 1e-7, f"{worst:.1e} of each column's size"


def test_by_free_coordinates_lengths_and_geometry():
    """The start follows from free coordinates and lengths; anchors move with it."""
    effects = ("anchor_offset",)
    model, inertia, zeta, rates = swing_start("bologna-4", effects)
    values = model.start_values
    free = choose_free_coordinates(model, zeta[None])[0]
    chosen, lengths = coordinate_indices(free), evaluate(model.lengths, zeta, values)[0]
    motion = simulate(model, zeta, rates, (0.0, 1.5), inertia, values, TIGHT)
    slopes = start_slopes(model, free, zeta, rates, inertia, values)
    found = by_free_coordinates(linearise(motion).at(TIMES_S)[0][:, :, :33], slopes)

    def moved(given):
        own, speeds, told, shared, offsets = np.split(given, [2, 4, 8, 17])
        start = assemble(model, free, told, own[None], zeta, offsets, 1e-14).zetas[0]
        basis = free_basis(model, free, start, np.zeros(6), offsets)
        begin = admissible_rates(model, start, basis.zeta_map @ speeds, shared, offsets)
        return simulate(model, start, begin, (0.0, 1.5), shared, offsets, TIGHT).at(TIMES_S)[0]

    given = np.concatenate([zeta[chosen], rates[chosen], lengths, inertia, values])
    expected = differences(moved, given, 1e-4)
    worst = close(found, expected)
    assert found.shape == (16, 6, 29)
    assert worst < 1e-7, f"{worst:.1e} of each column's size"


def test_by_compliance_and_unstretched_lengths():
    rigid, inertia, zeta, _ = swing_start("bologna-4")
    model = build_model(rigid.robot, SPRUNG)
    lengths = evaluate(rigid.lengths, zeta, [])[0] - 0.001
    values = elastic_values(model, 2e-4, lengths)
    motion = simulate(model, zeta, np.zeros(6), (0.0, 0.5), inertia, values, TIGHT)
    times = np.linspace(0.0, 0.5, 6)
    found = linearise(motion).at(times)[0][:, :, 21:28]

    def moved(scaled):
        own = values * scaled
        other = simulate(model, zeta, np.zeros(6), (0.0, 0.5), inertia, own, TIGHT)
        return other.at(times)[0]

    expected = differences(moved, np.ones(7), 1e-4)
    worst = close(found * values, expected)
    assert worst < 1e-7, f"{worst:.1e} of each column's size"


def test_start_slopes_refuse_singular_choices():
    model, inertia, zeta, rates = swing_start("bologna-4")
    with pytest.raises(ValueError, match="4 cables leave 2"):
        start_slopes(model, ("x",), zeta, rates, inertia)


def test_values_that_do_nothing_are_quicker_and_the_same():
    """Screens hold further effects where they do nothing: all slopes, without their expressions."""
    effects = ("translational_drag", "pulley_friction", "clock_offset", "harmonic_force")
    start = np.array([0.2, 0.5, 0.0, 0.0, 0, 0, 0, 0, 0, 0, 1.5])
    model, inertia, zeta, rates = swing_start("bologna-4", effects, values=start, speed=0.0)
    motion = simulate(model, zeta, rates, (0.0, 1.5), inertia, start, TIGHT)
    fewer = build_model(model.robot, effects[:1])
    same = replace(motion, model=fewer, values=start[:2])
    whole = linearise(motion)
    slopes, wanted = whole.accelerations, np.ones(9 + len(start), dtype=bool)
    wanted[[3, 9, 12, -1]] = False
    for asked in (np.ones_like(wanted), wanted):
        beside = linearise_beside(linearise(same, asked[:11]), motion, asked)
        for quick in (beside, linearise(motion, asked, len(start) - 2)):
            assert quick.columns.tolist() == [*range(12), *(12 + np.flatnonzero(asked))]
            states, nodes = (part[..., quick.columns] for part in (whole.states, slopes))
            np.testing.assert_allclose(quick.states, states, atol=1e-9 * np.abs(states).max())
            least = 1e-9 * np.abs(nodes).max()
            np.testing.assert_allclose(quick.accelerations, nodes, atol=least)
    with pytest.raises(ValueError, match="known by others"):
        linearise_beside(linearise(same), motion, wanted)


def test_factors_solve_for_one_right_side_and_for_many():
    matrices = np.random.default_rng(1).normal(size=(5, 12, 12))
    right = np.random.default_rng(2).normal(size=(5, 12, 3))
    factors = Factors.of(matrices.copy())
    np.testing.assert_allclose(matrices @ factors.solved(right), right, atol=1e-12)
    one, among = factors.solved(right[..., 1]), factors.solved(right)[..., 1]
    np.testing.assert_allclose(one, among, atol=1e-12)
    matrices[3, 4] = 0.0
    with pytest.raises(np.linalg.LinAlgError, match="Singular"):
        Factors.of(matrices)


def test_what_is_held_costs_nothing_and_changes_no_other_slope():
    effects = ("translational_drag", "attachment_offset", "platform_frame")
    model, inertia, zeta, rates = swing_start("bologna-4", effects)
    motion = simulate(model, zeta, rates, (0.0, 1.5), inertia, model.start_values, TIGHT)
    wanted = np.zeros(9 + len(model.start_values), dtype=bool)
    wanted[[0, 4, 9, 12, -1]] = True
    whole, some = linearise(motion), linearise(motion, wanted=wanted)
    assert some.asked.tolist() == [*range(12), *(12 + np.flatnonzero(wanted))]
    assert some.columns.tolist() == some.asked[:-1].tolist(), "the frame moves no platform"
    for one, other in zip(whole.at(TIMES_S), some.at(TIMES_S), strict=True):
        expected = one[..., some.columns]
        np.testing.assert_allclose(other, expected, atol=1e-9 * np.abs(expected).max())
