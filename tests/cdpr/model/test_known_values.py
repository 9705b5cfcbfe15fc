"""Values known beforehand as a joint Gaussian."""

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.known_values import (
    prior_whitener,
    with_effects,
    with_known,
    without_effect,
)
from tests.oracle.scenes.robots import declared_robot

PLACES = np.array([3, 4, 5])


@pytest.fixture(scope="module")
def known():
    model = build_model(declared_robot("three-cable"), ("attachment_offset",))
    root = 1e-3 * np.array([[1.0, 0.0, 0.0], [2.0, 1.0, 0.0], [-1.0, 0.5, 0.3]])
    known = with_known(model, PLACES, np.array([1e-3, -2e-3, 3e-3]), root @ root.T, "a test")
    return known, root @ root.T


def test_the_whitener_makes_the_joint_prior_of_unit_deviation(known):
    model, covariance = known
    whitener = prior_whitener(model)
    precision = (whitener.T @ whitener)[np.ix_(PLACES, PLACES)]
    assert np.linalg.inv(precision) == pytest.approx(covariance, rel=1e-9)
    assert model.start_values[PLACES] == pytest.approx([1e-3, -2e-3, 3e-3])
    assert whitener[0, 0] == pytest.approx(1.0 / model.parameters[0].prior_std)


def test_what_is_known_stays_known_in_larger_and_smaller_models(known):
    model, covariance = known
    larger = with_effects(model, ("translational_drag",))
    for one in (larger, without_effect(larger, "translational_drag")):
        whitener = prior_whitener(one)
        precision = (whitener.T @ whitener)[np.ix_(PLACES, PLACES)]
        assert np.linalg.inv(precision) == pytest.approx(covariance, rel=1e-9)
    assert without_effect(larger, "attachment_offset").correlations.shape == (2, 2)  # pyright: ignore[reportOptionalMemberAccess]
