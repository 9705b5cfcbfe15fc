"""Stages of the diagnosis: geometry without dynamics, one cable alone, removal of what is idle."""

import numpy as np
import pytest

from freeswing.session import read_session
from freeswing.swings import load_robot, load_swings, load_target
from ident.diagnose.diagnose import diagnose
from ident.diagnose.kinematics import displacements
from ident.diagnose.refit import refit, without
from ident.diagnose.removal import is_no_worse, superfluous
from ident.diagnose.variants import variants
from tests.oracle.sessions import make_session

POINTS = ("attachment_offset", "anchor_offset", "clock_offset")
WHITE = np.ones(2)


def diagnosed(folder, effects, seed, candidates, n_runs=6):
    truth = make_session(folder, seed, "bologna-4", effects, n_runs=n_runs, duration_s=4.0)
    session = read_session(folder)
    robot = load_robot(session)
    runs = list(load_swings(session, robot, load_target(session)))
    return truth, diagnose(runs, robot, workers=1, candidates=candidates)


def accepted(found):
    return {
        entry["effect"]: {p["name"]: (p["value"], p["std"]) for p in entry["parameters"]}
        for entry in found.document()["accepted"]
    }


def test_one_displaced_attachment_is_found_without_touching_the_others(tmp_path):
    truth, found = diagnosed(tmp_path, {"attachment_offset": "medium"}, 21, POINTS)
    values = accepted(found)
    assert list(values) == ["attachment_offset"], values
    moved = truth.scene.world.attach - np.array(found.final.model.robot.attachments_m)
    cable = int(np.argmax(np.linalg.norm(moved, axis=1)))
    name = found.final.model.robot.cables[cable].name
    expected = dict(zip((f"offset_{name}_{axis}_m" for axis in "xyz"), moved[cable], strict=True))
    assert set(values["attachment_offset"]) == set(expected), values
    for key, (value, std) in values["attachment_offset"].items():
        assert abs(value - expected[key]) < 4 * std + 5e-5, (key, value, std, expected[key])


def test_a_clock_offset_between_orientations_and_positions_is_found(tmp_path):
    _, found = diagnosed(tmp_path, {"clock_offset": "medium"}, 22, POINTS)
    values = accepted(found)
    assert list(values) == ["clock_offset"], values
    delay, std = values["clock_offset"]["delay_s"]
    assert delay == pytest.approx(0.006, abs=4 * std + 1e-4), (delay, std)


def test_lengths_say_nothing_where_only_gravity_is_tilted(tmp_path):
    _, found = diagnosed(tmp_path, {"gravity_tilt": "large"}, 23, ())
    robot = found.final.model.robot
    keys = [key for name in POINTS for key in variants(robot, name)]
    assert displacements(found.final, keys, WHITE) == []


def test_an_effect_that_a_later_one_makes_superfluous_leaves(tmp_path):
    _, found = diagnosed(tmp_path, {"gravity_tilt": "large"}, 24, ())
    first = refit(found.final, "translational_drag", np.array([0.0, 0.5]), WHITE, 100.0)
    both = refit(first.fit, "gravity_tilt", np.zeros(2), WHITE, 1.0)
    assert both.effects == ("translational_drag", "gravity_tilt")
    assert superfluous(both, ("gravity_tilt",)) == "translational_drag"
    alone = without(both.fit, "translational_drag", WHITE)
    assert alone.effects == ("gravity_tilt",)
    assert is_no_worse(alone, both, "translational_drag", WHITE), (alone.held_out, both.held_out)


def test_a_cause_is_not_superfluous(tmp_path):
    _, found = diagnosed(tmp_path, {"gravity_tilt": "large"}, 25, ("gravity_tilt",))
    model = found.final.model
    assert model.effects == ("gravity_tilt",)
    with_drag = refit(found.final, "translational_drag", np.array([0.0, 0.5]), WHITE, 1.0)
    assert superfluous(with_drag, ("translational_drag",)) == ""
