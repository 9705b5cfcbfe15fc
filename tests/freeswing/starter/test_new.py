"""A stranger's walk: from recordings and an empty folder to a report."""

from __future__ import annotations

import contextlib
import json
import os
import re
import subprocess
import sys
import threading
from pathlib import Path

import cv2
import numpy as np
import pytest

from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.files.trajectory_files import read_recording, write_trc
from freeswing.cdpr.measured.marker_recording import MarkerRecording
from freeswing.cdpr.measured.target import read_target
from freeswing.main import main
from freeswing.session.session_file import read_session
from freeswing.starter.kinds import KINDS
from tests.places import ROOT, SAMPLES

SAMPLE = SAMPLES / "mocap-trc"
RECORDINGS = sorted((SAMPLE / "runs").glob("*.trc"))
MOST_COMMANDS = 6


def begin(folder: Path) -> None:
    files = [str(path) for path in RECORDINGS]
    assert main(["new", str(folder), "--mass-kg", "8", "--mocap", *files]) == 0


def turn_to_new_frame(folder: Path) -> np.ndarray:
    """Rotation from the sample's platform frame to the new one, by two of its markers' arms."""
    bases = []
    for path in (SAMPLE / "target.toml", folder / "target.toml"):
        place = {m.name: m.position_m for m in read_target(path).markers}
        arm, other = (place[name] - place["P"] for name in ("left", "front"))
        x = arm / np.linalg.norm(arm)
        z = np.cross(arm, other) / np.linalg.norm(np.cross(arm, other))
        bases.append(np.stack([x, np.cross(z, x), z], axis=1))
    return bases[1] @ bases[0].T


def measure(folder: Path) -> None:
    """What a person measures goes where robot.toml says nan."""
    turn = turn_to_new_frame(folder)
    text = (folder / "robot.toml").read_text(encoding="utf-8")
    head, *tables = text.split("[[cables]]")
    filled = [head]
    for table, cable in zip(tables, read_robot(SAMPLE / "robot.toml").cables, strict=True):
        vectors = {
            "entry_m": cable.entry_m,
            "attachment_m": turn @ cable.attachment_m,
            "swivel_x": cable.swivel_x,
            "swivel_y": cable.swivel_y,
            "swivel_z": cable.swivel_z,
        }
        for key, value in vectors.items():
            table = re.sub(rf"(?m)^{key} = \[.*?\]", f"{key} = {value.tolist()}", table)
        filled.append(
            table.replace("pulley_radius_m = nan", f"pulley_radius_m = {cable.pulley_radius_m}")
        )
    (folder / "robot.toml").write_text("[[cables]]".join(filled), encoding="utf-8")


def test_recordings_are_read_and_missing_numbers_are_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "lab-day"
    begin(folder)
    told = capsys.readouterr().out
    assert f"{len(RECORDINGS)} recordings of P, left, front, right at 100 Hz" in told, told
    # 0.1 mm of noise a marker and coordinate, less what four markers' fitted pose takes up.
    assert re.search(r"keep their distances to 0\.0[5-9] mm", told), told
    assert main(["check", str(folder)]) == 1, "nothing runs before the nan are gone"
    assert "cables[1].entry_m[0]: nan is not a finite number" in capsys.readouterr().out
    measure(folder)
    assert main(["check", str(folder)]) == 0, capsys.readouterr().err
    session = (folder / "session.toml").read_text(encoding="utf-8")
    assert session.count('role = "validate"') == len(RECORDINGS) // 3
    assert (folder / "runs" / RECORDINGS[0].name).read_bytes() == RECORDINGS[0].read_bytes()


def test_the_markers_keep_their_distances(tmp_path: Path) -> None:
    """The sample's noise is 0.1 mm a marker and sample: the mean of hundreds is far sharper."""
    folder = tmp_path / "lab-day"
    begin(folder)
    sides = []
    for path in (SAMPLE / "target.toml", folder / "target.toml"):
        place = {m.name: m.position_m for m in read_target(path).markers}
        names = ("P", "left", "front", "right")
        sides.append([np.linalg.norm(place[a] - place[b]) for a in names for b in names])
    np.testing.assert_allclose(sides[1], sides[0], atol=1e-3)


