"""Few samples far from a motion are named; a motion that is not followed is another matter."""

import numpy as np
import pytest

from freeswing.ident.judge.far_samples import FAR, far_sentence

TIMES = np.arange(400) / 50.0
POSE = ("x", "y", "z", "phi", "theta", "chi")


def residuals(usual_m=1e-4):
    return usual_m * np.random.default_rng(1).normal(size=(len(TIMES), 6))


def test_noise_and_what_a_model_lacks_are_not_named():
    assert far_sentence("a", TIMES, POSE, residuals()) == ""
    slow = np.sin(3.0 * TIMES) * np.exp(-TIMES / 3.0)
    assert far_sentence("a", TIMES, POSE, residuals() + 1e-2 * slow[:, None]) == ""


@pytest.mark.parametrize(("times_usual", "is_named"), [(0.8, False), (1.2, True)])
def test_one_sample_is_named_with_what_it_does(times_usual, is_named):
    off = residuals()
    usual = np.median(np.linalg.norm(off[:, :3], axis=1))
    off[200, :3] = [times_usual * FAR * usual, 0.0, 0.0]
    said = far_sentence("check-01", TIMES, POSE, off)
    assert bool(said) == is_named
    if is_named:
        assert said.startswith("run check-01: 1 of 400 samples (4.00 s) lie up to 1.78 mm")
        assert "12 times the usual distance: with them it is off by 0.11" in said
        assert "without them by 0.0" in said


@pytest.mark.parametrize(("count", "is_named"), [(20, True), (21, False)])
def test_up_to_a_twentieth_are_few(count, is_named):
    off = residuals()
    off[100 : 100 + count, 1] += 0.3
    said = far_sentence("a", TIMES, POSE, off)
    assert bool(said) == is_named
    assert ("20 of 400 samples (2.00 s to 2.38 s) lie up to 300 mm" in said) == is_named


def test_angles_alone_are_named_in_mrad():
    off = residuals()[:, :1]
    off[7] = 0.05
    assert "(0.14 s) lie up to 50 mrad" in far_sentence("a", TIMES, ("chi",), off)
