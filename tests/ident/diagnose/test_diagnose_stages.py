"""Stages of the diagnosis: geometry without dynamics, one cable alone, removal of what is idle."""

import numpy as np
import pytest

from freeswing.ident.diagnose.backward_removal import is_no_worse, superfluous
from freeswing.ident.diagnose.decision import runs_worse
from freeswing.ident.diagnose.diagnose import diagnose
from freeswing.ident.diagnose.leave_one_out import Score
from freeswing.ident.diagnose.lengths.wrong_places import kinematics
from freeswing.ident.diagnose.outstanding_runs import OUTSTANDING, tempered
from freeswing.ident.diagnose.refit import refit, without
from freeswing.ident.diagnose.variants import variants
from freeswing.ident.likelihood.run_residuals import residuals
from freeswing.session.load_swings import load_robot, load_swings, load_target
from freeswing.session.session_file import read_session
from tests.oracle.recorded.sessions import make_session

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


@pytest.mark.slow
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


@pytest.mark.slow
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
    assert kinematics(found.final, keys, WHITE).wrong == ()  # pyright: ignore[reportOptionalMemberAccess]


@pytest.mark.slow
def test_an_effect_that_a_later_one_makes_superfluous_leaves(tmp_path):
    _, found = diagnosed(tmp_path, {"gravity_tilt": "large"}, 24, ())
    first = refit(found.final, "translational_drag", np.array([0.0, 0.5]), WHITE, 100.0)
    both = refit(first.fit, "gravity_tilt", np.zeros(2), WHITE, 1.0)
    assert both.effects == ("translational_drag", "gravity_tilt")
    assert superfluous(both, ("gravity_tilt",)) == "translational_drag"
    alone = without(both.fit, "translational_drag", WHITE)
    assert alone.effects == ("gravity_tilt",)
    assert is_no_worse(alone, both, "translational_drag", WHITE), (alone.held_out, both.held_out)


@pytest.mark.slow
def test_a_cause_is_not_superfluous(tmp_path):
    _, found = diagnosed(tmp_path, {"gravity_tilt": "large"}, 25, ("gravity_tilt",))
    model = found.final.model
    assert model.effects == ("gravity_tilt",)
    with_drag = refit(found.final, "translational_drag", np.array([0.0, 0.5]), WHITE, 1.0)
    assert superfluous(with_drag, ("translational_drag",)) == ""


@pytest.mark.slow
def test_a_cause_beside_another_is_found_where_little_is_left_of_it(tmp_path):
    """The drag leaves 2 % over the noise once the creep is in; its evidence is overwhelming."""
    effects = {"winch_creep": "large", "translational_drag": "medium"}
    names = (*effects, "rotational_drag", "constant_force")
    _, found = diagnosed(tmp_path, effects, 26, names)
    values = accepted(found)
    assert set(values) == set(effects), values
    rate, std = values["translational_drag"]["rate_1_s"]
    assert rate == pytest.approx(0.02, abs=4 * std + 2e-4), (rate, std)


@pytest.mark.slow
def test_a_tilted_pulley_does_not_make_runs_slack(tmp_path):
    """With a wrong geometry the tensions of a first solution mean nothing."""
    _, found = diagnosed(tmp_path, {"pulley_axis": "large"}, 27, ("pulley_axis", "anchor_offset"))
    assert "pulley_axis" in accepted(found)


def test_what_lengths_settle_to_the_noise_leaves_a_verdict_on_the_others(tmp_path):
    """Nothing is left for forces: they are looked at all the same, and told why not."""
    _, found = diagnosed(tmp_path, {"anchor_offset": "large"}, 29, (*POINTS, "rotational_drag"))
    assert list(accepted(found)) == ["anchor_offset"]
    verdicts = {c["effect"]: c["verdict"] for c in found.document()["candidates"]}
    assert verdicts["rotational_drag"] == "rejected", verdicts


def test_a_small_loss_beside_the_gain_contradicts_nothing():
    nothing = np.zeros(0)
    squares = np.array([600.0, 100.0, 100.0, 100.0])
    before = Score(nothing, nothing, nothing, 900.0, squares, np.zeros(4), 0)
    assert runs_worse(np.array([500.0, -4.0, -5.0, 1.0]), before) == 0
    assert runs_worse(np.array([500.0, -40.0, -50.0, 1.0]), before) == 2
    assert runs_worse(np.array([6.0, -4.0, -0.5, 1.0]), before) == 1


def test_a_run_that_stands_out_weighs_no_more_than_its_limit(tmp_path):
    _, found = diagnosed(tmp_path, {"gravity_tilt": "large"}, 28, ())
    fit = found.final
    pairs = zip(fit.motions, fit.samples, strict=True)
    powers = [np.mean((residuals(m, s, WHITE) * s.temper) ** 2) for m, s in pairs]
    limit = OUTSTANDING * max(1.0, np.median(powers))
    for power, samples in zip(powers, tempered(fit, WHITE), strict=True):
        assert samples.temper == pytest.approx(np.sqrt(max(1.0, power / limit)))
