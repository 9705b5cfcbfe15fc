"""A driven robot in MuJoCo, as exported, moves as it does here."""
# MuJoCo's stubs lack its classes.
# pyright: reportAttributeAccessIssue=false

import json

import mujoco
import numpy as np
import pytest

from freeswing.cdpr.driven.constants import constants
from freeswing.cdpr.driven.model import build_driven
from freeswing.cdpr.driven.motion import simulate_driven
from freeswing.cdpr.driven.statics import static_pose
from freeswing.export.driven_mjcf import driven_mjcf
from freeswing.main import main
from freeswing.session.drive_session import read_drive_session
from tests.cdpr.driven_robots import inca, odd_robot
from tests.ident.drive.made_sessions import write_session


def moved_by_mujoco(text, references, start):
    model = mujoco.MjModel.from_xml_string(text)
    data, poses = mujoco.MjData(model), []
    data.act[:] = start
    for reference in references:
        poses.append(data.qpos.copy())
        data.ctrl[:] = reference
        for _ in range(round(1e-3 / model.opt.timestep)):
            mujoco.mj_step(model, data)
    return np.array(poses)


def test_the_exported_robot_moves_alike():
    model = inca(("spring_constant", "drum_radius"))
    theta = model.theta({
        "coulomb_N_m": 0.0, "com_x_m": 0.01, "com_z_m": -0.02, "Ixx_kg_m2": 4e-4, "Iyy_kg_m2": 5e-4,
        "Izz_kg_m2": 4e-4, "spring_constant.added_5_N_m": 2.0, "drum_radius.added_2_m": 3e-4,
    })  # fmt: skip
    start = static_pose(model, np.zeros(8), theta).pose
    text = driven_mjcf(model.robot, constants(model, theta), start)
    bits = np.random.default_rng(3).integers(0, 2, (4, 8)).astype(float)
    references = np.repeat(bits, 100, axis=0)
    state = np.concatenate([start, np.zeros(6)])
    found = simulate_driven(model, state, references, 1000.0, theta, currents_A=np.zeros(8))
    poses = moved_by_mujoco(text, references, np.zeros(8))
    assert np.ptp(poses[:, 2]) > 0.05
    gap = np.abs(found.poses[:, :3] - poses[:, :3]).max()
    assert gap < 1e-7, f"{gap * 1e3:.6f} mm apart"


def test_pulleys_with_a_radius_are_refused():
    model = build_driven(odd_robot())
    with pytest.raises(ValueError, match="run over pulleys"):
        driven_mjcf(model.robot, constants(model, model.declared), np.eye(7)[3])


def test_export_takes_what_was_identified(tmp_path, capsys):
    folder = write_session(tmp_path, 80, 0.1)
    assert main(["export", str(folder), "--mjcf"]) == 1
    assert "run freeswing drive first" in capsys.readouterr().err
    assert main(["export", str(folder), "--urdf"]) == 2
    assert "--mjcf alone" in capsys.readouterr().err
    session = read_drive_session(folder / "drive.toml").session
    values = dict(
        zip(session.asked.names, session.asked.read(inca(), inca().declared), strict=True)
    )
    entries = [{"name": name, "value": value} for name, value in values.items()]
    (folder / "results").mkdir()
    path = folder / "results" / "drive.json"
    estimates = {"joint": {"parameters": entries}}
    table = {"format": "freeswing-drive-result/1", "estimates": estimates}
    path.write_text(json.dumps(table))
    assert main(["export", str(folder), "--mjcf", "--quiet"]) == 0
    model = mujoco.MjModel.from_xml_path(str(folder / "results" / "robot.xml"))
    assert np.allclose(model.tendon_frictionloss, 4.4e-3 / 0.0175)
    assert np.allclose(model.tendon_armature, 3.88e-5 / 0.0175**2)
    entries[3]["value"] = None
    path.write_text(json.dumps(table))
    assert main(["export", str(folder), "--mjcf"]) == 1
    assert f"has no value of {entries[3]['name']}" in capsys.readouterr().err
    path.write_text("{}")
    assert main(["export", str(folder), "--mjcf"]) == 2
