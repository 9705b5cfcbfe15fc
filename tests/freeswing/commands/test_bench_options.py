"""Flags on benches: those that do nothing there are refused by name, the others do something."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from freeswing.main import main

BENCH = Path(__file__).parents[3] / "samples" / "trifilar" / "poses"
ROBOT = Path(__file__).parents[3] / "samples" / "three-cables"


@pytest.mark.parametrize(
    ("flags", "named"),
    [
        (["--weighting", "covariance"], "--weighting covariance"),
        (["--fidim-only"], "--fidim-only"),
        (["--consistent", "--fidim-only"], "--fidim-only and --consistent"),
        (["--entry-std-m", "0.5"], "--entry-std-m"),
    ],
)
def test_identify_refuses_what_a_bench_has_no_use_for(tmp_path, capsys, flags, named) -> None:
    assert main(["identify", str(BENCH), "--results", str(tmp_path), *flags]) != 0
    assert named in capsys.readouterr().err
    assert not (tmp_path / "identification.json").exists()


@pytest.mark.parametrize(
    ("flags", "named"),
    [
        (["--swings", "3"], "--swings"),
        (["--winch", "--seed", "0"], "--seed, --winch"),
        (["--tension-n", "1", "2", "--reach-m", "1"], "--tension-n, --reach-m"),
    ],
)
def test_excite_refuses_flags_of_swings_for_a_bench(tmp_path, capsys, flags, named) -> None:
    robot = str(BENCH / "robot.toml")
    assert main(["excite", robot, "--results", str(tmp_path), *flags]) != 0
    told = capsys.readouterr().err
    assert named in told, told


def test_excite_refuses_flags_of_benches_for_a_cable_robot(tmp_path, capsys) -> None:
    flags = ["--results", str(tmp_path), "--load-kg", "2"]
    assert main(["excite", str(ROBOT / "robot.toml"), *flags]) != 0
    assert "--load-kg" in capsys.readouterr().err


def test_excite_plans_a_bench_of_another_mass_for_runs_of_a_given_length(tmp_path) -> None:
    robot, plans = str(BENCH / "robot.toml"), []
    for flags in ([], ["--mass-kg", "50"], ["--duration-s", "35"]):
        assert main(["excite", robot, "--results", str(tmp_path), "--quiet", *flags]) == 0
        plans.append(json.loads((tmp_path / "bench-plan.json").read_text("utf-8")))
    assert plans[1] != plans[0]
    lengths = [row["value"] for row in plans[2]["choices"] if row["what"] == "duration_s"]
    assert lengths == [35.0], lengths
