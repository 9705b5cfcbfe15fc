"""The rest model against the paper's printed example, its closed forms and differences."""

from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.robot import Platform
from freeswing.cdpr.rotation import angle_rate_matrix, matrix_from_angles, skew
from freeswing.homing.guess_from_tensions import (
    TensionEnergy,
    acquisition_tensions,
    free_indices,
    stable_starts,
)
from freeswing.homing.rest_readings import RestModel, geometry_labels, length_screws
from tests.paper_robots import LARGEST_N, PERTURBED_N, START, START_N, bologna_3, bologna_4

WEIGHT_N = 8.0 * 9.80665
PRINTED_START = [-1.363, 0.963, -0.460, -0.056, -0.069, -0.557]


def closed_forms(robot, pose):
    """Eqs. (2)-(7) and (23)-(28), straight from the paper, F3 over the weight."""
    turn, rate = matrix_from_angles(pose[3:]), angle_rate_matrix(pose[3:])
    sigma, length, sigma_by, length_by, screws, screws_by = [], [], [], [], [], []
    for cable in robot.cables:
        i, j, k = cable.swivel_x, cable.swivel_y, cable.swivel_z
        lever = turn @ cable.attachment_m
        span = pose[:3] + lever - cable.entry_m
        angle = np.arctan2(j @ span, i @ span)
        w, u = -np.sin(angle) * i + np.cos(angle) * j, np.cos(angle) * i + np.sin(angle) * j
        centre, r = span - cable.pulley_radius_m * u, cable.pulley_radius_m
        distance = np.sqrt(centre @ centre - r**2)
        psi = np.arctan2(k @ centre, u @ centre) + np.arctan2(distance, r)
        n, t = np.cos(psi) * u + np.sin(psi) * k, np.sin(psi) * u - np.cos(psi) * k
        move = np.hstack([np.eye(3), -skew(lever) @ rate])
        by_sigma, by_psi = w @ move / (u @ span), n @ move / distance
        t_by = np.outer(w * np.sin(psi), by_sigma) + np.outer(n, by_psi)
        lever_by = np.hstack([np.zeros((3, 3)), -skew(lever) @ rate])
        sigma.append(angle)
        length.append(distance + r * (np.pi - psi))
        sigma_by.append(by_sigma)
        length_by.append(t @ move)
        screws.append(np.hstack([t, np.cross(lever, t)]))
        screws_by.append(np.vstack([t_by, skew(lever) @ t_by - skew(t) @ lever_by]))
    down = robot.gravity_m_s2 / np.linalg.norm(robot.gravity_m_s2)
    com = turn @ robot.platform.com_m
    wrench = np.hstack([down, np.cross(com, down)])
    wrench_by = np.vstack(
        [np.zeros((3, 6)), skew(down) @ skew(com) @ np.hstack([np.zeros((3, 3)), rate])]
    )
    free = list(free_indices(robot, pose))
    bound = [c for c in range(6) if c not in free]
    screws = np.array(screws)
    tensions = np.linalg.solve(screws[:, bound].T, wrench[bound])
    balance = screws[:, free].T @ tensions - wrench[free]
    loads_by = sum(f * by for f, by in zip(tensions, screws_by, strict=True))
    carried = screws[:, free].T @ np.linalg.inv(screws[:, bound].T)
    balance_by = loads_by[free] - wrench_by[free] - carried @ (loads_by[bound] - wrench_by[bound])
    values = np.hstack([sigma, length, balance])
    return values, np.vstack([sigma_by, length_by, balance_by])


@pytest.mark.parametrize("robot", [bologna_3(), bologna_4()], ids=["three", "four"])
def test_values_and_derivatives_are_the_closed_forms(robot):
    robot = replace(robot, free_coordinates=None)  # each pose has its best conditioned ones
    rng = np.random.default_rng(0)
    middle = robot.entries_m.mean(axis=0) - [0.0, 0.0, 1.2]
    for _ in range(10):
        pose = np.hstack([middle, 0, 0, 0]) + 0.2 * rng.standard_normal(6)
        model = RestModel(robot, free_indices(robot, pose))
        found = model.evaluate(pose[None])
        values, by_pose = closed_forms(robot, pose)
        worst = np.abs(found.values[0] - values).max()
        assert worst < 1e-11, f"values differ by {worst:.1e}"
        worst = np.abs(found.by_pose[0] - by_pose).max()
        assert worst < 1e-10, f"eqs. (22)-(28) differ by {worst:.1e}"