def one_long_recording(path: Path) -> tuple[float, float]:
    """Two swings of the sample with a hand in between; gives its first and last moment."""
    first, second = (read_recording(file) for file in RECORDINGS[-2:])
    second = second.select(first.names)
    step, hand_s = first.step_s, 3.0
    share = np.linspace(0.0, 1.0, round(hand_s / step))[1:-1, None, None]
    jerk = 0.02 * np.sin(2.0 * np.pi * 3.7 * share * hand_s) * np.sin(np.pi * share)
    start = first.positions_m[np.isfinite(first.positions_m).all(axis=(1, 2))][-1]
    end = second.positions_m[np.isfinite(second.positions_m).all(axis=(1, 2))][0]
    carried = start + (end - start) * share**2 * (3.0 - 2.0 * share) + jerk
    places = np.concatenate([first.positions_m, carried, second.positions_m])
    times = step * np.arange(len(places))
    write_trc(path, MarkerRecording(np.asarray(times, np.float64), first.names, places))
    return step * len(first.times_s), step * (len(first.times_s) + len(carried))


def test_one_long_recording_becomes_a_run_a_swing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    grip, release = one_long_recording(tmp_path / "all.trc")
    folder = tmp_path / "lab-day"
    assert main(["new", str(folder), "--mocap", str(tmp_path / "all.trc")]) == 0
    assert "2 free swings in them" in capsys.readouterr().out
    runs = read_session(folder).runs
    assert [run.name for run in runs] == ["all-01", "all-02"]
    (_, first_end), (second_start, _) = (run.window_s or (0.0, 0.0) for run in runs)
    assert first_end < grip + 0.3, "the hand is no part of the first swing"
    assert second_start > release - 0.3, "nor of the second"
    measure(folder)
    assert main(["check", str(folder)]) == 0, capsys.readouterr().err


def test_poses_need_no_target(tmp_path: Path) -> None:
    folder = tmp_path / "bar"
    files = [str(path) for path in sorted((SAMPLES / "two-cables" / "runs").glob("*.csv"))[:3]]
    assert main(["new", str(folder), "--kind", "bifilar", "--mocap", *files]) == 0
    assert not (folder / "target.toml").exists()
    session = read_session(folder)
    assert session.target is None
    assert session.frame_rate_hz == 100.0


@pytest.mark.parametrize("paper", ["a4", "letter", "a3"])
def test_the_print_is_what_the_files_say(paper: str, tmp_path: Path) -> None:
    """Tags 0 to 3 stand on the printed sheet where target.toml has them, in millimetres."""
    pdfium = pytest.importorskip("pypdfium2")
    folder = tmp_path / "lab-day"
    assert main(["new", str(folder), "--paper", paper]) == 0
    book = pdfium.PdfDocument(folder / "print.pdf")
    points_mm = 72.0 / 25.4
    pixels_mm = 4.0
    picture = np.asarray(book[0].render(scale=pixels_mm / points_mm, grayscale=True).to_pil())
    corners, ids, _ = cv2.aruco.ArucoDetector(
        cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    ).detectMarkers(picture)
    assert ids is not None
    seen = {
        int(k): c[0].mean(axis=0) / pixels_mm for k, c in zip(ids.ravel(), corners, strict=True)
    }
    middle = np.mean(list(seen.values()), axis=0)
    target = read_target(folder / "target.toml")
    for tag in target.tags:
        x, y = 1e3 * tag.centre_m[:2]
        np.testing.assert_allclose(seen[tag.id] - middle, [x, -y], atol=0.3)
    dark = np.flatnonzero((picture < 128)[-round(18 * pixels_mm) : -round(11 * pixels_mm)].any(0))
    assert (dark[-1] - dark[0]) / pixels_mm == pytest.approx(100.0, abs=0.6), "the test ruler"
    assert len(book) == 4


