"""What was said badly, or not at all: the right sentence for each slip."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.doctor.time_stamps import stamp_findings
from freeswing.ident.diagnose.decision import _verdict
from freeswing.main import main
from freeswing.report.words import number, with_decimals
from freeswing.session.session_file import is_device
from tests.places import SAMPLES

ROBOT = str(SAMPLES / "two-cables" / "robot.toml")


def refused(capsys: pytest.CaptureFixture[str], *words: str | Path) -> str:
    """What a command that ends with 2 says."""
    try:
        status = main([*map(str, words)])
    except SystemExit as end:  # of argparse
        status = int(str(end.code))
    said = capsys.readouterr().err
    assert status == 2, said
    assert "Traceback" not in said
    return said


@pytest.mark.parametrize("value", ["0", "-3", "nan", "1e3", "99999"])
@pytest.mark.parametrize("command", ["track", "diagnose", "run"])
def test_workers(session: Path, command: str, value: str, capsys) -> None:
    assert "give 1 to 1024, or leave it out" in refused(
        capsys, command, session, f"--workers={value}"
    )


@pytest.mark.parametrize("value", ["nan", "inf", "-1", "x"])
@pytest.mark.parametrize("flag", ["--noise-m", "--noise-rad", "--duration-s", "--rate-hz"])
def test_numbers_of_a_simulation(flag: str, value: str, tmp_path: Path, capsys) -> None:
    words = ("simulate", ROBOT, tmp_path / "a.csv", "--lengths-m", "1.4,1.9", f"{flag}={value}")
    assert "give a finite number above 0" in refused(capsys, *words)


@pytest.mark.parametrize(
    "words",
    [
        ("linearise", ROBOT, "--at", "0", "0", "nan", "0", "0", "0"),
        ("excite", ROBOT, "--tension-n", "nan", "200"),
        ("design", ROBOT, "--at", "0", "0", "inf", "0", "0", "0"),
        ("identify", ROBOT, "--entry-std-m", "nan"),
        ("identify", ROBOT, "--attachment-std-m", "-1"),
        ("board", ROBOT, "--dpi", "nan"),
    ],
    ids=" ".join,
)
def test_numbers_that_are_none(words: tuple[str, ...], capsys) -> None:
    assert "give a finite number" in refused(capsys, *words)


def test_a_setting_without_its_effect(tmp_path: Path, capsys) -> None:
    words = ("simulate", ROBOT, tmp_path / "a.csv", "--lengths-m", "1.4,1.9", "--set", "c=1")
    assert "--set c: a number of which effect? Name it by --effect" in refused(capsys, *words)


@pytest.mark.parametrize("name", ["con", "NUL", "com1", "Lpt9.x", "aux.2024", "prn .a"])
def test_runs_that_are_devices(session: Path, name: str, capsys) -> None:
    path = session / "session.toml"
    path.write_text(path.read_text(encoding="utf-8").replace('swing-01"', f'{name}"', 1))
    assert "which Windows keeps for a device" in refused(capsys, "check", session)


@pytest.mark.parametrize("letter", ["\\u0007", "\\n", "\\u009b31m", "\\t", "\\u007f"])
@pytest.mark.parametrize("file", ["session.toml", "robot.toml"])
def test_control_characters_in_names(session: Path, file: str, letter: str, capsys) -> None:
    path = session / file
    text = path.read_text(encoding="utf-8").replace('\nname = "', f'\nname = "a{letter}', 1)
    path.write_text(text, encoding="utf-8")
    said = refused(capsys, "identify", session)
    assert "holds a control character" in said
    assert not set(said) & {"\x07", "\x9b", "\x7f"}


@pytest.mark.parametrize("name", ["icon", "con1", "com", "console", "null", "swing.con"])
def test_names_that_are_none(name: str) -> None:
    assert not is_device(name)


@pytest.mark.parametrize("count", [6, 8])
def test_as_many_cables_as_coordinates(session: Path, count: int, capsys) -> None:
    robot = session / "robot.toml"
    text = re.sub(r"free_coordinates = .*", "", robot.read_text(encoding="utf-8"))
    head, *cables = text.split("[[cables]]")
    many = (cables * 2)[:count]
    named = [text.replace('name = "', f'name = "{k}-', 1) for k, text in enumerate(many)]
    robot.write_text("[[cables]]".join([head, *named]), encoding="utf-8")
    for command in ("identify", "diagnose", "run"):
        said = refused(capsys, command, session)
        assert f"{count} locked cables leave the platform no free motion" in said
        assert "slack" not in said


def since_1970(session: Path) -> None:
    for path in (session / "runs").iterdir():
        head, *rows = path.read_text(encoding="utf-8").splitlines()
        moved = [f"{1.7e9 + float(row.split(',')[0]):.3f},{row.partition(',')[2]}" for row in rows]
        path.write_text("\n".join([head, *moved, ""]), encoding="utf-8")


def test_times_since_1970_are_named_and_written_out(session: Path, capsys) -> None:
    since_1970(session)
    assert main(["check", str(session)]) == 1  # the windows count from the first sample
    told = capsys.readouterr().out
    assert "its times begin at 1700000000 s: they count from 1970; window_s counts so too" in told
    assert "it lasts from 1700000000 to 1700000006 s" in told
    path = session / "session.toml"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("window_s = [0.0, 6.0]", ""), encoding="utf-8")
    assert main(["check", str(session)]) == 0
    assert "they count from 1970" in capsys.readouterr().out


@pytest.mark.parametrize(("start_s", "is_said"), [(0.9e9, False), (1.1e9, True)])
def test_a_machine_that_ran_for_long(start_s: float, is_said: bool) -> None:
    times = start_s + 0.01 * np.arange(100.0)
    motion = Trajectory(times, ("chi",), np.sin(times - start_s)[:, None])
    found = [one.text for one in stamp_findings("run a", motion, None)]
    assert any("count from 1970" in text for text in found) == is_said


@pytest.mark.parametrize(
    ("gain", "said"), [(-0.039, "removes nothing"), (-4e-4, "removes nothing"), (0.0391, "3.9 %")]
)
def test_what_an_effect_removes(gain: float, said: str) -> None:
    verdict, why, _ = _verdict("linear_drag", "", (), {}, None, {}, gain)
    assert verdict == "rejected"
    assert said in why
    assert "-" not in why


def test_cameras_that_are_not_there(session: Path, capsys) -> None:
    path = session / "session.toml"
    text = path.read_text(encoding="utf-8")
    text = text.replace('trajectory = "runs/swing-01.csv"', 'video = "runs"')
    path.write_text(text, encoding="utf-8")
    assert main(["track", str(session)]) == 1
    said = capsys.readouterr().err
    assert "names no recordings of a board to calibrate from" in said
    assert "calibrate first" not in said


def test_no_sign_before_nothing() -> None:
    assert with_decimals(-1e-7, 1e-3) == "0.0000"
    assert number(-0.0) == "0.00"
    assert number(-0.1234) == "-0.123"


MUTTERS = """
import sys, warnings
from freeswing.commands.session import check
from freeswing.main import main
def run(options, console):
    warnings.warn("a package mutters", RuntimeWarning)
    raise ValueError("the sentence")
check.run = run
sys.argv = ["freeswing", "check", "."]
sys.exit(main())
"""


def test_a_sentence_stands_alone() -> None:
    done = subprocess.run([sys.executable, "-c", MUTTERS], capture_output=True, text=True)
    assert "the sentence" in done.stderr
    assert "mutters" not in done.stderr
