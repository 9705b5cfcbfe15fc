"""The benchmark's list of sealed sessions, and how visible their effects are."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from benchmarks.diagnose.sealed_diagnosis import summary
from freeswing.session.load_swings import load_target
from freeswing.session.marker_runs import read_marker_runs
from freeswing.session.session_file import read_session
from tests.oracle.recorded.cases import TIERS, manifest
from tests.oracle.recorded.lab_days import make_lab_day
from tests.oracle.recorded.sessions import SessionTruth, make_session
from tests.oracle.recorded.visibility import visibility
from tests.oracle.scenes.effects import EFFECTS, SIZES
from tests.oracle.scenes.outside import OUTSIDE


def test_every_effect_at_every_size_and_forty_clean_sessions() -> None:
    cases = manifest("standard")
    kinds = Counter(case.kind for case in cases)
    singles = {case.effects[0] for case in cases if case.kind == "single"}
    outside = {case.effects[0][0] for case in cases if case.kind == "outside"}
    assert kinds["clean"] == 40, kinds
    assert singles == {(name, size) for name in EFFECTS for size in SIZES}
    assert outside == set(OUTSIDE)
    assert {(case.robot, case.pose) for case in cases if case.kind == "clean"} == {
        ("bologna-4", True),
        ("bologna-4", False),
        ("three-cable", True),
        ("three-cable", False),
    }


def test_tiers_grow_and_names_and_seeds_are_unique() -> None:
    lists = [manifest(tier) for tier in TIERS]
    names = [{case.name for case in cases} for cases in lists]
    assert names[0] < names[1] < names[2]
    assert [len(cases) for cases in lists] == [len(found) for found in names]
    assert len({case.seed for case in lists[2]}) == len(lists[2])


def test_another_draw_has_the_same_names_and_other_seeds() -> None:
    first, again = (manifest("full", draw) for draw in (0, 1))
    assert [case.name for case in first] == [case.name for case in again]
    assert not {case.seed for case in first} & {case.seed for case in again}


def test_unknown_tier_is_refused() -> None:
    with pytest.raises(ValueError, match="must be one of"):
        manifest("huge")


def test_a_case_makes_its_session(tmp_path: Path) -> None:
    case = next(case for case in manifest("quick") if case.kind == "pair")
    truth = case.make(tmp_path, n_runs=2, duration_s=0.5)
    found = [entry["effect"] for entry in truth.scene.record]
    assert found == [name for name, _ in case.effects]
    assert (tmp_path / case.name / "session.toml").exists()


def test_a_lab_day_is_read_as_markers_and_its_spoiled_marker_is_what_the_truth_says(
    tmp_path: Path,
) -> None:
    case = next(case for case in manifest("lab") if case.robot == "three-cable")
    # Stiff cables take most of the simulator's time.
    quick = {name: size for name, size in case.effects if name != "cable_elasticity"}
    folder = tmp_path / case.name
    truth = make_lab_day(folder, case.seed, case.robot, quick, n_runs=4, duration_s=3.0)
    assert {entry["effect"] for entry in truth.scene.record} == set(quick)
    session = read_session(folder)
    runs = read_marker_runs(session, load_target(session)).runs
    left_out = {
        name: [run.examined.recording.names[k] for k in run.examined.rigidity.left_out]
        for name, run in runs.items()
    }
    spoiled = json.loads((folder / "truth" / "truth.json").read_text())["spoiled"]
    assert {name: out[0] for name, out in left_out.items() if out} == spoiled
    assert len(spoiled) == 2


@pytest.fixture(scope="module")
def sessions(tmp_path_factory: pytest.TempPathFactory) -> dict[str, SessionTruth]:
    made = {}
    for name, effects in {
        "clean": {},
        "small": {"translational_drag": "small"},
        "large": {"translational_drag": "large"},
    }.items():
        folder = tmp_path_factory.mktemp(name)
        made[name] = make_session(folder, 9, "bologna-4", effects, n_runs=2, duration_s=3.0)
    return made


def test_nothing_is_visible_in_a_clean_session(sessions: dict[str, SessionTruth]) -> None:
    seen = visibility(sessions["clean"], "bologna-4")
    assert seen < 0.05, f"{seen:.3f} standard deviations of nothing"


@pytest.mark.slow
def test_larger_drag_is_more_visible(sessions: dict[str, SessionTruth]) -> None:
    small, large = (visibility(sessions[size], "bologna-4") for size in ("small", "large"))
    assert small > 1.0, f"small {small:.2f}"
    assert 10.0 < large / small < 20.0, f"rate 16 times larger: {small:.2f} to {large:.2f}"


@pytest.mark.parametrize(("seen", "below"), [(3.9, 1), (4.1, 0)])
def test_what_hardly_stands_out_is_counted_apart_and_judged_as_ever(
    seen: float, below: int
) -> None:
    row: dict[str, Any] = {"case": "faint", "kind": "single", "effects": [["tether", "small"]]}
    row |= {"found": [], "wrong": [], "accepted": [], "after_over_floor": 1.0, "visibility": seen}
    lines = summary([row])
    assert "right answers, single: 0 of 1" in lines
    assert f"of those missed below 4 deviations: {below} of 1 known" in lines
    assert f"  faint: {seen} deviations" in lines
