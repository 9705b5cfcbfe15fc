"""simulate --drive and linearise through the command line."""

import json

import numpy as np
import pytest

from freeswing.cdpr.files.drive_csv import read_drive_run
from freeswing.main import main
from tests.cdpr.driven_robots import INCA
from tests.places import SAMPLES


def simulate(path, *flags):
    return main(["simulate", str(INCA), str(path), "--drive", *flags, "--quiet"])


def test_a_recording_is_the_same_for_the_same_seed(tmp_path):
    flags = ["prbs", "--duration-s", "0.3", "--noise-m", "1e-3", "--encoder-step-rad", "0.001534"]
    for name, seed in (("a", "1"), ("b", "1"), ("c", "2")):
        assert simulate(tmp_path / f"{name}.csv", *flags, "--seed", seed) == 0
    first, again, other = ((tmp_path / f"{name}.csv").read_bytes() for name in "abc")
    assert first == again
    assert first != other
    record = read_drive_run(tmp_path / "a.csv", 8)
    assert len(record.times_s) == 301
    assert record.seen.tolist() == list(range(0, 301, 5))
    counts = record.angles_rad / 0.001534
    assert np.abs(counts - np.round(counts)).max() < 1e-6


def test_late_poses_are_the_earlier_ones(tmp_path):
    flags = ["steps", "--duration-s", "0.5", "--levels-a", "0", "2", "--pose-rate-hz", "1000"]
    assert simulate(tmp_path / "now.csv", *flags) == 0
    assert simulate(tmp_path / "late.csv", *flags, "--latency-s", "0.01") == 0
    now, late = (read_drive_run(tmp_path / f"{name}.csv", 8).poses for name in ("now", "late"))
    assert np.abs(late[10:] - now[:-10]).max() < 1e-7
    assert np.abs(late[10:] - now[10:]).max() > 1e-3


def test_a_cable_that_would_push_is_named(tmp_path, capsys):
    flags = ["prbs", "--band-hz", "5", "--duration-s", "1.5", "--seed", "3"]
    assert simulate(tmp_path / "a.csv", *flags) == 0
    assert "cable 2 would have to push" in capsys.readouterr().err


def test_elastic_cables_go_slack_instead(tmp_path, capsys):
    flags = ["prbs", "--band-hz", "5", "--duration-s", "0.4", "--levels-a", "0", "2.5"]
    assert simulate(tmp_path / "a.csv", *flags, "--elastic-n", "3000", "--seed", "3") == 0
    said = capsys.readouterr().err
    assert "is slack at" in said
    assert "have to push" not in said
    assert simulate(tmp_path / "a.csv", *flags, "--elastic-n", "0") == 2


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["ramp", "--motor", "9"], "--motor 9: not one of 1, 2"),
        (["prbs", "--levels-a", "0", "4"], "outside current_limits_A"),
        (["prbs", "--levels-a", "1", "0"], "the lower comes first"),
        (["sine"], "--drive sine: not prbs"),
        (["prbs", "--effect", "tether"], "--effect tether: not one of"),
        (["prbs", "--set", "mass=1"], "--set mass: not one of"),
    ],
)
def test_wrong_flags(tmp_path, capsys, flags, words):
    assert simulate(tmp_path / "a.csv", *flags, "--duration-s", "0.1") == 2
    assert words in capsys.readouterr().err


def test_the_linear_model_is_written(tmp_path):
    assert main(["linearise", str(INCA), "--results", str(tmp_path), "--quiet"]) == 0
    found = json.loads((tmp_path / "linear.json").read_text())
    assert np.array(found["A"]).shape == (12, 12)
    assert [mode["words"] for mode in found["modes"]][:3] == ["only z", "only y", "only x"]
    assert b"polyline" in (tmp_path / "linear.svg").read_bytes()


def test_where_it_rests_under_currents_and_what_holds_it_there(tmp_path, capsys):
    flags = ["--results", str(tmp_path), "--quiet"]
    assert main(["linearise", str(INCA), "--currents-a", *["0"] * 8, *flags]) == 0
    found = json.loads((tmp_path / "linear.json").read_text())
    assert abs(found["at"][2] + 0.2093) < 1e-4, found["at"]
    held = [f"{value:.12f}" for value in found["currents_A"]]
    assert main(["linearise", str(INCA), "--currents-a", *held, *flags]) == 0
    again = json.loads((tmp_path / "linear.json").read_text())
    assert np.abs(np.array(again["at"]) - found["at"]).max() < 1e-6
    turned = ["--at", "0.05", "-0.02", "-0.1", "0.02", "-0.01", "0.03"]
    assert main(["linearise", str(INCA), *turned, *flags]) == 0
    found = json.loads((tmp_path / "linear.json").read_text())
    held = [f"{value:.12f}" for value in found["currents_A"]]
    assert main(["linearise", str(INCA), "--currents-a", *held, *flags]) == 0
    again = json.loads((tmp_path / "linear.json").read_text())
    assert np.abs(np.array(again["at"]) - found["at"]).max() < 1e-6, again["at"]
    assert main(["linearise", str(INCA), "--currents-a", "1", "1", *flags]) == 2
    assert "2 numbers for 8 motors" in capsys.readouterr().err
    assert main(["linearise", str(INCA), "--currents-a", "9", *["0"] * 7, *flags]) == 2
    assert "9 A in motor 1, limits 0 to 3 A" in capsys.readouterr().err


def test_a_pose_outside_the_frame(tmp_path, capsys):
    flags = ["--at", "300", "0", "0", "0", "0", "0", "--results", str(tmp_path)]
    assert main(["linearise", str(INCA), *flags]) == 2
    assert "outside the robot's frame" in capsys.readouterr().err
    free = SAMPLES / "homing" / "robot.toml"
    assert main(["linearise", str(free), "--results", str(tmp_path)]) == 2
    assert "has no [drive]" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda rows: [rows[0].replace("I1_A", "I1_mA"), *rows[1:]], "lacks I1_A, has I1_mA"),
        (lambda rows: [*rows[:3], rows[3].replace(",", ",,", 1)[:-8], *rows[4:]], "line 4"),
        (lambda rows: [*rows[:2], rows[1], *rows[2:]], "times must increase"),
    ],
)
def test_a_wrong_recording(tmp_path, capsys, change, words):
    assert simulate(tmp_path / "a.csv", "prbs", "--duration-s", "0.02") == 0
    rows = (tmp_path / "a.csv").read_text().splitlines()
    (tmp_path / "b.csv").write_text("\n".join(change(rows)))
    assert simulate(tmp_path / "c.csv", str(tmp_path / "b.csv")) == 2
    assert words in capsys.readouterr().err
