"""Every number of every effect is told in its own unit: a drag in m²/s was once told in ms."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.cdpr.effects import catalogue
from freeswing.cdpr.robot import INERTIA_NAMES
from freeswing.report.body import body_about_com, is_told
from freeswing.report.words import unit_of
from freeswing.results.common import Parameter
from tests.ident.swings import paper_model

# Numbers without a unit.
PURE = ("coefficient", "rest_share")
NAMES = sorted(
    {p.name for effect in catalogue().values() for p in effect.parameters(paper_model().robot)}
)


@pytest.mark.parametrize("name", NAMES)
def test_a_name_ends_in_its_unit(name: str) -> None:
    stem, scale, unit = unit_of(name)
    if name.startswith(PURE):
        return
    assert unit, name
    # What is left of the name holds no part of a unit any more.
    assert stem.rpartition("_")[2] not in ("m", "m2", "s", "s2", "rad", "kg"), (name, stem)
    assert scale in (1.0, 100.0, 1e3, 1e6)


def test_losses_have_their_units() -> None:
    assert unit_of("rate_m2_s") == ("rate", 1e3, "10⁻³ m²/s")
    assert unit_of("torque_m2_s2") == ("torque", 1e3, "10⁻³ m²/s²")
    assert unit_of("mass_over_stiffness_s2_m") == ("mass_over_stiffness", 1e6, "10⁻⁶ s²/m")


@pytest.mark.parametrize(("share", "told"), [(0.48, True), (0.54, False)])
def test_axes_are_shown_of_moments_that_are_told(share: float, told: bool) -> None:
    """Deviations of so much of every moment: 95 % of them reach zero or do not."""
    values = [0.0, 0.0, 0.0, 0.02, 0.03, 0.04, 0.0, 0.0, 0.0]
    stds = [0.0, 0.0, 0.0, *(share * np.array(values[3:6])), 1e-4, 1e-4, 1e-4]
    rows = zip(INERTIA_NAMES, values, stds, strict=True)
    body = body_about_com([Parameter(name=n, value=v, std=float(s) + 1e-9) for n, v, s in rows])
    assert body is not None
    assert is_told(body) == told


def test_a_wires_length_is_told_in_metres() -> None:
    """Cable 1's bias is no number per metre."""
    assert unit_of("bias_1_m") == ("bias_1", 1e3, "mm")


def test_a_hooks_compliance_is_told_in_square_seconds() -> None:
    """Cable 1's is no number per square second."""
    told = unit_of("mass_over_stiffness_1_s2")
    assert told == ("mass_over_stiffness_1", 1e6, "10⁻⁶ s²")
