"""Recordings of any name, and whole poses of a bench: what `new` writes is read again."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import pytest

from freeswing.main import main
from freeswing.session.new_recordings import take_in
from freeswing.session.session_file import as_run_name, read_session
from freeswing.starter import questions
from tests.places import SAMPLES

POSES = sorted((SAMPLES / "trifilar" / "poses" / "runs").glob("*.csv"))


def named(folder: Path, names: list[str]) -> list[str]:
    folder.mkdir()
    for name, file in zip(names, POSES, strict=False):
        shutil.copy(file, folder / name)
    return [str(folder / name) for name in names]


@pytest.mark.skipif(os.name == "nt", reason="no such file names there")
def test_recordings_of_any_name_become_runs(tmp_path: Path, capsys) -> None:
    files = named(tmp_path / "in", ['a "b" (1).csv', "a 'b' (1).csv", "back\\slash.csv"])
    folder = tmp_path / "lab-day"
    assert main(["new", str(folder), "--kind", "plate", "--mocap", *files]) == 0
    runs = read_session(folder).runs
    assert [run.name for run in runs] == ["a -b- -1-", "a -b- -1--2", "back-slash"]
    assert all(run.trajectory is not None and run.trajectory.is_file() for run in runs)
    later = folder / "runs" / 'late "one".csv'
    shutil.copy(POSES[0], later)
    assert take_in(read_session(folder), [later]) == ["late -one-"]
    assert read_session(folder).runs[-1].trajectory == later
    alike = [folder / "runs" / name for name in ("b [1].csv", "b (1).csv")]
    for file in alike:
        shutil.copy(POSES[0], file)
    assert take_in(read_session(folder), alike) == ["b -1-", "b -1--2"], "one was left alone"
    broken = folder / "runs" / "two\nlines.csv"
    shutil.copy(POSES[0], broken)
    assert take_in(read_session(folder), [broken]) == []
    assert main(["new", str(tmp_path / "b"), "--mocap", str(broken)]) == 2
    assert r"'two\nlines.csv': holds a control character: rename it" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "taken", "name"),
    [
        ("swing-01", (), "swing-01"),
        ("swing-01", ("Swing-01", "swing-01-2"), "swing-01-3"),
        (" .hidden. ", (), "hidden"),
        ("con", (), "run-con"),
        ("...", (), "run"),
        ("a/b\n\u2028c", (), "a-b--c"),
        ("x" * 200, ("x" * 100,), "x" * 98 + "-2"),
    ],
)
def test_a_name_that_a_run_may_have(text: str, taken: tuple[str, ...], name: str) -> None:
    assert as_run_name(text, taken) == name


def test_a_camera_names_its_files(tmp_path: Path, capsys) -> None:
    for name, nearest in (('le"ft', "le-ft"), ("con", "run-con")):
        assert main(["new", str(tmp_path / "a"), "--cameras", name, "right"]) == 2
        said = capsys.readouterr().err
        assert f"--cameras {name!r}: its films are named so" in said
        assert said.rstrip().endswith(f"such as {nearest}")


def test_a_camera_named_at_the_terminal_names_its_files_too(tmp_path, capsys, monkeypatch) -> None:
    told = questions.Answers(kind="plate", cameras=("le/ft", "right"), measured_by="cameras")
    monkeypatch.setattr(questions, "ask", lambda _: told)
    for stream in (sys.stdin, sys.stderr):
        monkeypatch.setattr(stream, "isatty", lambda: True)
    assert main(["new", str(tmp_path / "a")]) == 2
    assert "--cameras 'le/ft'" in capsys.readouterr().err
    assert not (tmp_path / "a").exists()


def test_whole_poses_of_a_bench_show_loads_payloads_and_lengths(tmp_path: Path) -> None:
    """As comments: the platform's own swings need none of them."""
    folder = tmp_path / "bench"
    flags = ["--kind", "trifilar", "--mocap", *map(str, POSES)]
    assert main(["new", str(folder), *flags]) == 0
    assert len(read_session(folder).runs) == len(POSES)
    text = (folder / "session.toml").read_text(encoding="utf-8")
    head, *runs = text.split("[[runs]]")
    opened = ("[[loads]]", 'name = "', "mass_kg", "mass_std_kg", "com_m", "payload", "loads")
    for key in (*opened, "cable_lengths_m", "cable_lengths_std_m"):
        head = head.replace(f"\n# {key}", f"\n{key}")
        runs[0] = runs[0].replace(f"\n# {key}", f"\n{key}")
    (folder / "session.toml").write_text("[[runs]]".join([head, *runs]), encoding="utf-8")
    session = read_session(folder)
    assert [load.mass_kg for load in session.loads] == [0.8]
    first, *others = session.runs
    assert len(first.loads) == len(first.payloads) == 1
    assert first.cable_lengths_m is not None
    assert first.cable_lengths_m.tolist() == [1.2, 1.2, 1.2]
    assert not any(run.loads or run.payloads for run in others)
