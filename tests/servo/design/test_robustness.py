"""Draws, rays and places: what is examined, and by what numbers."""

import json

import numpy as np
import pytest

from freeswing.cdpr.files.problems import InputError
from freeswing.results.driven.estimates import read_identified
from freeswing.servo.design.drawn_robots import Cloud, by_identified, by_table_1
from freeswing.servo.design.offer import Order, offer
from freeswing.servo.design.plant import plant_at
from freeswing.servo.design.robustness import (
    Examiner,
    Found,
    _first_failure,
    _pays,
    held_shares,
)
from freeswing.servo.design.schedule import Schedule, scheduled
from freeswing.servo.driven_file import read_driven
from freeswing.servo.files.task_file import Task, Watch
from freeswing.servo.files.weights_file import USUAL, Goals
from freeswing.servo.loop.feasible_path import leaves_workspace
from tests.places import SAMPLES

FAR = np.array([0.1, 0.5, -0.1, 0.0, 0.1, 0.2])


@pytest.fixture(scope="module")
def model():
    return read_driven(SAMPLES / "inca-6d")[1]


def document(**changes):
    parameters = [
        {"name": "mass_kg", "value": 0.3, "std": 0.01},
        {"name": "Iyy_kg_m2", "value": 2e-4, "std": 1e-5, "tied": ["Izz_kg_m2"]},
        {"name": "theta_xz_rad", "value": None, "std": None},
    ]
    correlation = [[1.0, 0.6, 0.0], [0.6, 1.0, 0.0], [0.0, 0.0, 0.0]]
    joint = {"parameters": parameters, "correlation": correlation} | changes
    return {"format": "freeswing-drive-result/1", "estimates": {"joint": joint}}


def read(folder, model, table):
    path = folder / "drive.json"
    path.write_text(json.dumps(table))
    return read_identified(path, model)


def test_draws_have_the_identified_covariance_and_its_ties(tmp_path, model):
    found = read(tmp_path, model, document())
    cloud = by_identified(found, "drive.json")
    assert cloud.note.endswith("theta_xz_rad")
    rng = np.random.default_rng(0)
    drawn = np.array([list(cloud.draw(model, rng)[1].values()) for _ in range(4000)])
    wanted = np.array([[1e-4, 6e-8], [6e-8, 1e-10]])
    spread = np.cov(drawn[:, :2].T)
    assert np.abs(spread / wanted - 1.0).max() < 0.1, spread
    np.testing.assert_array_equal(drawn[:, 1], drawn[:, 2])
    theta, numbers = cloud.draw(model, rng)
    assert theta[model.index("mass_kg")] == numbers["mass_kg"]
    kept = model.index("theta_xz_rad")
    assert theta[kept] == model.declared[kept]


def test_wide_draws_stay_robots(model):
    cloud = Cloud("", (("mass_kg",),), np.array([0.3]), np.array([[1.0]]))
    rng = np.random.default_rng(0)
    least = min(cloud.draw(model, rng)[1]["mass_kg"] for _ in range(50))
    assert least == pytest.approx(0.03)
    table = by_table_1(model)
    assert table.covariance[0, 0] == pytest.approx((0.068 * 2.5) ** 2)


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ({"format": "freeswing-robot/1"}, "must be 'freeswing-drive-result/1'"),
        (document(parameters=[{"name": "colour", "value": 1.0, "std": 0.1}]), "colour: no numbers"),
        (document(correlation=[[1.0]]), "correlation of shape"),
        (
            document(correlation=[[1.0, 2.0, 0], [2.0, 1.0, 0], [0, 0, 0]]),
            "make no covariance",
        ),
        (document(parameters=[{"name": "mass_kg", "value": None, "std": None}]), "nothing"),
        ({"format": "freeswing-drive-result/1"}, "estimates"),
    ],
)
def test_what_is_no_covariance_of_this_robot_is_refused(tmp_path, model, table, says):
    with pytest.raises(InputError, match=says):
        read(tmp_path, model, table)


def test_a_scheduled_plant_is_pushed_as_at_the_design(model):
    schedule = Schedule(model, np.zeros(6))
    here, there = plant_at(model, np.zeros(6)), plant_at(model, FAR)
    turned = scheduled(there, schedule.factor(FAR))
    np.testing.assert_allclose(turned.system.B, here.system.B, rtol=1e-9, atol=1e-9)
    assert np.abs(there.system.B - here.system.B).max() > 0.1 * np.abs(here.system.B).max()
    np.testing.assert_allclose(schedule.factor(np.zeros(6)), np.eye(6), atol=1e-12)


def test_margins_fall_away_from_the_centre_and_less_so_when_scheduled(model):
    order = Order(Goals(USUAL, None))
    found = offer(model, "hinf", order)
    examiner, schedule = Examiner(found, order), Schedule(model, np.zeros(6))
    there = plant_at(model, FAR, order.delay_s)
    seen = [
        examiner.look(plant_at(model, np.zeros(6), order.delay_s)),
        examiner.look(there, gamma=False),
        examiner.look(scheduled(there, schedule.factor(FAR)), gamma=False),
    ]
    assert seen[0].gamma == pytest.approx(found.facts["norm"], rel=2e-3)
    assert seen[0].position == pytest.approx(found.delayed.position.modulus_margin, rel=0.02)
    assert seen[1].margin < seen[2].margin < seen[0].margin + 0.05


def test_a_ray_is_followed_to_the_first_failure():
    def look(pose):
        return Found(bool(pose[0] < 0.37), 0.5, 0.5)

    assert _first_failure(look, np.eye(6)[0]) == pytest.approx(0.37, abs=1e-4)
    assert _first_failure(lambda pose: Found(True, 0.5, 0.5), np.eye(6)[0]) is None


def test_failing_has_two_sides():
    assert Found(True, 0.21, 0.9).fails is False
    assert Found(True, 0.19, 0.9).fails is True
    assert Found(False, 0.9, 0.9).fails is True
    assert "does not pay" in _pays(0.4, 0.49)
    assert "keeps" in _pays(0.4, 0.51)
    assert "keeps" in _pays(0.19, 0.19)


def test_held_places_are_those_that_a_task_may_visit(model):
    ray = 1.2 * np.eye(6)[0]
    share = held_shares(model, ray)[0]
    ends = []
    for factor in (0.98, 1.1):
        poses = np.vstack([np.zeros(6), factor * share * ray])
        task = Task(np.array([0.0, 1.0]), poses, 2.0, Watch())
        ends.append(leaves_workspace(model, task) is None)
    assert ends == [True, False], share


def test_an_empty_workspace_is_said(model):
    from freeswing.servo.design.robustness import _sentences

    worst = {"margin": 0.4}
    draws = {"count": 2, "source": "x", "unstable": 0, "failing": 0, "worst": worst,
             "gamma_largest": 1.0, "note": ""}  # fmt: skip
    assert "no workspace to examine" in _sentences([], [], draws)[0]
