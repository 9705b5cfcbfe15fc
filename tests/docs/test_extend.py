"""The examples of docs/extend.md, each tried as it stands there."""

from __future__ import annotations

import re
import sys
from types import ModuleType

import numpy as np
import pytest

import freeswing.main
from freeswing.calib import exchange
from freeswing.calib.camera.lens_models import PARAMETER_NAMES, project, project_jacobian
from freeswing.cdpr.effects import catalogue
from freeswing.cdpr.effects.own_folders import effects_in
from freeswing.cdpr.files.problems import InputError
from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.ident.diagnose.diagnose import diagnose
from freeswing.ident.diagnose.experiments import separating_experiment
from freeswing.main import main
from freeswing.session.load_swings import load_robot, load_swings, load_target
from freeswing.session.session_file import read_session
from tests.calib.rigs import rig
from tests.oracle.recorded.sessions import make_session
from tests.places import ROOT, SAMPLES

NAME = "spinning_rotor"


def example(title: str) -> str:
    """The first Python block of a section."""
    text = (ROOT / "docs" / "extend.md").read_text(encoding="utf-8")
    section = re.search(rf"^## {title}$(.*?)(?=^## |\Z)", text, re.DOTALL | re.MULTILINE)
    assert section is not None, f"docs/extend.md has no section {title!r}"
    block = re.search(r"^```python\n(.*?)^```", section[1], re.DOTALL | re.MULTILINE)
    assert block is not None, f"section {title!r} has no Python"
    return block[1]


@pytest.fixture
def own_folder(tmp_path, monkeypatch):
    folder = tmp_path / "effects"
    folder.mkdir()
    (folder / "spinning_rotor.py").write_text(example("An effect"), encoding="utf-8")
    before = set(catalogue())
    monkeypatch.setenv("FREESWING_EFFECTS", str(folder))
    assert set(catalogue()) == before | {NAME}
    return folder


def test_an_effect_in_ones_own_folder_is_described(own_folder, capsys) -> None:
    assert main(["effects"]) == 0
    listed = capsys.readouterr().out
    assert f"{NAME}: a rotor that spins on the platform\n" in listed, listed
    assert main(["effects", NAME]) == 0
    told = capsys.readouterr().out
    assert "moment -omega x h" in told, told
    assert "momentum_z_m2_s: -0.5 to 0.5" in told, told
    assert "die away" in told, told


def test_an_effect_in_ones_own_folder_swings(own_folder, tmp_path) -> None:
    robot = str(SAMPLES / "undeclared-drag" / "robot.toml")
    words = [
        "simulate",
        robot,
        "",
        "--lengths-m",
        "1.3,1.26,1.57,1.56",
        "--duration-s",
        "2",
        "--amplitude-m",
        "0.05",
        "--seed",
        "1",
    ]
    paths = [tmp_path / "with.csv", tmp_path / "without.csv"]
    for path, more in zip(
        paths, (["--effect", NAME, "--set", "momentum_z_m2_s=0.1"], []), strict=True
    ):
        words[2] = str(path)
        assert main([*words, *more]) == 0
    one, other = (read_trajectory(path).values for path in paths)
    apart = np.abs(one - other).max()
    assert apart > 1e-3, f"the rotor changes the swing by {apart:.1e}"


@pytest.mark.slow
def test_an_effect_in_ones_own_folder_is_found_in_a_session(own_folder, tmp_path) -> None:
    """The session comes from the independent simulator, which has such a rotor of its own."""
    truth = make_session(
        tmp_path / "session", 31, effects={NAME: "large"}, n_runs=5, duration_s=3.0
    )
    session = read_session(truth.folder)
    robot = load_robot(session)
    runs = list(load_swings(session, robot, load_target(session)))
    candidates = (NAME, "rotational_drag")
    found = diagnose(runs, robot, workers=1, candidates=candidates)
    assert found.final.model.effects == (NAME,), found.candidates
    (entry,) = found.document()["accepted"]
    told = np.array([[p["value"], p["std"]] for p in entry["parameters"]])
    true = np.asarray(truth.scene.world.rotor) / truth.scene.world.mass
    off = np.abs(told[:, 0] - true) / told[:, 1]
    assert off.max() < 4.0, f"{told[:, 0]} +- {told[:, 1]}, true {true}"