def read_all(end: int, told: bytearray) -> None:
    """Until the other end of a terminal is closed, which Linux reports as an error."""
    with contextlib.suppress(OSError):
        while part := os.read(end, 4096):
            told += part


def test_a_terminal_is_asked(tmp_path: Path) -> None:
    """A person types at a terminal; Enter takes what is usual."""
    pty = pytest.importorskip("pty")
    folder = tmp_path / "hall"
    main_end, terminal = pty.openpty()
    started = subprocess.Popen(
        [sys.executable, "-m", "freeswing", "new", str(folder)],
        cwd=ROOT,
        stdin=terminal,
        stdout=terminal,
        stderr=terminal,
    )
    # plate, three strings, wrong and right mass, cameras, their names, rate.
    os.write(main_end, b"2\n3\nheavy\n2,5\n1\nl, r\n50\n")
    os.close(terminal)
    told = bytearray()
    reader = threading.Thread(target=read_all, args=(main_end, told))
    reader.start()  # a terminal that nobody reads holds the program up
    assert started.wait(timeout=60) == 0, told
    reader.join(timeout=10)
    os.close(main_end)
    assert b"What hangs there" in told
    assert b"'heavy' is not a number above 0" in told
    robot = (folder / "robot.toml").read_text(encoding="utf-8")
    assert robot.count("[[cables]]") == 3
    assert "mass_kg = 2.5" in robot
    session = (folder / "session.toml").read_text(encoding="utf-8")
    assert "l.mp4, r.mp4" in session
    assert "frame_rate_hz = 50" in session


def test_what_was_measured_of_a_base_tag_gives_its_corners(tmp_path: Path) -> None:
    folder = tmp_path / "lab-day"
    assert main(["new", str(folder)]) == 0
    text = (folder / "session.toml").read_text(encoding="utf-8")
    text = text.replace("[nan, nan, nan]", "[1.2, 0.0, 0.1]")
    (folder / "session.toml").write_text(text, encoding="utf-8")
    calibration = read_session(folder).calibration
    assert calibration is not None
    first, second = (tag.corners_base_m for tag in calibration.base_tags)
    half = 0.08  # of 160 mm on A4
    expected = [[-half, 0, half], [half, 0, half], [half, 0, -half], [-half, 0, -half]]
    np.testing.assert_allclose(first, expected, atol=1e-12)
    np.testing.assert_allclose(second - first, [[1.2, 0.0, 0.1]] * 4, atol=1e-12)


def test_nothing_is_written_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "lab-day"
    assert main(["new", str(folder), "--kind", "trifilar"]) == 0
    before = (folder / "robot.toml").read_bytes()
    assert main(["new", str(folder), "--kind", "hook"]) == 2
    assert "already there" in capsys.readouterr().err
    assert (folder / "robot.toml").read_bytes() == before


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_every_kind_reads_once_it_is_measured(kind: str, tmp_path: Path) -> None:
    folder = tmp_path / kind
    assert main(["new", str(folder), "--kind", kind]) == 0
    text = (folder / "robot.toml").read_text(encoding="utf-8")
    vectors = iter(np.random.default_rng(0).uniform(0.1, 1.0, (40, 3)).round(3).tolist())
    axes = {"swivel_x": "[1, 0, 0]", "swivel_y": "[0, 1, 0]", "swivel_z": "[0, 0, 1]"}
    for key, value in axes.items():
        text = re.sub(rf"(?m)^{key} = \[.*?\]", f"{key} = {value}", text)
    text = re.sub(r"\[nan, nan, nan\]", lambda _: str(next(vectors)), text)
    (folder / "robot.toml").write_text(text.replace("= nan", "= 0.02"), encoding="utf-8")
    robot = read_robot(folder / "robot.toml")
    assert robot.n_cables == KINDS[kind].cables
    assert len(robot.free_coordinates or ()) in (0, 6 - robot.n_cables)


