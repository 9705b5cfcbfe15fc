"""`drive --effect`: what no file declares is in the joint estimate, with its deviation."""

import json

import numpy as np
import pytest

from freeswing.cdpr.driven.behaviour import turns_at_rest
from freeswing.cdpr.driven.slopes import moved
from freeswing.cdpr.effects import driven_catalogue
from freeswing.ident.drive.added_effects import with_effects
from freeswing.ident.drive.at_rest import turns_and_slopes
from freeswing.ident.drive.unknowns import Asked, Group
from freeswing.main import main
from freeswing.session.drive_session import read_drive_session
from tests.ident.drive.made_sessions import TOML, write_flawed

# What is recorded, and how it is asked for.
CASES = (
    ({"coulomb_friction.added_5_N_m": 2.4e-3}, "coulomb_friction"),
    ({"viscous_friction.added_2_N_m_s": 3e-5}, "viscous_friction"),
    ({"spring_constant.added_8_N_m": 0.4}, "spring_constant.8"),
    ({"torque_constant.added_1_N_m_A": 3e-3}, "torque_constant.1"),
    ({"drum_radius.added_4_m": 3.5e-4}, "drum_radius.4"),
    ({"drum_radius.added_4_m": 3.5e-4}, "drum_radius"),
    ({"output_pulley.coefficient_3": 0.03}, "output_pulley.3"),
    ({"pose_latency.added_s": 0.002}, "pose_latency"),
    ({"encoder_jump.jump_2_rad": 0.05, "encoder_jump.after_s": 0.6}, "encoder_jump.2"),
    ({"attachment_offset.offset_3_x_m": 4e-3}, "attachment_offset.3"),
    ({"anchor_offset.offset_2_z_m": 15e-3}, "anchor_offset.2"),
    ({"gravity_tilt.tilt_x_rad": 0.01}, "gravity_tilt"),
    ({"translational_drag.rate_1_s": 0.1}, "translational_drag"),
    (
        {
            "platform_payload.mass_kg": 0.05,
            "platform_payload.x_m": 0.08,
            "platform_payload.y_m": 0.03,
        },
        "platform_payload",
    ),
)


def estimated(folder, *flags):
    """drive.json after `drive`, and its joint estimate by name."""
    assert main(["drive", str(folder), "--quiet", *flags]) == 0
    document = json.loads((folder / "results" / "drive.json").read_text())
    joint = document["estimates"]["joint"]
    return document, {entry["name"]: entry for entry in joint["parameters"]}


def holds(entry, truth):
    gap = abs(entry["value"] - truth)
    assert gap < max(3.0 * entry["std"], 1e-3 * abs(truth)), (entry, truth)
    assert 0.0 < entry["std"] < 0.05 * abs(truth), entry


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return write_flawed(tmp_path_factory.mktemp("plain"), 60, 0.06, {})


@pytest.fixture(scope="module")
def session(plain):
    return read_drive_session(plain / "drive.toml").session


def test_labels_name_an_effect_a_part_or_a_number(session):
    def added(*labels):
        return with_effects(session, labels).session.asked.added

    assert len(added("coulomb_friction")) == 8
    assert added("coulomb_friction.5") == ("coulomb_friction.added_5_N_m",)
    assert len(added("anchor_offset.2")) == 3
    assert added("anchor_offset.offset_2_z_m") == ("anchor_offset.offset_2_z_m",)
    assert added("pose_latency", "pose_latency.added_s") == ("pose_latency.added_s",)
    assert added("cable_elasticity") == ("cable_elasticity.mass_over_stiffness_s2_m",)
    for name in driven_catalogue():
        assert added(name)


def test_what_moves_points_is_known_by_static_poses_too(session):
    asked = with_effects(session, ["drum_radius.4", "coulomb_friction.5"]).session.asked
    assert "drum_radius.added_4_m" in asked.kinematic.names
    assert "coulomb_friction.added_5_N_m" in asked.dynamic.names
    assert asked.without_effects == session.asked


def test_a_number_that_effects_do_as_well_is_held(session):
    assert with_effects(session, ["drum_radius"]).held == ("drum_m",)
    assert with_effects(session, ["drum_radius.4"]).held == ()
    assert with_effects(session, ["coulomb_friction"]).held == ("coulomb_N_m",)
    assert with_effects(session, ["spring_constant"]).held == ("spring_N_m",)
    shape = ("arm_m", "theta_xy_rad", "theta_xz_rad")
    assert with_effects(session, ["attachment_offset"]).held == shape
    enlarged = with_effects(session, ["drum_radius"]).session
    assert "drum_m" not in enlarged.asked.names


