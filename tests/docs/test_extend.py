"""The examples of docs/extend.md, each tried as it stands there."""

from __future__ import annotations

import re

import numpy as np
import pytest

from freeswing.cdpr.effects import catalogue
from freeswing.cdpr.effects.own_folders import effects_in
from freeswing.cdpr.files.problems import InputError
from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.ident.diagnose.diagnose import diagnose
from freeswing.ident.diagnose.experiments import separating_experiment
from freeswing.main import main
from freeswing.session.load_swings import load_robot, load_swings, load_target
from freeswing.session.session_file import read_session
from tests.oracle.sessions import make_session
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
