"""Which sets of wrong places count, and how small slow errors get: both sides of each number."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.ident.diagnose.lengths import equilibria, length_rows, stated_lengths
from freeswing.ident.diagnose.lengths.joint_lengths import Blocks, Normal
from freeswing.ident.diagnose.lengths.place_probabilities import groups, mixed, set_probabilities
from freeswing.ident.likelihood.samples_and_noise import prepare
from tests.ident.swings import paper_model, recorded, swing

TWO = Blocks({"first": np.array([0]), "second": np.array([1])}, np.full(2, 1e-3), np.full(2, 12e-3))


def normal(matrix: float, right: float) -> Normal:
    """Four runs that see each unknown by itself, alike."""
    return Normal(
        np.tile(matrix * np.eye(2), (4, 1, 1)), np.full((4, 2), right), np.zeros(4), (), np.ones(4)
    )


def test_one_place_in_thirty_is_off_beforehand() -> None:
    """Runs that show next to nothing leave it at that, and two are off once in nine hundred."""
    found = set_probabilities(normal(1e-6, 0.0), TWO)
    off = found[("first",)] + found[("first", "second")]
    assert 28.0 < 1.0 / off < 32.0, off
    assert found[("first", "second")] == pytest.approx(off**2, rel=1e-3)


@pytest.mark.parametrize(("n", "together"), [(3, True), (4, False)])
def test_of_three_places_one_is_told_to_be_off(n, together) -> None:
    """Of four that replace each other nobody is told: they are 97 % together, 24 % each."""
    names = "abcd"[:n]
    chances = {(name,): 0.97 / n for name in names} | {(): 0.03}
    assert groups(chances, list(names)) == ([tuple(names)] if together else [])


@pytest.mark.parametrize(("chance", "counts"), [(1.85e-3, False), (2.15e-3, True)])
def test_sets_of_two_in_a_thousand_move_the_mean(chance, counts) -> None:
    known = normal(1e6, 1e4)
    usual = mixed(known, TWO, {(): 1.0}, ())
    both = mixed(known, TWO, {(): 1.0 - chance, ("second",): chance}, ())
    assert (both.values[1] != usual.values[1]) == counts


@pytest.mark.parametrize(("stated", "least_m"), [(False, 2e-5), (True, 1e-4)])
def test_slow_errors_are_never_smaller(monkeypatch, stated, least_m) -> None:
    """20 micrometres where poses say nothing of them, a tenth of a millimetre where they do."""
    run = recorded(swing(2, duration_s=0.6), "a", coordinates=POSE_COORDINATES)
    samples = prepare(run, (0.0, 0.6))
    if stated:
        monkeypatch.setattr(length_rows, "frame_root", lambda *_: np.zeros((6, 0)))
        samples = replace(samples, slow=SimpleNamespace(drift_covariance=np.zeros((6, 6))))
    model = paper_model()
    nothing = np.zeros(len(model.parameters))
    pattern = {"made": np.zeros((len(samples.times_s), model.robot.n_cables, 1))}
    rows = length_rows.length_rows(model, np.ones(9), samples, np.ones(2), nothing, pattern)
    assert rows.least_size * length_rows.DRIFT_M == pytest.approx(least_m, rel=0.05)


def test_slow_errors_of_poses_and_pulleys() -> None:
    """A tenth of a millimetre, half a milliradian; of a length three tenths of a millimetre."""
    along, about = np.eye(6)[[0, 3]]
    found = length_rows.slow_covariance(np.stack([along, about]), length_rows.usual_drift())
    np.testing.assert_allclose(found, np.diag([1e-8 + 9e-8, 25e-8 + 9e-8]), rtol=1e-9)


def test_what_stands_beside_the_geometry_may_be_anywhere_in_a_platform() -> None:
    """Five centimetres, and a base a fiftieth of a radian off its level."""
    np.testing.assert_allclose(equilibria.sizes_beside(), [0.05] * 3 + [0.2] * 3, rtol=0.1)


@pytest.mark.parametrize(("squares", "off"), [(46.3, False), (47.3, True)])
def test_stated_lengths_that_chance_puts_so_far_off_want_no_explaining(monkeypatch, squares, off):
    """Of 21 lengths a chi-square of 46.8 is one of a thousand; three runs state none."""
    each = np.full(3, np.sqrt(squares / 21.0))
    monkeypatch.setattr(
        stated_lengths, "lengths_residual", lambda _, told: each if told else each[:0]
    )
    fit = SimpleNamespace(motions=[None] * 10, samples=[True] * 7 + [False] * 3)
    assert stated_lengths.lengths_off(fit) == off
    assert not stated_lengths.lengths_off(SimpleNamespace(motions=[None] * 3, samples=[False] * 3))