def test_starts_are_where_they_are_put(session):
    name = "coulomb_friction.added_5_N_m"
    for spelling in (name, "added_5_N_m"):
        model = with_effects(session, ["coulomb_friction.5"], [(spelling, 1e-3)]).session.model
        assert model.declared[model.index(name)] == 1e-3


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        (["--effect", "swivel_friction"], "swivel_friction: not one of anchor_offset, "),
        (["--effect", "drum_radius.9"], "'9' is not one of 1, 2, 3"),
        (["--effect", "drum_radius", "--set", "added_9_m=1"], "--set added_9_m: not one of drum"),
        (["--effect", "drum_radius", "--set", "added_4_m=1"], "outside -0.003 to 0.003"),
    ],
)
def test_what_there_is_not_is_refused(plain, capsys, flags, said):
    assert main(["drive", str(plain), *flags]) == 2
    assert said in capsys.readouterr().err
    assert not (plain / "results" / "drive.json").exists()


def test_a_rubbing_pulley_through_the_command_line(tmp_path):
    """Two further unknowns and a quarter of a second: what a default run affords."""
    folder = write_flawed(tmp_path, 60, 0.25, {"output_pulley.coefficient_3": 0.03})
    head, _, tail = TOML.partition("[unknown]")
    few = '[unknown]\nkinematic = ["drum_m"]\ndynamic = ["coulomb_N_m"]\n[static]'
    (folder / "drive.toml").write_text(head + few + tail.partition("[static]")[2])
    document, found = estimated(folder, "--effect", "output_pulley.3")
    holds(found["output_pulley.coefficient_3"], 0.03)
    assert document["effects"] == ["output_pulley.3"]
    assert "output_error" not in document["estimates"]
    assert document["residual"]["times_noise"]["check"] < 1.5


@pytest.mark.slow
@pytest.mark.parametrize(("flaws", "label"), CASES, ids=[case[1] for case in CASES])
def test_an_effect_comes_back_with_its_deviation(tmp_path, flaws, label):
    document, found = estimated(write_flawed(tmp_path, 60, 1.2, flaws), "--effect", label)
    for name, truth in flaws.items():
        if name in found:
            holds(found[name], truth)
    absent = [entry for entry in found.values() if entry["name"].startswith(f"{label}.")]
    for entry in absent:
        if entry["name"] not in flaws and entry["value"] is not None:
            assert abs(entry["value"]) < 4.0 * entry["std"], entry
    times = document["residual"]["times_noise"]
    assert times["ident"] < 1.1
    assert times["check"] < 1.5  # what the command takes for a right model
    assert document["estimates"]["joint"]["second_start_z"] < 0.1


def test_slopes_of_elastic_cables_at_rest_are_their_differences(session):
    """A static pose tells the stretch: without this slope the joint estimate stalled."""
    name = "cable_elasticity.mass_over_stiffness_s2_m"
    enlarged = with_effects(session, ["cable_elasticity"], [(name, 5e-5)]).session
    model, pose, static = enlarged.model, enlarged.static.poses[3], enlarged.static
    currents = static.currents_A[3]
    asked = Asked((Group("arm_m", ("arm_m",)), Group(name, (name,))), 1)
    turns, by_pose, by_asked = turns_and_slopes(model, pose, currents, model.declared, asked)
    for k, (number, step) in enumerate((("arm_m", 1e-4), (name, 1e-6))):
        value = model.declared[model.index(number)]
        thetas = [model.declared.copy() for _ in range(2)]
        for theta, sign in zip(thetas, (1.0, -1.0), strict=True):
            theta[model.index(number)] = value + sign * step
        ends = [turns_at_rest(model, pose, currents, theta) for theta in thetas]
        expected = (ends[0] - ends[1]) / (2.0 * step)
        assert np.allclose(by_asked[:, k], expected, rtol=2e-3, atol=1e-3 * np.abs(expected).max())
    shift = np.array([0.0, 0.0, 1e-4, 0.0, 0.0, 0.0])
    ends = [turns_at_rest(model, moved(pose, s * shift), currents, model.declared) for s in (1, -1)]
    expected = (ends[0] - ends[1]) / 2e-4
    assert np.allclose(by_pose[:, 2], expected, atol=1e-3 * np.abs(expected).max())
    assert np.allclose(turns, turns_at_rest(model, pose, currents, model.declared))
    # A rigid cable is longer by what it pulls as soon as it gives way: from zero too.
    rigid = turns_and_slopes(model, pose, currents, model.theta({name: 0.0}), asked)
    assert np.abs(rigid[2][:, 1]).min() > 0.0


@pytest.mark.slow
def test_elastic_cables_come_back_to_the_noise(tmp_path):
    """From the file's rigid robot; swings of 250 rad/s, a thousandth of EA is a turn's 50th."""
    name, truth = "cable_elasticity.mass_over_stiffness_s2_m", 5.78e-5
    folder = write_flawed(tmp_path, 60, 1.2, {name: truth})
    document, found = estimated(folder, "--effect", "cable_elasticity")
    holds(found[name], truth)
    assert np.max(list(document["residual"]["times_noise"].values())) < 1.1
    assert document["estimates"]["joint"]["second_start_z"] < 1.0
