"""session.toml: what it gives, and that every error is found at once and named."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from freeswing.cdpr.files.documents import InputError
from freeswing.session.session_file import read_session

WHOLE = """
format = "freeswing-session/1"
name = "lab-day-1"
robot = "robot.toml"
target = "target.toml"
cameras = "cameras.toml"
frame_rate_hz = 100.0

[calibration]
recordings = "calibration"
board.kind = "charuco"
board.squares = [9, 6]
board.square_m = 0.04
board.marker_m = 0.03
board.dictionary = "DICT_5X5_100"
[[calibration.base_tags]]
family = "tag36h11"
id = 100
corners_base_m = [[0,0,0],[0.1,0,0],[0.1,-0.1,0],[0,-0.1,0]]

[[runs]]
name = "swing-01"
role = "identify"
cable_lengths_m = [1.66, 1.86, 1.68, 1.41]
cable_lengths_std_m = 0.0005
window_s = [8.0, 18.0]
video = "runs/swing-01"

[[runs]]
name = "check-01"
role = "validate"
trajectory = "runs/check-01.csv"
payload = { mass_kg = 1.0, position_m = [0.0, 0.1, 0.05] }
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "session.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_every_key_is_read(tmp_path: Path) -> None:
    session = read_session(written(tmp_path, WHOLE))
    swing, check = session.runs
    assert session.name == "lab-day-1"
    assert session.cameras == tmp_path / "cameras.toml"
    assert session.results == tmp_path / "results"
    assert session.frame_rate_hz == 100.0
    assert session.calibration is not None
    assert session.calibration.board is not None
    assert session.calibration.board["squares"] == (9, 6)
    assert session.calibration.base_tags[0].corners_base_m.shape == (4, 3)
    assert swing.video == tmp_path / "runs" / "swing-01"
    assert swing.cable_lengths_m is not None
    np.testing.assert_array_equal(swing.cable_lengths_m, [1.66, 1.86, 1.68, 1.41])
    assert (swing.window_s, swing.cable_lengths_std_m) == ((8.0, 18.0), 0.0005)
    assert len(check.payloads) == 1
    assert (check.role, check.payloads[0].mass_kg) == ("validate", 1.0)
    assert session.video_runs == (swing,)


def test_folder_and_file_give_the_same(tmp_path: Path) -> None:
    path = written(tmp_path, WHOLE)
    assert read_session(tmp_path).path == read_session(path).path


def test_results_elsewhere_take_the_cameras_too(tmp_path: Path) -> None:
    written(tmp_path, WHOLE)
    session = read_session(tmp_path, tmp_path / "out")
    assert session.results == tmp_path / "out"
    assert session.cameras == tmp_path / "out" / "cameras.toml"


def test_cameras_of_the_session_are_used_when_there_are_no_others(tmp_path: Path) -> None:
    written(tmp_path, WHOLE)
    (tmp_path / "cameras.toml").write_text("", encoding="utf-8")
    assert read_session(tmp_path, tmp_path / "out").cameras == tmp_path / "cameras.toml"


def test_all_errors_are_named_at_once(tmp_path: Path) -> None:
    text = """
format = "freeswing-session/1"
robot = "../robot.toml"
frame_rate_hz = -1
colour = "red"
[calibration]
board = { kind = "chessboard", squares = [9.5, 6], square_m = 0 }
[[calibration.base_tags]]
family = "tag36h11"
id = -1
corners_base_m = [[0,0,0],[0.1,0,0],[0,-0.1,0],[0.1,-0.1,0]]
[[runs]]
name = "a/b"
role = "train"
window_s = [8.0, 8.0]
cable_lengths_m = [1.0, -1.0]
video = "v"
trajectory = "t.csv"
payload = { mass_kg = 0, position_m = [0, 0] }
[[runs]]
name = "A"
role = "identify"
trajectory = "t.txt"
[[runs]]
name = "a"
role = "identify"
"""
    with pytest.raises(InputError) as caught:
        read_session(written(tmp_path, text))
    message = str(caught.value)
    for key in (
        "name: missing",
        "robot: ",
        "frame_rate_hz: -1",
        "colour: unknown key",
        "calibration.board.squares",
        "calibration.board.square_m",
        "calibration.recordings, board",
        "calibration.base_tags[1].id",
        "calibration.base_tags[1].corners_base_m: its sides",
        "runs[1].name",
        "runs[1].role",
        "runs[1].window_s",
        "runs[1].cable_lengths_m",
        "runs[1].video, trajectory: give one",
        "runs[1].payload.mass_kg",
        "runs[1].payload.position_m",
        "runs[2].trajectory: '.txt'",
        "runs[3].name: 'a' is already runs[2]'s",
        "runs[3].video, trajectory: give one",
    ):
        assert key in message, message


@pytest.mark.parametrize(
    "place", ["/etc/passwd", "../x", "a/../../x", "C:\\x", "\\\\host\\x", "loop/x"]
)
def test_paths_may_not_leave_the_folder(tmp_path: Path, place: str) -> None:
    folder = tmp_path / "session"
    folder.mkdir()
    (folder / "loop").symlink_to(tmp_path)
    text = WHOLE.replace('"runs/check-01.csv"', f"'{place}.csv'")
    with pytest.raises(InputError, match=r"runs\[2\]\.trajectory"):
        read_session(written(folder, text))


@pytest.mark.parametrize(("length", "refused"), [(199.0, False), (201.0, True)])
def test_lengths_in_millimetres_are_named(tmp_path: Path, length: float, refused: bool) -> None:
    run = f'name = "a"\nrole = "identify"\ntrajectory = "a.csv"\ncable_lengths_m = [1.5, {length}]'
    text = f'format = "freeswing-session/1"\nname = "s"\nrobot = "r.toml"\n[[runs]]\n{run}\n'
    path = written(tmp_path, text)
    with pytest.raises(InputError, match="like mm or cm") if refused else contextlib.nullcontext():
        read_session(path)


def test_a_newer_format_and_no_file_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="update freeswing"):
        read_session(written(tmp_path, WHOLE.replace("session/1", "session/2")))
    with pytest.raises(InputError, match="no such file"):
        read_session(tmp_path / "nothing")


@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.lists(st.integers(0, len(WHOLE) - 1), min_size=1, max_size=6),
    st.sampled_from(["", "\0", "nan", "inf", "[", "9" * 400, "-1", '"', "\n[[runs]]\n", "{}", "é"]),
)
def test_broken_files_give_only_input_errors(tmp_path: Path, places: list[int], piece: str) -> None:
    text = WHOLE
    for place in places:
        text = text[:place] + piece + text[place + 3 :]
    path = written(tmp_path, text)
    with contextlib.suppress(InputError):
        read_session(path)
