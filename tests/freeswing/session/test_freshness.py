"""Stale beside new: results compare what they were made of, and are not mixed."""

from __future__ import annotations

from pathlib import Path

import pytest

from freeswing.cdpr.files.documents import write_json
from freeswing.cdpr.robot import INERTIA_NAMES
from freeswing.main import main
from freeswing.session.freshness import stale_results
from freeswing.session.provenance import hashes, provenance
from freeswing.session.session_file import read_session
from freeswing.session.stages import DIAGNOSE, IDENTIFY, Stage


def leave(session: Path, stage: Stage, table: dict) -> None:
    """A stage's result as it would stand after a run just now, its other file included."""
    opened = read_session(session)
    made_of = provenance(opened, stage.inputs(opened), stage.settings)
    for path in stage.others(opened):
        motion = {"format": "freeswing-motion/1", "runs": [], "provenance": made_of}
        write_json(path, motion)
    outputs = hashes(opened, stage.others(opened))
    told = {**made_of, "outputs": outputs}
    document = {"format": f"freeswing-{stage.result.removesuffix('.json')}/1", **table}
    write_json(opened.results / stage.result, {**document, "provenance": told})


def rows(size: float) -> list[dict]:
    values = (0.01, -0.02, 0.19, 0.056, 0.066, 0.037, 1e-4, -9e-4, 7e-4)
    return [
        {"name": name, "value": size * value, "std": 1e-5}
        for name, value in zip(INERTIA_NAMES, values, strict=True)
    ]


@pytest.fixture
def solved(session: Path) -> Path:
    leave(session, IDENTIFY, {"estimates": {"ml_full": {"parameters": rows(1.0)}}})
    leave(session, DIAGNOSE, {"parameters_after": rows(1.0)})
    return session


def edit_robot(session: Path) -> None:
    path = session / "robot.toml"
    text = path.read_text(encoding="utf-8")
    path.write_text(f"{text}\n# moved\n", encoding="utf-8")


def test_fresh_results_are_fresh(solved: Path) -> None:
    opened = read_session(solved)
    assert stale_results(opened) == ()
    assert IDENTIFY.is_current(opened)
    assert DIAGNOSE.is_current(opened)


def test_an_edited_robot_is_named_and_nothing_is_exported(
    solved: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    edit_robot(solved)
    assert main(["export", str(solved), "--urdf", "--mass-kg", "5"]) == 1
    told = capsys.readouterr().err
    assert "identification.json is out of date: robot.toml changed since" in told, told
    assert "run freeswing identify" in told
    assert not (solved / "results" / "platform.urdf").exists()


def test_old_beside_new_is_left_out_of_the_report_and_refused_by_export(
    solved: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    edit_robot(solved)
    leave(solved, IDENTIFY, {"estimates": {"ml_full": {"parameters": rows(2.0)}}})
    stale = stale_results(read_session(solved))
    assert {one.file for one in stale} == {"diagnosis.json", "diagnosis_motion.json"}
    assert all(one.mixed for one in stale)
    assert main(["report", str(solved)]) == 0
    page = (solved / "results" / "report.html").read_text(encoding="utf-8")
    assert "diagnosis.json is out of date: robot.toml changed since" in page
    table = (solved / "results" / "report-parameters.csv").read_text(encoding="utf-8")
    assert table.splitlines()[1].startswith("com_x_m,0.02,"), "the new one, not the old diagnosis'"
    assert main(["export", str(solved), "--urdf", "--mass-kg", "5"]) == 1
    assert "diagnosis.json is out of date" in capsys.readouterr().err


def test_results_that_are_all_old_are_shown_as_old(
    solved: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    edit_robot(solved)
    assert main(["report", str(solved)]) == 0
    assert "identification.json is out of date" in capsys.readouterr().err
    page = (solved / "results" / "report.html").read_text(encoding="utf-8")
    assert "identification.json is out of date" in page
    assert "com x" in page


@pytest.mark.parametrize("harm", ["deleted", "emptied", "cut short", "edited"])
def test_every_file_of_a_stage_counts_by_content(solved: Path, harm: str) -> None:
    path = solved / "results" / "motion.json"
    text = path.read_text(encoding="utf-8")
    if harm == "deleted":
        path.unlink()
    else:
        told = {"emptied": "", "cut short": text[:40], "edited": text.replace("[]", "[ ]")}
        path.write_text(told[harm], encoding="utf-8")
    opened = read_session(solved)
    assert not IDENTIFY.is_current(opened)
    assert DIAGNOSE.is_current(opened)


def test_a_main_file_cut_short_is_made_again(solved: Path) -> None:
    path = solved / "results" / "identification.json"
    path.write_text(path.read_text(encoding="utf-8")[:200], encoding="utf-8")
    assert not IDENTIFY.is_current(read_session(solved))


def test_no_validate_runs_is_said(solved: Path) -> None:
    path = solved / "session.toml"
    text = path.read_text(encoding="utf-8").replace('role = "validate"', 'role = "identify"')
    path.write_text(text, encoding="utf-8")
    assert main(["report", str(solved)]) == 0
    page = (solved / "results" / "report.html").read_text(encoding="utf-8")
    assert "No run has role = &#34;validate&#34;" in page


def test_a_run_that_gives_no_result_still_gives_a_report(
    session: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The fixture's samples obey no law, so that nothing can be identified from them."""
    assert main(["run", str(session), "--workers", "1"]) == 1
    told = capsys.readouterr()
    assert "identify: no inertial parameter can be identified" in told.err
    page = (session / "results" / "report.html").read_text(encoding="utf-8")
    assert "no inertial parameter can be identified from these runs" in page