def test_an_effects_own_experiment_is_advised(own_folder) -> None:
    assert "die away" in separating_experiment((NAME, "translational_drag"))


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("EFFECT = 1\n", "defines no EFFECT"),
        ("import not_there\n", "ModuleNotFoundError"),
        ("x = (\n", "SyntaxError"),
        ("from freeswing.cdpr.effects.forces.tether import EFFECT\n", "already an effect named"),
    ],
)
def test_a_file_that_is_no_effect_is_told(own_folder, text, complaint) -> None:
    (own_folder / "zz.py").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=complaint) as caught:
        effects_in(own_folder, set(catalogue()) - {NAME})
    assert "zz.py" in str(caught.value)


def test_a_folder_that_is_none_is_told(monkeypatch, capsys) -> None:
    monkeypatch.setenv("FREESWING_EFFECTS", "/not/there")
    assert main(["effects"]) == 2
    assert "FREESWING_EFFECTS: /not/there is not a folder" in capsys.readouterr().err


def module_of(title: str, name: str, monkeypatch) -> None:
    """The example as a module that is there under a name."""
    module = ModuleType(name)
    exec(compile(example(title), name, "exec"), module.__dict__)
    module.__doc__ = example(title).split('"""')[1]
    monkeypatch.setitem(sys.modules, name, module)


def test_a_board_needs_its_table_alone(capsys) -> None:
    exec(compile(example("A board"), "example", "exec"), {})
    assert capsys.readouterr().out == "(48, 3) 12\n"


def test_cameras_in_another_format_come_back(tmp_path, monkeypatch) -> None:
    module_of("A file format", "freeswing.calib.exchange.json_list", monkeypatch)
    monkeypatch.setitem(exchange._MODULES, "json-list", "json_list")
    cameras = rig(2)
    exchange.write(tmp_path / "cameras.json", cameras, "json-list")
    back = exchange.read(tmp_path / "cameras.json", "json-list")
    assert [camera.name for camera in back] == [camera.name for camera in cameras]
    for one, other in zip(cameras, back, strict=True):
        assert np.array_equal(one.params, other.params)
        assert np.array_equal(one.T_camera_base, other.T_camera_base)


def test_a_command_is_run(monkeypatch, capsys) -> None:
    module_of("A command", "freeswing.commands.session.runs", monkeypatch)
    monkeypatch.setattr(freeswing.main, "COMMANDS", {**freeswing.main.COMMANDS, "runs": "session"})
    assert main(["runs", str(SAMPLES / "undeclared-drag")]) == 0
    said = capsys.readouterr().out.splitlines()
    roles = {line.partition(": ")[2] for line in said}
    assert roles == {"identify", "validate"}, said


def test_a_camera_model_projects_as_its_general_one(monkeypatch) -> None:
    monkeypatch.setitem(PARAMETER_NAMES, "THREE_RADIAL", ())
    exec(compile(example("A camera model"), "example", "exec"), {})
    points = np.random.default_rng(0).uniform([-0.4, -0.4, 1.0], [0.4, 0.4, 2.0], (20, 3))
    own = np.array([900.0, 910.0, 640.0, 500.0, -0.1, 0.05, -0.01])
    general = np.array([*own[:6], 0.0, 0.0, own[6], 0.0, 0.0, 0.0])
    pixels, by_point, by_params = project_jacobian("THREE_RADIAL", points, own)
    assert np.array_equal(pixels, project("FULL_OPENCV", points, general))
    _, same_by_point, by_all = project_jacobian("FULL_OPENCV", points, general)
    assert np.abs(by_point - same_by_point).max() < 1e-9
    assert np.abs(by_params - by_all[..., [0, 1, 2, 3, 4, 5, 8]]).max() < 1e-9
