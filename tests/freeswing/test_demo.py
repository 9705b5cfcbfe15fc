"""`freeswing demo` from nothing to the report: the undeclared drag found, the path said last."""

from __future__ import annotations

import json
import multiprocessing
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.compiled.kernels import is_kept
from freeswing.cdpr.model.equations import build_model
from freeswing.demo import mocap, rehearsal, truth
from freeswing.demo.lessons import LESSONS
from freeswing.demo.rehearsal import rehearse
from freeswing.ident.diagnose.heldout import Stage, held_out
from freeswing.ident.identify import IdentifySettings, identify
from freeswing.main import main
from freeswing.session import stages
from freeswing.session.load_swings import load_robot, load_swings, load_target
from freeswing.session.session_file import read_session
from freeswing.vision.fuse.pose_kernels import solve_block

FEW_SWINGS = ("swing-01", "swing-02", "swing-03", "check-01")
SHORT_S = 4.0
LEAST_SHARE_CLOSED = 0.9


def check_ending(folder: Path, said: str) -> None:
    """The before/after line, then the report's path; the drag accepted, its rate right."""
    lines = said.strip().splitlines()
    page = folder / "results" / "report.html"
    assert lines[-1] == str(page)
    assert lines[-2].startswith("  held-out runs: off by "), lines[-2]
    assert page.stat().st_size > 100_000, f"{page.stat().st_size} bytes"
    text = page.read_text(encoding="utf-8")
    assert "The model lacked: translational drag." in text
    diagnosis = json.loads((folder / "results" / "diagnosis.json").read_text(encoding="utf-8"))
    assert [entry["effect"] for entry in diagnosis["accepted"]] == [truth.EFFECT]
    rate = {p["name"]: p for p in diagnosis["accepted"][0]["parameters"]}["rate_1_s"]
    z = (rate["value"] - truth.EFFECT_VALUES[0]) / rate["std"]
    assert abs(z) < 4.5, f"rate {rate['value']} ± {rate['std']} 1/s, truly {truth.EFFECT_VALUES[0]}"
    share = diagnosis["share_closed"]
    assert share > LEAST_SHARE_CLOSED, f"{share:.3f} of the distance to the noise closed"


@pytest.mark.slow
def test_a_short_one_by_motion_capture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Fewer and shorter swings, one candidate: the same way in a few seconds."""
    few = tuple(swing for swing in truth.SWINGS if swing[0] in FEW_SWINGS)
    monkeypatch.setattr(truth, "SWINGS", few)
    monkeypatch.setattr(mocap, "DURATION_S", SHORT_S)
    quick = replace(stages.DIAGNOSE, settings={"only": (truth.EFFECT,)})
    monkeypatch.setattr(stages, "STAGES", (*stages.STAGES[:-1], quick))
    folder = tmp_path / "demo"
    assert main(["demo", str(folder), "--mocap", "--workers", "1"]) == 0
    said = capsys.readouterr().out
    check_ending(folder, said)
    assert f"identify: {LESSONS['identify']}" in said


def test_which_swings_are_made_does_not_change_them() -> None:
    """The filmed ones are those of the same seed's seven."""
    some = truth.demo_swings(np.random.default_rng(1), 0.3, names=("swing-01", "check-01"))
    every = {one.name: one for one in truth.demo_swings(np.random.default_rng(1), 0.3)}
    assert [one.name for one in some] == ["swing-01", "check-01"]
    for one in some:
        assert np.array_equal(one.motion.zetas, every[one.name].motion.zetas)


def test_the_rehearsal_goes_as_far_as_poses(tmp_path: Path) -> None:
    """What it compiles is what tracking calls: it tracks, with the demonstration's cameras."""
    assert rehearse(tmp_path)
    assert is_kept(solve_block)
    tracked = json.loads((tmp_path / "results" / "tracking.json").read_text(encoding="utf-8"))
    assert tracked["format"] == "freeswing-tracking/1", tracked["format"]


def test_a_rehearsal_ends_with_what_it_is_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rehearsal, "is_kept", lambda _: False)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with rehearsal.rehearsed():
        assert len(multiprocessing.active_children()) == 1
        assert len(list(tmp_path.iterdir())) == 1
    assert multiprocessing.active_children() == []
    assert list(tmp_path.iterdir()) == []


def test_every_step_has_its_sentence() -> None:
    assert list(LESSONS) == [stage.name for stage in stages.STAGES]


@pytest.mark.slow
def test_held_out_swings_under_their_true_model(tmp_path: Path) -> None:
    """All swings are predicted to their noise; a fit of the start that gets stuck is begun anew."""
    session = read_session(mocap.write_mocap_session(tmp_path / "demo"))
    robot = load_robot(session)
    swings = list(load_swings(session, robot, load_target(session)))
    found = identify(swings, robot, IdentifySettings(maximum_likelihood=False, predict=False))
    held = [run for run in found.prepared.runs if run.run.role == "validate"]
    model = build_model(robot, (truth.EFFECT,))
    values = np.array(truth.EFFECT_VALUES)
    (true,) = held_out([Stage(model, truth.TRUE_INERTIA, values)], held, None)()
    ratios = {
        run.run: run.prediction.rmse_m / run.noise_floor_m
        for run in true.runs
        if run.prediction and run.prediction.rmse_m
    }
    assert sorted(ratios) == ["check-01", "check-02"]
    assert max(ratios.values()) < 1.2, ratios


def test_other_folders_are_left_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "thesis.txt").write_text("dear", encoding="utf-8")
    assert main(["demo", str(tmp_path)]) == 2
    assert "name a new folder" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


@pytest.mark.slow
@pytest.mark.parametrize("more", [(), ("--mocap",)])
def test_all_of_it(
    more: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "demo"
    assert main(["demo", str(folder), *more]) == 0
    check_ending(folder, capsys.readouterr().out)
    names = {path.name for path in (folder / "results").iterdir()}
    assert {"identification.json", "diagnosis.json", "report.html"} <= names
