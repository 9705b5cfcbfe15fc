"""The smaller commands, through the command line."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from freeswing.cdpr.files.documents import DataError, write_json
from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.cdpr.robot import INERTIA_NAMES
from freeswing.export.write_exports import inertia_from, urdf
from freeswing.main import main
from tests.places import SAMPLES

ROBOT = SAMPLES / "three-cables" / "robot.toml"
LENGTHS = "1.2,1.3,1.3"


def simulate(result: Path, *more: str, lengths: str = LENGTHS) -> int:
    return main(["simulate", str(ROBOT), str(result), "--lengths-m", lengths, *more, "--quiet"])


def test_simulate_is_the_same_from_the_same_seed(tmp_path: Path) -> None:
    options = ("--duration-s", "2", "--noise-m", "1e-4", "--seed", "3")
    first, second, other = (tmp_path / f"{name}.csv" for name in "abc")
    assert simulate(first, *options) == 0
    assert simulate(second, *options) == 0
    assert simulate(other, *options[:-1], "4") == 0
    assert first.read_bytes() == second.read_bytes()
    assert first.read_bytes() != other.read_bytes()
    motion = read_trajectory(first)
    assert (len(motion), motion.is_pose, motion.sample_rate_hz) == (201, True, pytest.approx(100))


def test_simulate_takes_effects(tmp_path: Path) -> None:
    drag = ("--effect", "translational_drag", "--set", "rate_1_s=1.0")
    amplitudes = []
    for name, options in (("free", ()), ("drag", drag)):
        path = tmp_path / f"{name}.csv"
        assert simulate(path, "--duration-s", "6", *options) == 0
        late = read_trajectory(path).positions()[400:]
        amplitudes.append(float(np.linalg.norm(np.ptp(late, axis=0))))
    assert amplitudes[1] < 0.7 * amplitudes[0], amplitudes


@pytest.mark.parametrize(
    ("options", "status"),
    [
        (("--effect", "gremlins"), 2),
        (("--set", "rate_1_s=1"), 2),
        (("--amplitude-m", "5"), 2),
    ],
)
def test_simulate_says_what_is_wrong(
    tmp_path: Path, options: tuple[str, ...], status: int, capsys: pytest.CaptureFixture[str]
) -> None:
    assert simulate(tmp_path / "a.csv", *options) == status
    assert "Traceback" not in capsys.readouterr().err
    assert not (tmp_path / "a.csv").exists()


def test_simulate_refuses_lengths_of_another_robot(tmp_path: Path) -> None:
    assert simulate(tmp_path / "a.csv", lengths="1.2,1.3") == 2
    assert simulate(tmp_path / "a.csv", "--amplitude-m", "1e-3", lengths="0.01,0.01,9.0") == 1


def identified(session: Path) -> None:
    values = (0.01, -0.02, 0.19, 0.056, 0.066, 0.037, 1e-4, -9e-4, 7e-4)
    rows = [
        {"name": name, "value": value, "std": 1e-5, "std_percent": 1.0, "essential": True}
        for name, value in zip(INERTIA_NAMES, values, strict=True)
    ]
    estimates = {"ml_full": {"parameters": rows, "dropped_runs": []}}
    document = {"format": "freeswing-identification/1", "estimates": estimates}
    write_json(session / "results" / "identification.json", document)


def test_exports_agree_with_mujoco(session: Path) -> None:
    identified(session)
    for kind in ("--urdf", "--mjcf", "--plain"):
        assert main(["export", str(session), kind, "--mass-kg", "5", "--quiet"]) == 0
    results = session / "results"
    plain = json.loads((results / "platform.json").read_text(encoding="utf-8"))
    principal = sorted(np.linalg.eigvalsh(plain["inertia_about_com_kg_m2"]))
    model = mujoco.MjModel.from_xml_path(  # pyright: ignore[reportAttributeAccessIssue]
        str(results / "platform.xml")
    )
    np.testing.assert_allclose(sorted(model.body_inertia[1]), principal, rtol=1e-6)
    np.testing.assert_allclose(model.body_ipos[1], [0.01, -0.02, 0.19], atol=1e-9)
    assert model.body_mass[1] == 5.0
    assert model.ntendon == 4
    root, platform = ET.parse(results / "platform.urdf").getroot().findall("link")
    assert root.find("inertial") is None, "readers such as KDL ignore a root's inertia"
    inertial = platform.find("inertial")
    assert inertial is not None
    tensor = inertial.find("inertia")
    assert tensor is not None
    assert float(str(tensor.get("ixx"))) == pytest.approx(plain["inertia_about_com_kg_m2"][0][0])


def test_an_inertia_that_no_body_has_is_not_exported() -> None:
    values = dict(zip(INERTIA_NAMES, (0, 0, 0, 0.01, 0.01, 0.0201, 0, 0, 0), strict=True))
    with pytest.raises(DataError, match="no body can have them"):
        inertia_from(values, 2.0)
    just = {**values, "Izz_m2": 0.02}
    assert inertia_from(just, 2.0).tensor_kg_m2[2, 2] == pytest.approx(0.04)


def test_names_that_xml_cannot_hold_are_written_without_those_characters() -> None:
    values = dict(zip(INERTIA_NAMES, (0, 0, 0, 0.01, 0.01, 0.015, 0, 0, 0), strict=True))
    robot = replace(read_robot(ROBOT), name="arm\x01<&>")
    assert ET.fromstring(urdf(robot, inertia_from(values, 2.0))).get("name") == "arm_<&>"


def test_export_before_identify_is_1(session: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(session), "--urdf"]) == 1
    assert "run freeswing identify first" in capsys.readouterr().err
