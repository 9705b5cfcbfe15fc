"""Each assumption fails by itself, with a sentence that names the culprit."""

import numpy as np

from freeswing.servo.files.weights_file import USUAL
from freeswing.servo.synthesis.assumptions import failures
from freeswing.servo.synthesis.four_block import weighted
from freeswing.servo.synthesis.riccati import StandardProblem
from freeswing.servo.synthesis.state_space import StateSpace
from tests.servo.plants import inca_plant, random_problem

NAMES = ("first", "second")


def problem(A, b1, b2, c1, c2, D):
    B = np.column_stack([np.atleast_2d(b1).T, b2])
    return StandardProblem(StateSpace(A, B, np.vstack([c1, c2]), D), 1, 1)


def sound(A=((-1.0, 0.0), (0.0, -2.0)), b2=(1.0, 1.0), c2=(1.0, 1.0), **changes):
    D = np.array([[0.0, 0, 0], [0, 0, 1], [0, 1, 0]])
    b1 = changes.get("b1", ((1.0, 1.0), (0.0, 0.0)))
    c1 = changes.get("c1", ((1.0, 1.0), (0.0, 0.0)))
    return problem(np.array(A), np.array(b1), np.array(b2), np.array(c1), np.array(c2), D)


def test_sound_problems_have_no_failures():
    assert failures(sound(), NAMES) == []
    assert failures(weighted(inca_plant(), USUAL)) == []
    assert [failures(random_problem(seed)) for seed in range(6)] == [[]] * 6


def test_an_unstable_mode_that_no_control_reaches():
    found = failures(sound(A=((0.5, 0.0), (0.0, -2.0)), b2=(0.0, 1.0)), NAMES)
    assert found == ["the mode at 0.5 rad/s of first cannot be stabilised: no control reaches it"]
    assert failures(sound(b2=(0.0, 1.0)), NAMES) == []  # a mode that decays may be out of reach


def test_an_unstable_mode_that_nothing_measures():
    found = failures(sound(A=((-1.0, 0.0), (0.0, 0.3)), c2=(1.0, 0.0)), NAMES)
    assert len(found) == 1
    assert "0.3 rad/s of second is not seen" in found[0]


def test_a_zero_on_the_axis_from_control_to_judgement():
    found = failures(sound(A=((0.0, 0.0), (0.0, -2.0)), c1=((0.0, 1.0), (0.0, 0.0))), NAMES)
    assert len(found) == 1
    assert "from the controls to what is judged" in found[0]
    assert "first" in found[0]


def test_a_zero_on_the_axis_from_disturbance_to_measurement():
    found = failures(sound(A=((0.0, 0.0), (0.0, -2.0)), b1=((0.0, 1.0), (0.0, 0.0))), NAMES)
    assert len(found) == 1
    assert "from the disturbances to the measurements" in found[0]


def test_a_free_control_and_a_noiseless_measurement():
    base = sound().plant
    for row, column, word in ((1, 2, "D12"), (2, 1, "D21")):
        D = base.D.copy()
        D[row, column] = 0.0
        found = failures(StandardProblem(StateSpace(base.A, base.B, base.C, D), 1, 1), NAMES)
        assert any(word in sentence for sentence in found), found
