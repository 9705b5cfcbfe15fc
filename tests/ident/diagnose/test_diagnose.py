"""The diagnosis on short sessions whose motions come from an independent integrator."""

import numpy as np
import pytest

from freeswing.cdpr.effects import catalogue
from freeswing.cdpr.files.documents import DataError
from freeswing.ident.diagnose import decision, model_probabilities
from freeswing.ident.diagnose import diagnose as module
from freeswing.ident.diagnose.answer import taken_back
from freeswing.ident.diagnose.diagnose import diagnose
from freeswing.ident.diagnose.experiments import separating_experiment
from freeswing.session.load_swings import load_robot, load_swings, load_target
from freeswing.session.session_file import read_session
from tests.oracle.recorded.sessions import make_session

# Eleven rules loosened at once: whoever loosens them claims what is not there.
LOOSENED = {
    decision: {
        "ACCEPTED": 0.01,
        "LEAST_GAIN": 1.0,
        "CONTRADICTED": 0.9,
        "MOST_WORSE": 0.9,
        "NEARLY_AS_GOOD": 0.0,
        "LEAST_GAIN_LATER": 0.0,
        "LEAST_EXCESS_LATER": -1.0,
    },
    module: {"LEAST_SHARE_EXPLAINED": 0.0, "LARGEST_EXCESS_LEFT": 50.0},
    model_probabilities: {"CHANCE_OF_EFFECT": 0.5},
    taken_back: {"ACCEPTED": 0.01},
}


def told(folder, effects, seed, n_runs=4, duration_s=2.0):
    make_session(folder, seed, "bologna-4", effects, n_runs=n_runs, duration_s=duration_s)
    session = read_session(folder)
    robot = load_robot(session)
    return list(load_swings(session, robot, load_target(session))), robot


@pytest.fixture(scope="module")
def clean_runs(tmp_path_factory):
    return told(tmp_path_factory.mktemp("clean"), {}, 6)


@pytest.fixture(scope="module")
def clean(clean_runs):
    """The whole catalogue on runs that lack nothing."""
    return diagnose(*clean_runs, workers=1)


@pytest.fixture(scope="module")
def tilted(tmp_path_factory):
    """The whole catalogue on runs of a base that is tilted and not said to be."""
    return diagnose(
        *told(tmp_path_factory.mktemp("tilted"), {"gravity_tilt": "large"}, 5), workers=1
    )


def test_a_tilted_base_is_named(tilted):
    assert tilted.final.model.effects == ("gravity_tilt",), tilted.final.model.effects


def test_nothing_is_claimed_on_clean_data(clean):
    assert clean.final.model.effects == (), clean.candidates
    assert not clean.unexplained.present, clean.unexplained


@pytest.mark.slow
def test_with_loosened_rules_something_is_claimed(clean_runs, monkeypatch):
    """The negative control of the test above."""
    for where, values in LOOSENED.items():
        for name, value in values.items():
            assert getattr(where, name) != value
            monkeypatch.setattr(where, name, value)
    assert diagnose(*clean_runs, workers=1).final.model.effects != ()


def check_after(document):
    after = document["after"]
    ratio = after["prediction_rmse_m"] / after["noise_floor_m"]
    assert ratio < 1.2, ratio
    assert not document["unexplained"]["present"], document["unexplained"]


def test_prediction_is_at_the_noise_afterwards(tilted):
    check_after(tilted.document())


@pytest.mark.slow
def test_prediction_comes_down_to_the_noise(tmp_path):
    """Swings long enough that a tilt leads a prediction astray: two seconds of it do not."""
    runs, robot = told(tmp_path, {"gravity_tilt": "large"}, 5, n_runs=6, duration_s=4.0)
    few = ("gravity_tilt", "translational_drag", "constant_force")
    document = diagnose(runs, robot, workers=1, candidates=few).document()
    before, after = document["before"], document["after"]
    check_after(document)
    assert before["prediction_rmse_m"] > 1.5 * after["prediction_rmse_m"], (before, after)


def test_every_candidate_has_a_verdict_and_a_reason(tilted):
    document = tilted.document()
    claims = {name for name, effect in catalogue().items() if not effect.nuisance}
    assert {c["effect"] for c in document["candidates"]} == claims
    assert all(c["reason"] for c in document["candidates"]), document["candidates"]
    assert len(document["ladder"]) == 2, document["ladder"]


def test_validation_runs_do_not_enter_the_search(clean, clean_runs):
    names = {samples.name for samples in clean.final.samples}
    held = {run.name for run in clean_runs[0] if run.role == "validate"}
    assert held
    assert not names & held, names & held


def test_too_few_runs_are_refused_in_words(tmp_path):
    runs, robot = told(tmp_path, {}, 8)
    fitted = [run for run in runs if run.role == "identify"][:2]
    checked = [run for run in runs if run.role == "validate"]
    with pytest.raises(DataError, match="at least 3"):
        diagnose([*fitted, *checked], robot, workers=1, candidates=())


@pytest.mark.parametrize(
    ("group", "advice"),
    [
        (("gravity_tilt", "constant_force"), "repeat some swings with a known payload"),
        (("translational_drag", "quadratic_drag", "tether"), "let them die away"),
        (("anchor_offset", "attachment_offset"), "equilibria spread over the whole workspace"),
        (("winch_creep", "cable_length_bias"), "one run several times as long"),
        (("tether", "winch_creep"), "record more runs, about other equilibria"),
    ],
)
def test_the_experiment_that_a_group_shares_is_advised(group, advice):
    told = separating_experiment(group)
    assert advice in told, told
    assert "; or " not in told, told


def test_experiments_are_told_in_the_order_of_what_they_cost():
    told = separating_experiment(("cable_elasticity", "winch_creep", "gravity_tilt"))
    payload, long_run = (told.index(word) for word in ("known payload", "several times as long"))
    assert payload < long_run, told


def test_effect_values_come_with_their_deviations(tilted):
    entry = tilted.document()["accepted"][0]
    stds = np.array([p["std"] for p in entry["parameters"]])
    assert (stds > 0).all(), stds
