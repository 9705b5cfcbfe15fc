"""Frames of the runs beside effects: as well known as poses state, and a tolerance beside it."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.measured.slow_errors import BESIDE_STATED
from freeswing.ident.diagnose.answer.settled_geometry import settled_places
from freeswing.ident.diagnose.declared_model import with_frames
from freeswing.ident.likelihood.run_residuals import own_covariance
from tests.oracle.scenes.robots import declared_robot

TOLERATED = np.diag(np.repeat([5e-4, 2e-3], 3) ** 2)


def test_frames_are_no_geometry_that_lengths_have_settled() -> None:
    model = with_frames(declared_robot("three-cable"), ("platform_frame",))
    assert model.effects == ("platform_frame",)
    assert {one.source for one in model.parameters} == {BESIDE_STATED}
    assert settled_places(model).size == 0


@pytest.mark.parametrize("std", [5e-5, 5e-3])
def test_what_a_run_states_of_its_frame_counts_beside_the_tolerance(std: float) -> None:
    """Poses that state 5 mm had been taken for good to half a millimetre."""
    model = with_frames(declared_robot("three-cable"), ("platform_frame",))
    stated = std**2 * (np.eye(6) + 0.3)
    samples: Any = SimpleNamespace(slow=SimpleNamespace(frame_covariance=stated))
    assert own_covariance(model, samples) == pytest.approx(stated + TOLERATED)


def test_a_run_that_states_nothing_has_its_frame_to_the_tolerance() -> None:
    model = with_frames(declared_robot("three-cable"), ("platform_frame",))
    silent: Any = SimpleNamespace(slow=None)
    assert own_covariance(model, silent) == pytest.approx(TOLERATED)


def test_a_model_without_nuisances_is_the_declared_one() -> None:
    assert with_frames(declared_robot("three-cable"), ()).effects == ()
