"""Sets of wrong places by linear evidence: made-up numbers of which the truth is known."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.ident.diagnose.leave_one_out import Evidence
from freeswing.ident.diagnose.sets.sets_of_places import (
    LinearSets,
    count_of,
    is_place,
    likely_sets,
)
from freeswing.ident.diagnose.variants import effect_of, inside
from freeswing.ident.likelihood.blocks import columns_of
from tests.oracle.scenes.robots import declared_robot

ROBOT = declared_robot("three-cable")
EFFECTS = ("anchor_offset", "cable_length_bias", "attachment_offset")
MODEL = build_model(ROBOT, EFFECTS)
FIRST, RUNS, NUMBERS = 9, 7, 60
KEYS = [
    "anchor_offset",
    "cable_length_bias",
    *(f"anchor_offset:{cable.name}" for cable in ROBOT.cables),
    *(f"attachment_offset:{cable.name}" for cable in ROBOT.cables),
]


def of(key: str) -> np.ndarray:
    return columns_of(MODEL, effect_of(key))[inside(ROBOT, key)]


def made(true: dict[str, np.ndarray], seed: int, imitated: float) -> LinearSets:
    """Linear runs in which what lengths told wrong do is what two anchors do, but for a share."""
    generator = np.random.default_rng(seed)
    size = FIRST + len(MODEL.parameters)
    rows = 1e5 * generator.standard_normal((RUNS, NUMBERS, size))
    alike = rows[..., [*of("anchor_offset:2"), *of("anchor_offset:3")]]
    mixed = alike @ generator.standard_normal((6, 3))
    biases = of("cable_length_bias")
    rows[..., biases] = imitated * mixed + (1.0 - imitated) * rows[..., biases]
    rows[..., :FIRST] *= 1e-3
    truth = np.zeros(size)
    for key, values in true.items():
        truth[of(key)] = values
    seen = generator.standard_normal((RUNS, NUMBERS)) - rows @ truth
    triangles = np.concatenate([rows, seen[..., None]], axis=2)
    known = np.zeros((size - FIRST, size + 1))
    known[:, FIRST:-1] = np.diag([1.0 / one.prior_std for one in MODEL.parameters])
    # Linearised at what all anchors make of it.
    free = np.r_[:FIRST, of("anchor_offset")]
    answer = np.linalg.lstsq(rows.reshape(-1, size)[:, free], -seen.ravel(), rcond=None)[0]
    values = np.zeros(size - FIRST)
    values[free[FIRST:] - FIRST] = answer[FIRST:]
    triangles[..., -1] += rows[..., FIRST:] @ values
    known[:, -1] = known[:, FIRST:-1] @ values
    evidence = Evidence(tuple("abcdefg"), triangles, np.full(RUNS, float(NUMBERS)), known.copy())
    found = SimpleNamespace(fit=SimpleNamespace(inertia=np.zeros(FIRST)))
    columns = {key: of(key) for key in KEYS}
    return LinearSets(
        found, MODEL, values, evidence, known, np.arange(FIRST), columns, np.full(RUNS, 60.0)
    )


OFF = {"anchor_offset:1": np.array([4.0, -2.0, 1.0]) * 1e-3}
BIASED = OFF | {"cable_length_bias": np.array([2.0, -1.5, 2.5]) * 1e-3}


@pytest.mark.parametrize("seed", range(5))
def test_one_anchor_and_lengths_told_wrong_are_found_behind_all_anchors(seed: int) -> None:
    """Nine numbers follow them as well as six, but for a share that no one set of runs shows."""
    sets = made(BIASED, seed, imitated=0.9999)
    found = likely_sets(sets, "anchor_offset")
    assert found[0] == ("anchor_offset:1", "cable_length_bias"), found
    assert sets.log_evidence(found[0]) > sets.log_evidence(("anchor_offset",))


@pytest.mark.parametrize("seed", range(5))
def test_one_anchor_alone_needs_no_set(seed: int) -> None:
    found = likely_sets(made(OFF, seed, imitated=0.9999), "anchor_offset")
    assert found[0] == ("anchor_offset:1",), found


def test_what_a_set_drops_is_led_back_to_nothing() -> None:
    sets = made(BIASED, 1, imitated=0.5)
    told = sets.answer(("anchor_offset:1", "cable_length_bias"))
    assert set(told) == {"anchor_offset", "cable_length_bias"}
    np.testing.assert_allclose(told["cable_length_bias"], BIASED["cable_length_bias"], atol=1e-5)
    np.testing.assert_allclose(told["anchor_offset"][:3], OFF["anchor_offset:1"], atol=1e-5)
    assert not told["anchor_offset"][3:].any()


def test_no_set_has_more_numbers_than_what_was_found() -> None:
    """What needs more is for a further round to show."""
    sets = made(BIASED, 2, imitated=0.9999)
    for key in ("anchor_offset:1", "anchor_offset"):
        found = likely_sets(sets, key)
        assert found
        assert max(count_of(ROBOT, one) for one in found) <= count_of(ROBOT, (key,))


def test_a_place_is_geometry_and_no_force_nor_stretch() -> None:
    places = ("anchor_offset", "pulley_axis", "cable_length_bias", "marker_offset")
    assert all(map(is_place, places))
    assert not any(map(is_place, ("gravity_tilt", "cable_elasticity", "rotational_drag")))
