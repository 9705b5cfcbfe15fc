"""The command line: start-up, exit statuses, plain words instead of tracebacks."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from freeswing.main import COMMANDS, main

LONGEST_HELP_S = 0.3


def test_help_starts_quickly() -> None:
    times = []
    for _ in range(5):
        before = _child_seconds()
        done = subprocess.run(
            [sys.executable, "-m", "freeswing.main", "--help"], capture_output=True, check=True
        )
        times.append(_child_seconds() - before)
        assert b"usage: freeswing" in done.stdout, done
    assert min(times) < LONGEST_HELP_S, f"--help took {min(times):.3f} s of processor at best"


def _child_seconds() -> float:
    """Processor time of the programs started so far: wall time is the machine's, not ours."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def test_help_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(["--help"])
    text = capsys.readouterr().out
    assert stopped.value.code == 0
    assert [name for name in COMMANDS if name not in text] == []


def test_help_imports_nothing_heavy() -> None:
    code = "import sys, freeswing.main as m; m.build_parser(); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True)
    heavy = {"numpy", "scipy", "casadi", "cv2", "matplotlib", "rich", "av"}
    assert heavy & set(done.stdout.split()) == set()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["run", "x", "--workers", "0"], "give 1 to 1024"),
        (["run", "x", "--workers", "-3"], "give 1 to 1024"),
        (["simulate", "r.toml", "x", "--noise-m", "nan"], "finite number"),
        (["simulate", "r.toml", "x", "--noise-m", "-1"], "finite number"),
        (["simulate", "r.toml", "x", "--rate-hz", "0"], "above 0"),
        (["simulate", "r.toml", "x", "--duration-s", "-1"], "above 0"),
        (["excite", "r.toml", "--swings", "0"], "above 0"),
        (["home", "h.toml", "--seed", "-1"], "whole number"),
    ],
)
def test_numbers_that_no_run_can_use_are_2(
    words: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(words)
    assert stopped.value.code == 2
    assert told in capsys.readouterr().err


@pytest.mark.parametrize("words", [[], ["fly"], ["report"], ["report", "x", "--nothing"]])
def test_wrong_usage_is_2(words: list[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(words)
    assert stopped.value.code == 2, stopped.value.code


def test_an_absent_session_is_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", str(tmp_path / "nothing")]) == 2
    said = capsys.readouterr()
    assert "no such file" in said.err
    assert "Traceback" not in said.err


def test_a_result_of_another_kind_is_2(session: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (session / "results").mkdir()
    (session / "results" / "diagnosis.json").write_text('{"format": "x"}', encoding="utf-8")
    assert main(["report", str(session)]) == 2
    assert "freeswing-diagnosis/1" in capsys.readouterr().err


def test_findings_that_prevent_a_result_are_1(
    session: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (session / "runs" / "swing-01.csv").unlink()
    assert main(["check", str(session)]) == 1
    said = capsys.readouterr()
    assert "swing-01.csv: no such file" in said.out
    assert "1 finding to mend" in said.err


def test_json_is_the_result_file_alone(session: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(session), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    written = json.loads((session / "results" / "check.json").read_text(encoding="utf-8"))
    assert document == written
    assert document["format"] == "freeswing-check/1"


def test_results_elsewhere_leave_the_session_alone(session: Path, tmp_path: Path) -> None:
    before = sorted(session.rglob("*"))
    assert main(["report", str(session), "--results", str(tmp_path / "out"), "--quiet"]) == 0
    assert (tmp_path / "out" / "report.html").is_file()
    assert sorted(session.rglob("*")) == before


def test_verbose_shows_where_it_failed(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no such file"):
        main(["report", str(tmp_path / "nothing"), "--verbose"])


def test_convert_keeps_poses_and_refuses_itself(session: Path, tmp_path: Path) -> None:
    source = session / "runs" / "swing-01.csv"
    tum, back = tmp_path / "a.tum", tmp_path / "b.csv"
    assert main(["convert", str(source), str(tum), "--quiet"]) == 0
    assert main(["convert", str(tum), str(back), "--quiet"]) == 0
    first, second = (path.read_text(encoding="utf-8").split("\n") for path in (source, back))
    assert len(first) == len(second)
    assert main(["convert", str(source), str(source), "--quiet"]) == 2
    assert main(["convert", str(source), str(tmp_path / "a.mp4"), "--quiet"]) == 2
    assert main(["convert", str(source), str(tmp_path / "a.trc"), "--quiet"]) == 2