def test_screws_obey_virtual_work():
    robot = bologna_3()
    screws, model = length_screws(robot, START), RestModel(robot, (3, 4, 5))
    by_pose = model.evaluate(START[None]).by_pose[0][model.columns("length")]
    spread = np.block(
        [[np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), angle_rate_matrix(START[3:])]]
    )
    worst = np.abs(screws @ spread - by_pose).max()
    assert worst < 1e-12, f"dl/dzeta differs from Xi D by {worst:.1e}"


def test_derivatives_by_geometry_are_differences():
    robot, step = bologna_3(), 1e-6
    model = RestModel(robot, (3, 4, 5), with_tensions=True, with_tilt=True)
    offsets = 1e-3 * np.random.default_rng(1).standard_normal(model.n_geometry)
    found = model.evaluate(START[None], offsets, by_geometry=True).by_geometry[0]
    for k in range(model.n_geometry):
        move = np.zeros(model.n_geometry)
        move[k] = step
        up, down = (model.evaluate(START[None], offsets + s * move).values[0] for s in (1, -1))
        worst = np.abs((up - down) / (2 * step) - found[:, k]).max()
        assert worst < 1e-8, f"{geometry_labels(robot)[k]}: {worst:.1e}"


def test_printed_start_pose_at_40_newton_needs_the_corrected_sign():
    start = stable_starts(TensionEnergy(bologna_3()), START_N / WEIGHT_N)
    assert len(start) == 1, f"{len(start)} stable poses, the paper says one"
    off = np.abs(start[0] - PRINTED_START).max()
    assert off < 1.2e-3, f"start pose is {off * 1e3:.2f} mm or mrad from the printed one"
    wrong = stable_starts(TensionEnergy(bologna_3(+0.211)), START_N / WEIGHT_N)
    far = min(np.abs(pose - PRINTED_START).max() for pose in wrong)
    assert far > 0.05, f"with +0.211 the nearest rest is {far:.3f} away: the sign would not matter"


def test_printed_lengths_and_equal_tensions():
    model = RestModel(bologna_3(), (3, 4, 5), with_tensions=True)
    pose = stable_starts(TensionEnergy(bologna_3()), START_N / WEIGHT_N)
    values = model.evaluate(pose).values[0]
    lengths, tensions = values[model.columns("length")], values[model.columns("tension")]
    off = np.abs(lengths - [1.470, 1.509, 1.543]).max()
    assert off < 1.6e-3, f"lengths {lengths} are {off * 1e3:.2f} mm from the printed ones"
    worst = np.abs(tensions * WEIGHT_N - 40).max()
    assert worst < 1e-6, f"tensions are off 40 N by {worst:.1e} N"
    balance = np.abs(values[model.columns("statics")]).max()
    assert balance < 1e-8, f"F3 is {balance:.1e} at rest"


def test_settling_finds_minima_of_the_energy_only():
    energy = TensionEnergy(bologna_3())
    pulls = acquisition_tensions(PERTURBED_N, LARGEST_N, 61) / WEIGHT_N
    rest = energy.settle(np.tile(START, (61, 1)), pulls)
    assert rest.settled.all(), f"{(~rest.settled).sum()} set-points without a stable pose"
    least = rest.smallest_stiffness.min()
    assert least > 0, f"smallest stiffness {least:.2e} over the weight"


def test_set_points_follow_the_procedure():
    tensions = acquisition_tensions(START_N, LARGEST_N, 13)
    expected = np.full((13, 3), 40.0)
    for cable in range(3):
        expected[1 + 4 * cable : 5 + 4 * cable, cable] = [60, 80, 60, 40]
    assert np.allclose(tensions, expected), f"set-points {tensions}"


def test_free_coordinates_are_chosen_where_none_are_declared():
    robot = replace(bologna_3(), free_coordinates=None)
    free = free_indices(robot, START)
    bound = [k for k in range(6) if k not in free]
    condition = np.linalg.cond(length_screws(robot, START)[:, bound])
    assert condition < 10, f"free {free} leave a block of condition {condition:.1f}"


def test_a_robot_without_centre_of_mass_is_refused():
    bare = replace(bologna_3(), platform=Platform(8.0))
    with pytest.raises(ValueError, match="com_m is missing"):
        RestModel(bare, (3, 4, 5))
