"""What is told of values that each run has for itself."""

import numpy as np
import pytest

from freeswing.ident.diagnose.answer.entries import std_of_rms


def test_two_runs_are_told_with_half_of_what_parts_them():
    assert std_of_rms(np.array([[3.0], [-4.0]])) == pytest.approx([0.5])


def test_runs_that_agree_but_for_the_sign_leave_no_doubt_of_the_size():
    assert std_of_rms(np.array([[0.2], [-0.2], [0.2]])) == pytest.approx([0.0], abs=1e-12)


def test_independent_values_scatter_as_told():
    draws = np.random.default_rng(5).normal(size=(12, 4000))
    scatter = np.sqrt(np.mean(draws**2, axis=0)).std()
    told = np.sqrt(np.mean(std_of_rms(draws) ** 2))
    assert told == pytest.approx(scatter, rel=0.1)
