"""`run` always ends with a page, and each section that could not be made says why."""

from __future__ import annotations

import html
import re
from pathlib import Path

import pytest

from freeswing.main import main


def page_of(session: Path) -> str:
    """The words of the report, without its marks."""
    text = (session / "results" / "report.html").read_text(encoding="utf-8")
    return " ".join(html.unescape(re.sub(r"<[^>]*>", " ", text)).split())


def test_data_that_give_no_result(session: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", str(session), "--workers", "1"]) == 1
    told = capsys.readouterr()
    assert "report.html" in told.out
    assert "no inertial parameter can be identified" in told.err
    assert page_of(session).count("no inertial parameter can be identified") >= 1


def test_runs_that_are_all_fitted(session: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = session / "session.toml"
    path.write_text(path.read_text(encoding="utf-8").replace("validate", "identify"))
    assert main(["check", str(session)]) == 0
    assert "none has the role validate" in capsys.readouterr().out
    assert main(["run", str(session), "--workers", "1"]) == 1
    told = capsys.readouterr()
    assert 'diagnose: left out. No run has role = "validate"' in told.out
    page = page_of(session)
    assert 'No run has role = "validate": missing effects are judged on runs' in page
    assert "no inertial parameter can be identified" in page


@pytest.mark.parametrize(
    ("file", "text", "why"),
    [
        ("runs/swing-01.csv", "a,b\n1,2\n", "unknown column"),
        ("robot.toml", 'format = "freeswing-robot/1"\n', "robot.toml"),
        ("robot.toml", "nothing", "not TOML"),
    ],
)
def test_files_that_are_wrong(
    session: Path, file: str, text: str, why: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (session / file).write_text(text, encoding="utf-8")
    assert main(["run", str(session), "--workers", "1"]) == 2
    told = capsys.readouterr()
    assert why in told.err
    assert "report.html" in told.out
    assert why in page_of(session)