@pytest.mark.slow
def test_the_walk_ends_with_a_trustworthy_answer(tmp_path: Path) -> None:
    """new, (measure), check, run: three commands; com and inertia are the sample's truth."""
    folder = tmp_path / "lab-day"
    begin(folder)
    measure(folder)
    commands = [["check", str(folder)], ["run", str(folder), "--workers", "1"]]
    assert len(commands) + 1 <= MOST_COMMANDS
    for command in commands:
        assert main(command) == 0, command
    assert "What hangs there" in (folder / "results" / "report.html").read_text(encoding="utf-8")
    found = json.loads((folder / "results" / "identification.json").read_text(encoding="utf-8"))
    rows = {row["name"]: row for row in found["estimates"]["ml_full"]["parameters"]}
    com = np.array([rows[f"com_{axis}_m"]["value"] for axis in "xyz"])
    told = json.loads((SAMPLE / "truth" / "truth.json").read_text(encoding="utf-8"))["com_m"]
    # The sample leaves 0.02 mm of the centre of mass; the frame's turn is known to about 0.1 mrad.
    assert np.abs(turn_to_new_frame(folder).T @ com - told).max() < 3e-4, (com, told)


def test_one_phone_above_a_bench_begins_with_a_sheet_to_glue(tmp_path: Path, capsys) -> None:
    """Nothing to calibrate: with the numbers filled in the session can be read and tracked."""
    folder = tmp_path / "cube"
    begun = ["new", str(folder), "--kind", "trifilar", "--above", "--no-questions"]
    assert main(begun) == 0
    assert "base tags" not in capsys.readouterr().out
    assert (folder / "print.pdf").stat().st_size > 1000
    assert len(read_target(folder / "target.toml").tags) == 4
    path = folder / "session.toml"
    path.write_text(path.read_text(encoding="utf-8").replace("nan", "1.2"), encoding="utf-8")
    session = read_session(folder)
    assert session.planar
    assert [len(run.payloads) for run in session.runs].count(1) == 4
    sides = {float(run.payloads[0].position_m[0]) for run in session.runs if run.payloads}
    assert sides == {1.2, -1.2}
    assert main(["new", str(tmp_path / "other"), "--kind", "hook", "--above"]) == 2
    assert "trifilar, bifilar" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("header", "held"),
    [("t_s,chi_rad", "of chi at 50 Hz"), ("t_s,dot_px", "of dot_px at 50 Hz")],
)
def test_a_bench_of_yaw_or_a_signal_alone(tmp_path, capsys, header, held) -> None:
    """A session that only wants what was measured: lengths, masses, which run carried what."""
    for name in ("tare", "cube"):
        rows = [f"{k / 50.0},{np.sin(0.1 * k)}" for k in range(200)]
        (tmp_path / f"{name}.csv").write_text("\n".join([header, *rows, ""]))
    files = [str(tmp_path / "tare.csv"), str(tmp_path / "cube.csv")]
    folder = tmp_path / "wing"
    assert main(["new", str(folder), "--kind", "bifilar", "--mocap", *files]) == 0
    assert held in capsys.readouterr().out
    robot, session = folder / "robot.toml", folder / "session.toml"
    assert "target.toml" not in robot.read_text() + session.read_text()
    filled = session.read_text().replace("nan", "0.9").replace("# loads =", "loads =", 1)
    session.write_text(filled)
    read = read_session(folder)
    assert [run.name for run in read.runs] == ["cube", "tare"]
    assert read.runs[0].cable_lengths_m is not None
    assert [channel.column for channel in read.channels] == ["dot_px"] * ("dot_px" in header)


