"""What a driven robot lacks is found with its motor or cable, and nothing is where nothing is."""

import json
from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.effects import driven_catalogue
from freeswing.ident.drive.diagnose.candidates import candidates
from freeswing.ident.drive.diagnose.screen import screen
from freeswing.ident.drive.identify import offsets_of
from freeswing.ident.drive.joint import Premise, estimate
from freeswing.main import main
from freeswing.results.diagnosis import Diagnosis
from freeswing.session.drive_session import read_drive_session
from tests.ident.drive.made_sessions import write_flawed

FLAWS = {
    "coulomb_friction.added_5_N_m": 2.4e-3,
    "spring_constant.added_8_N_m": 0.03 * 14.4,
    "torque_constant.added_1_N_m_A": 0.05 * 0.0603,
    "attachment_offset.offset_3_x_m": 4e-3,
    "anchor_offset.offset_2_z_m": 15e-3,
    "drum_radius.added_4_m": 0.02 * 0.0175,
    "pose_latency.added_s": 0.002,
}
WEIGHT = {
    "platform_payload.mass_kg": 0.05,
    "platform_payload.x_m": 0.08,
    "platform_payload.y_m": 0.03,
}


def diagnosed(folder, *flags):
    assert main(["diagnose", str(folder), "--quiet", *flags]) == 0
    document = json.loads((folder / "results" / "diagnosis.json").read_text())
    Diagnosis.from_json(document)
    return document


def value_of(document, name):
    """Value and deviation of an accepted effect's number, by its full name."""
    effect, _, short = name.partition(".")
    entries = [e for e in document["accepted"] if e["effect"] == effect]
    found = [p for e in entries for p in e["parameters"] if p["name"] == short]
    assert found, f"{name} is not among {document['accepted']}"
    return found[0]["value"], found[0]["std"]


def test_candidates_come_motor_by_motor(tmp_path):
    session = read_drive_session(write_flawed(tmp_path, 60, 0.3, {}) / "drive.toml").session
    found = {one.label: one for one in candidates(session.model, session.asked)}
    assert {one.effect for one in found.values()} == set(driven_catalogue())
    assert [group.name for group in found["attachment_offset.3"].groups] == [
        f"attachment_offset.offset_3_{axis}_m" for axis in "xyz"
    ]
    assert found["platform_payload"].screened == ("com_x_m", "com_y_m", "com_z_m")
    elastic = [group.name for group in found["cable_elasticity"].groups]
    assert elastic == ["cable_elasticity.mass_over_stiffness_s2_m"]


def test_the_screen_tells_one_motor_from_another(tmp_path):
    """About the declared robot, without any fit: half a second, two effects."""
    folder = write_flawed(tmp_path, 60, 0.5, {"spring_constant.added_8_N_m": 0.02})
    session = read_drive_session(folder / "drive.toml").session
    model, asked = session.model, replace(session.asked, groups=session.asked.groups[7:9])
    asked = replace(asked, n_kinematic=0)
    zero = offsets_of(session, model.declared, None)
    runs = session.of("identify")
    given = Premise(model, model.declared, runs, session.noise, session.zero_pose, zero)
    chosen = candidates(model, asked, ("spring_constant", "coulomb_friction"))
    found = screen(given, estimate(given, asked, 1), chosen, {})
    best = max(found, key=lambda one: one.gain)
    assert best.candidate.label == "spring_constant.8", best
    assert abs(best.values[0] - 0.02) < 0.004, best.values


@pytest.mark.slow
def test_a_motor_that_rubs_is_found_and_a_stand_in_is_not_accepted(tmp_path, capsys):
    name, truth = "coulomb_friction.added_5_N_m", 2.4e-3
    folder = write_flawed(tmp_path, 61, 1.5, {name: truth})
    document = diagnosed(folder, "--only", "coulomb_friction")
    value, std = value_of(document, name)
    assert abs(value - truth) < max(3.0 * std, 0.05 * truth), (value, std)
    assert [entry["part"] for entry in document["accepted"]] == ["5"]
    after = document["after"]
    assert after["motor_rmse_rad"] < 1.2 * after["motor_noise_rad"], after
    assert document["accepted"][0]["evidence"][0]["run"] == "check"
    document = diagnosed(folder, "--only", "spring_constant")
    assert document["accepted"] == []
    assert document["unexplained"]["present"]
    assert "motor" in document["unexplained"]["signature"]
    assert "none of these explains" in capsys.readouterr().err
    assert main(["diagnose", str(folder), "--only", "swivel_friction"]) == 2


