"""Cables over swivel pulleys: derivatives against differences, eyelets as a limit, domain."""

from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.undefined_poses import check_domain, domain_problems
from freeswing.cdpr.robot import Robot
from freeswing.cdpr.rotation import angle_rate_matrix, matrix_from_angles
from tests.cdpr.model_cases import ROBOTS, differences, random_states, ring, robot_named


def _shrunk(robot, radius):
    cables = tuple(replace(cable, pulley_radius_m=radius) for cable in robot.cables)
    return Robot(robot.name, cables, robot.gravity_m_s2, None, robot.platform)


@pytest.mark.parametrize("eyelets", [False, True])
@pytest.mark.parametrize("name", ROBOTS)
def test_first_and_second_derivatives_are_differences(name, eyelets):
    model = build_model(robot_named(name, eyelets))
    for zeta, rates in zip(*random_states(model.robot, 4), strict=True):
        outputs = evaluate(model.cables, zeta, [])
        second = evaluate(model.cable_rates, zeta, rates, [])
        for value in range(3):

            def quantity(at, value=value):
                return evaluate(model.cables, at, [])[value]

            def slope(at, value=value, rates=rates):
                return evaluate(model.cables, at, [])[3 + value] @ rates

            first = np.abs(differences(quantity, zeta) - outputs[3 + value]).max()
            apart = np.abs(differences(slope, zeta, 1e-4) - second[value]).max()
            assert first < 1e-7, f"output {value}: first derivatives {first:.1e} apart"
            assert apart < 1e-7, f"output {value}: second derivatives {apart:.1e} apart"


@pytest.mark.parametrize("name", ROBOTS)
def test_cables_are_those_of_the_paper(name):
    """Eqs. (2)-(8) of the self-calibration paper: the tangent from A to the pulley."""
    robot = robot_named(name)
    model = build_model(robot)
    for zeta in random_states(robot, 10)[0]:
        lengths, swivels, wraps, jacobian = evaluate(model.cables, zeta, [])[:4]
        turn, rate = matrix_from_angles(zeta[3:]), angle_rate_matrix(zeta[3:])
        for k, cable in enumerate(robot.cables):
            radius, axis = cable.pulley_radius_m, cable.swivel_z
            lever = turn @ cable.attachment_m
            u = np.cos(swivels[k]) * cable.swivel_x + np.sin(swivels[k]) * cable.swivel_y
            n = np.cos(wraps[k]) * u + np.sin(wraps[k]) * axis
            straight = zeta[:3] + lever - (cable.entry_m + radius * (u + n))
            t = straight / np.linalg.norm(straight)
            gaps = [
                np.cross(u, axis) @ (zeta[:3] + lever - cable.entry_m),
                n @ straight,
                np.linalg.norm(straight) + radius * (np.pi - wraps[k]) - lengths[k],
                *(np.concatenate([t, rate.T @ np.cross(lever, t)]) - jacobian[k]),
            ]
            worst = np.abs(gaps).max()
            assert worst < 1e-13, f"cable {cable.name}: {worst:.1e}"


def test_a_small_pulley_becomes_an_eyelet():
    robot = robot_named("bologna-4")
    zetas = random_states(robot, 10)[0]
    eyelet = evaluate(build_model(_shrunk(robot, 0.0)).cables, zetas, [])
    lengths = [np.linalg.norm(p) for p in _spans(robot, zetas[0])]
    assert np.abs(eyelet[0][0] - lengths).max() < 1e-15
    for radius in (1e-4, 1e-6):
        small = evaluate(build_model(_shrunk(robot, radius)).cables, zetas, [])
        apart = max(np.abs(small[k] - eyelet[k]).max() for k in (0, 3))
        assert apart < 4 * radius, f"radius {radius}: {apart:.1e}"


def _spans(robot, zeta):
    return zeta[:3] + robot.attachments_m @ matrix_from_angles(zeta[3:]).T - robot.entries_m


def test_an_eyelet_straight_above_is_no_singularity():
    model = build_model(ring(3, radius=0.0))
    zeta = np.zeros(6)
    cable = model.robot.cables[0]
    zeta[:3] = cable.entry_m - cable.attachment_m - [0.0, 0.0, 1.0]
    assert not domain_problems(model, zeta)
    lengths, jacobian = (evaluate(model.cables, zeta, [])[k] for k in (0, 3))
    assert lengths[0] == pytest.approx(1.0, abs=1e-15)
    assert np.isfinite(jacobian).all()


def test_points_inside_a_pulley_and_on_its_axis_are_named():
    robot = robot_named("bologna-4")
    model = build_model(robot)
    zetas = np.tile(random_states(robot, 1)[0], (6, 1))
    second, third = robot.cables[1], robot.cables[2]
    zetas[1:3, 3:] = 0.0
    zetas[1, :3] = second.entry_m + 0.025 * second.swivel_x - second.attachment_m
    zetas[2, :3] = third.entry_m - 0.3 * third.swivel_z - third.attachment_m
    zetas[3, 4] = np.pi / 2
    zetas[4, 0] = np.nan
    found = [(p.sample, p.cable) for p in domain_problems(model, zetas)]
    assert found == [(1, "2"), (2, "3"), (3, ""), (4, "")], found
    with pytest.raises(ValueError, match=r"sample 1: cable 2: .*inside its pulley.*0\.025"):
        check_domain(model, zetas)
    with pytest.raises(ValueError, match="swivel axis"):
        check_domain(model, zetas[2])
    with pytest.raises(ValueError, match="theta is 90"):
        check_domain(model, zetas[3])
    check_domain(model, zetas[[0, 5]])