def test_recordings_of_a_bench_hold_the_same_columns(tmp_path, capsys) -> None:
    (tmp_path / "a.csv").write_text("t_s,chi_rad\n0,0\n0.1,1\n")
    (tmp_path / "b.csv").write_text("t_s,x_m\n0,0\n0.1,1\n")
    files = [str(tmp_path / "a.csv"), str(tmp_path / "b.csv")]
    assert main(["new", str(tmp_path / "c"), "--kind", "trifilar", "--mocap", *files]) != 0
    assert "it holds x, and" in capsys.readouterr().err


REFUSED = {
    "one-sample": ({"a": "t_s,chi_rad\n0,0\n"}, "a.csv: it holds one sample"),
    "mixture": (
        {"pose": "t_s,x_m,y_m,z_m,phi_rad,theta_rad,chi_rad\n0,0,0,0,0,0,0\n1,0,0,0,0,0,0\n"}
        | {"yaw": "t_s,chi_rad\n0,0\n1,0.1\n"},
        "yaw.csv: it holds chi, and",
    ),
    "mixture-of-kinds": (
        {"a": "t,x\n0,0\n1,0\n", "yaw": "t_s,chi_rad\n0,0\n1,0.1\n"},
        "a.csv: it is no table with a column t_s",
    ),
    "degrees": ({"a": "t_s,yaw_deg\n0,0\n1,5\n"}, "'yaw_deg': is it a part of the pose? Write"),
    "other-degrees": ({"a": "t_s,encoder_deg\n0,0\n1,5\n"}, "phi_rad, theta_rad or chi_rad"),
    "no-unit": ({"a": "t_s,x\n0,0\n1,5\n"}, "Write it as x_m"),
    "counter": (
        {"a": "t_s,dot_px,frame\n0,0,1\n1,5,2\n2,3,4\n"},
        "column 'frame' rises from each row to the next",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_no_bench_session_can_begin_from_is_named(tmp_path, capsys, case) -> None:
    tables, said = REFUSED[case]
    for name, text in tables.items():
        (tmp_path / f"{name}.csv").write_text(text)
    files = [str(tmp_path / f"{name}.csv") for name in tables]
    assert main(["new", str(tmp_path / "c"), "--kind", "bifilar", "--mocap", *files]) == 2
    error = capsys.readouterr().err
    assert said in error, error
    assert not (tmp_path / "c").exists()


def test_columns_are_said_and_quoted_and_their_order_is_nothing(tmp_path, capsys) -> None:
    """Quotes in names of columns and folder; rows of a dot that rises but for one are its swing."""
    (tmp_path / "a.csv").write_text('t_s,sp"ot,x_px\n0,0,1\n0.1,1,3\n0.2,2,2\n')
    (tmp_path / "b.csv").write_text('t_s,x_px,sp"ot\n0,0,1\n0.1,1,2\n0.2,1,2\n')
    files = [str(path) for path in tmp_path.glob("*.csv")]
    folder = tmp_path / 'of "two"'
    begun = ["new", str(folder), "--kind", "bifilar", "--mocap", *files]
    assert main(begun) == 2
    assert "'sp\"ot' rises" in capsys.readouterr().err
    (tmp_path / "a.csv").write_text('t_s,sp"ot,x_px\n0,0,1\n0.1,1,3\n0.2,1,2\n')
    assert main(begun) == 0
    told = capsys.readouterr().out
    assert "sp\"ot, x_px: taken for the motion's signals of unknown scale" in told, told
    session = folder / "session.toml"
    text = session.read_text(encoding="utf-8").replace("nan", "0.9")
    session.write_text(text.replace("# loads =", "loads =", 1), encoding="utf-8")
    read = read_session(folder)
    assert [one.column for one in read.channels] == ['sp"ot', "x_px"]
    assert [run.name for run in read.runs] == ["a", "b"]


@pytest.mark.parametrize(("kind", "said"), [("bifilar", True), ("cable-robot", False)])
def test_a_bench_by_cameras_is_told_the_easier_ways(tmp_path, capsys, kind, said) -> None:
    assert main(["new", str(tmp_path / "a"), "--kind", kind]) == 0
    assert ("--above" in capsys.readouterr().out) == said
