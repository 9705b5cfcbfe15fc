"""Directions that data see, and deviations that are the larger of two."""

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.ident.diagnose.answer.deviations import directions, honest_covariance
from tests.oracle.scenes.robots import declared_robot


def test_a_point_known_along_one_line_alone_says_so():
    model = build_model(declared_robot("three-cable"), ("attachment_offset", "translational_drag"))
    place = np.arange(3, 6)
    line = np.array([0.6, 0.8, 0.0])
    covariance = 4e-6 * (np.eye(3) - np.outer(line, line)) + 1e-8 * np.outer(line, line)
    told = directions(model, place, covariance)
    assert [one["std_m"] for one in told] == pytest.approx([1e-4, 2e-3, 2e-3])
    assert abs(np.array(told[0]["direction"]) @ line) == pytest.approx(1.0)
    assert told[0]["point"] == f"offset_{model.robot.cables[1].name}"


def test_values_that_are_no_points_have_no_directions():
    model = build_model(declared_robot("three-cable"), ("translational_drag",))
    assert directions(model, np.array([0]), np.eye(1)) == []


def test_the_larger_of_posterior_and_jackknife_is_told():
    covariance = np.array([[4.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    found = SimpleNamespace(std=np.sqrt(np.diag(covariance)), covariance=covariance)
    free = np.array([True, True, False])
    scored = SimpleNamespace(
        fit=SimpleNamespace(free=free), score=SimpleNamespace(jackknife_std=np.array([1.0, 3.0]))
    )
    told = honest_covariance(found, scored)  # pyright: ignore[reportArgumentType]
    assert np.sqrt(np.diag(told)) == pytest.approx([2.0, 3.0, 0.0])
    assert told[0, 1] / 6.0 == pytest.approx(0.5)