@pytest.mark.slow
@pytest.mark.parametrize(("name", "truth"), FLAWS.items())
def test_what_is_missing_is_found_with_its_part(tmp_path, name, truth):
    seed = 66 if name.startswith("torque") else 62  # motor 1 has no current in that of 62
    document = diagnosed(write_flawed(tmp_path, seed, 1.5, {name: truth}))
    value, std = value_of(document, name)
    assert abs(value - truth) < max(3.0 * std, 0.05 * truth), (value, std)
    assert len(document["accepted"]) == 1, document["accepted"]
    after = document["after"]
    assert after["motor_rmse_rad"] < 1.2 * after["motor_noise_rad"], after


@pytest.mark.slow
def test_a_tilt_is_a_constant_force_too(tmp_path):
    """Motors feel no gravity: on a platform hung at its centre both are one, and are said to be."""
    name, truth = "gravity_tilt.tilt_x_rad", 0.01
    document = diagnosed(write_flawed(tmp_path, 62, 1.5, {name: truth}))
    assert document["accepted"] == []
    assert not document["unexplained"]["present"]
    said = {e["effect"]: e for e in document["candidates"] if e["verdict"] == "confounded"}
    assert set(said) == {"gravity_tilt", "constant_force"}
    assert said["gravity_tilt"]["confounded_with"] == ["constant_force"]
    told = {p["name"]: p for p in said["gravity_tilt"]["parameters"]}["tilt_x_rad"]
    assert abs(told["value"] - truth) < max(3.0 * told["std"], 0.05 * truth), told
    assert said["gravity_tilt"]["held_out_gain"] > 0.99


@pytest.mark.slow
def test_an_encoder_that_jumped_is_found_with_its_motor(tmp_path):
    name, truth = "encoder_jump.jump_2_rad", 0.05
    flaws = {name: truth, "encoder_jump.after_s": 0.6}
    document = diagnosed(write_flawed(tmp_path, 62, 1.5, flaws))
    value, std = value_of(document, name)
    assert abs(value - truth) < max(3.0 * std, 0.05 * truth), (value, std)
    assert [entry["part"] for entry in document["accepted"]] == ["2"]


@pytest.mark.slow
def test_an_undeclared_weight_is_found_with_its_place(tmp_path):
    document = diagnosed(write_flawed(tmp_path, 65, 1.5, WEIGHT))
    for name, truth in WEIGHT.items():
        value, std = value_of(document, name)
        assert abs(value - truth) < max(3.0 * std, 0.05 * truth), (name, value, std)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [63, 64])
def test_nothing_is_found_where_nothing_is(tmp_path, seed):
    document = diagnosed(write_flawed(tmp_path, seed, 1.5, {}))
    assert document["accepted"] == []
    assert not document["unexplained"]["present"]
    assert np.isclose(document["before"]["motor_rmse_rad"], document["after"]["motor_rmse_rad"])


@pytest.mark.slow
def test_elastic_cables_are_found(tmp_path):
    name, truth = "cable_elasticity.mass_over_stiffness_s2_m", 5.78e-5
    document = diagnosed(
        write_flawed(tmp_path, 60, 1.2, {name: truth}), "--only", "cable_elasticity"
    )
    value, std = value_of(document, name)
    assert abs(value - truth) < max(3.0 * std, 1e-3 * truth), (value, std)
    assert not document["unexplained"]["present"]
    after = document["after"]
    assert after["motor_rmse_rad"] < 1.2 * after["motor_noise_rad"], after
