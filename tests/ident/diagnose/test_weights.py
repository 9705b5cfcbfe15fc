"""Probabilities of rival models: noise, leads of one run, discrepancies of unknown size."""

import numpy as np
import pytest

from freeswing.ident.diagnose.weights import CHANCE_OF_EFFECT, log_predictive, model_weights

COUNTS = np.full(7, 6000.0)
FEW = np.full(7, 40.0)


def test_models_that_predict_alike_keep_their_odds():
    same = np.linspace(-3.0, 2.0, 7)
    none, one = model_weights([same, same], [0, 1])
    assert none + one == pytest.approx(1.0)
    assert one == pytest.approx(CHANCE_OF_EFFECT, rel=1e-6)


def test_a_lead_that_all_runs_share_is_believed_and_one_run_s_is_not():
    nothing = np.zeros(7)
    shared, of_one = np.full(7, 3.0), np.array([21.0, *np.full(6, -1.5)])
    assert model_weights([nothing, shared], [0, 1])[1] > 0.99
    believed = model_weights([nothing, of_one], [0, 1])[1]
    assert 0.05 < believed < 0.9, believed


def test_two_causes_that_take_turns_are_both_possible():
    turns = np.array([4.0, -4.0, 3.0, -3.0, 2.0, -2.0, 0.0])
    weights = model_weights([np.full(7, -50.0), turns, -turns], [0, 1, 1])
    assert weights[0] < 1e-6
    assert weights[1:] == pytest.approx([0.5, 0.5], abs=0.15)


def test_at_the_noise_half_the_squares_count_and_above_it_their_ratio():
    at_noise = log_predictive(COUNTS + 2.0, COUNTS, FEW) - log_predictive(COUNTS, COUNTS, FEW)
    assert at_noise == pytest.approx(np.full(7, -1.0), rel=0.03)
    below = log_predictive(COUNTS - 8.0, COUNTS, FEW) - log_predictive(COUNTS, COUNTS, FEW)
    assert below == pytest.approx(np.full(7, 4.0))
    far = log_predictive(200 * COUNTS, COUNTS, FEW) - log_predictive(100 * COUNTS, COUNTS, FEW)
    assert far == pytest.approx(np.full(7, -20.0 * np.log(2.0)), rel=0.02)
