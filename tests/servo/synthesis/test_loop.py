"""Bandwidths, margins and the delay margin."""

import numpy as np
import pytest

from freeswing.servo.files.weights_file import USUAL
from freeswing.servo.synthesis.discretise import pade
from freeswing.servo.synthesis.four_block import bare, weighted
from freeswing.servo.synthesis.gamma_search import synthesise
from freeswing.servo.synthesis.loop import delay_margin, examine
from freeswing.servo.synthesis.state_space import StateSpace, append, close, gain, series
from tests.servo.plants import inca_plant


@pytest.fixture(scope="module")
def paper():
    return synthesise(weighted(inca_plant(), USUAL)).controller


def test_the_papers_design_has_its_bandwidths_and_margins(paper):
    loop = examine(inca_plant(), paper)
    assert loop.stable
    assert loop.position.bandwidth_rad_s == pytest.approx(5.3, abs=0.2)
    assert loop.orientation.bandwidth_rad_s == pytest.approx(1.8, abs=0.1)
    assert loop.position.modulus_margin == pytest.approx(0.55, abs=0.02)
    assert loop.orientation.modulus_margin == pytest.approx(0.63, abs=0.02)
    assert loop.delay_margin_s == pytest.approx(0.031, abs=0.002)


def test_the_delay_margin_separates_stable_from_unstable(paper):
    plant = inca_plant()
    margin = delay_margin(plant, paper)
    for share, stable in ((0.97, True), (1.03, False)):
        late = series(plant, pade(share * margin, 6, 6))
        assert close(bare(late).plant, paper).is_stable() is stable, share
        assert examine(plant, paper, share * margin).stable is stable


def test_an_integrators_delay_margin_is_that_of_the_textbook():
    unit, none = np.ones((1, 1)), np.zeros((1, 1))
    one = StateSpace(none, unit, 2.0 * unit, none)
    plant = append(*[one] * 6)
    assert delay_margin(plant, gain(np.eye(6))) == pytest.approx(np.pi / 2 / 2.0, rel=1e-3)
    slow = StateSpace(-unit, unit, 0.5 * unit, none)
    assert delay_margin(append(*[slow] * 6), gain(np.eye(6))) == np.inf


def test_a_delay_that_is_designed_in_leaves_more_margin(paper):
    plant, delay = inca_plant(), 0.0137
    late = synthesise(weighted(series(plant, pade(delay, 2, 6)), USUAL)).controller
    before, after = examine(plant, paper, delay), examine(plant, late, delay)
    assert after.orientation.modulus_margin > before.orientation.modulus_margin + 0.1
    assert after.position.modulus_margin > before.position.modulus_margin
    assert after.delay_margin_s > 1.3 * before.delay_margin_s
