"""Directions that data see, and deviations that are the larger of two."""

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.ident.diagnose.answer.deviations import (
    chance_of_nothing,
    directions,
    honest_covariance,
)
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
    found = SimpleNamespace(stds=np.sqrt(np.diag(covariance)), covariance=covariance)
    free = np.array([True, True, False])
    scored = SimpleNamespace(
        fit=SimpleNamespace(free=free), score=SimpleNamespace(jackknife_std=np.array([1.0, 3.0]))
    )
    told = honest_covariance(found, scored)  # pyright: ignore[reportArgumentType]
    assert np.sqrt(np.diag(told)) == pytest.approx([2.0, 3.0, 0.0])
    assert told[0, 1] / 6.0 == pytest.approx(0.5)


def told_drag(deviations):
    """A fit of the three-cable robot with a drag so many deviations from nothing."""
    model = build_model(declared_robot("three-cable"), ("constant_force", "rotational_drag"))
    block = SimpleNamespace(value=np.array([1e-3 * deviations]), mask=np.ones(1, bool))
    unknowns = SimpleNamespace(block=lambda _: block, columns=lambda _: np.array([12]))
    return SimpleNamespace(model=model, unknowns=unknowns), 1e-6 * np.eye(13)


@pytest.mark.parametrize(("deviations", "chance"), [(0.0, 1.0), (1.0, 0.317), (2.0, 0.0455)])
def test_values_within_their_deviations_come_by_chance(deviations, chance):
    found, covariance = told_drag(deviations)
    told = chance_of_nothing(found, covariance, "rotational_drag")  # pyright: ignore[reportArgumentType]
    assert told == pytest.approx(chance, rel=0.01)


@pytest.mark.parametrize(("deviations", "chance"), [(2.0, 0.135), (6.0, 1.5e-8)])
def test_what_is_nothing_nowhere_along_a_bent_valley_is_seen(deviations, chance) -> None:
    """Coefficient and centre of a drag: each known to its own size, together twenty times better.

    Its chance is that of two values, since the centre was fitted too.
    """
    model = build_model(declared_robot("three-cable"), ("quadratic_drag",))
    std, along = 0.03, 0.999
    size = deviations * std * np.sqrt(1.0 - along**2)
    block = SimpleNamespace(value=np.array([size, 0.3]), mask=np.ones(2, bool))
    unknowns = SimpleNamespace(block=lambda _: block, columns=lambda _: np.array([1, 2]))
    covariance = np.eye(3)
    covariance[1:, 1:] = [[std**2, along * std * 0.1], [along * std * 0.1, 0.01]]
    found = SimpleNamespace(model=model, unknowns=unknowns)
    told = chance_of_nothing(found, covariance, "quadratic_drag")  # pyright: ignore[reportArgumentType]
    assert told == pytest.approx(chance, rel=0.05)
    alone = np.diag(np.diag(covariance))
    assert chance_of_nothing(found, alone, "quadratic_drag") > 0.9  # pyright: ignore[reportArgumentType]
