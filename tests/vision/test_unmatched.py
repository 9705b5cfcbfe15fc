"""A camera whose recording has another name is not lost in silence."""

from pathlib import Path

import numpy as np
import pytest

from freeswing.calib.camera.cameras_file import write_cameras
from freeswing.cdpr.files.documents import dump_toml
from freeswing.cdpr.files.robot_file import write_robot
from freeswing.cdpr.measured.target import write_target
from freeswing.main import main
from freeswing.vision.look.video import write_video
from freeswing.vision.track_session import unmatched
from tests.oracle.scenes.robots import declared_robot
from tests.vision.loops import TARGET, small_cameras, write_looped_session


class Filmed:
    """A run with two recordings, one of them misspelt."""

    def __init__(self, folder: Path) -> None:
        self.name, self.video = "swing-01", folder
        for name in ("cam0", "camm1"):
            (folder / f"{name}.mkv").write_bytes(b"")


def test_both_names_are_said(tmp_path: Path) -> None:
    said = unmatched(Filmed(tmp_path), small_cameras(2))
    assert said == [
        "camm1: its recording is not used, cameras.toml knows no camera of that name",
        "cam1: has no recording in this run",
    ]


def test_nothing_is_said_where_all_is_well(tmp_path: Path) -> None:
    run = Filmed(tmp_path)
    (tmp_path / "camm1.mkv").rename(tmp_path / "cam1.mkv")
    assert unmatched(run, small_cameras(2)) == []


@pytest.mark.slow
def test_commands_say_which_camera_is_lost(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    session = write_looped_session(tmp_path / "session", small_cameras(2), 50)
    films = session / "runs" / "long"
    (films / "cam1.mkv").rename(films / "camm1.mkv")
    assert main(["check", str(session)]) == 0
    said = capsys.readouterr().out
    assert "run long: camera cam1 has no recording" in said
    assert "run long: camera camm1 is not in cameras.toml; its recording is not used" in said
    assert main(["track", str(session), "--workers", "1"]) == 0
    said = capsys.readouterr().out
    assert "camm1: its recording is not used, cameras.toml knows no camera of that name" in said
    assert "cam1: has no recording in this run" in said
    assert main(["report", str(session)]) == 0
    page = (session / "results" / "report.html").read_text(encoding="utf-8")
    assert "camm1: its recording is not used" in page


def test_no_camera_left_is_refused_with_both_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every recording misspelt: nothing to track, and nothing is rendered for it."""
    frames = np.zeros((5, 160, 200), dtype=np.uint8)
    write_video(tmp_path / "runs" / "a" / "kam0.mkv", iter(frames), np.arange(5) / 50.0)
    write_cameras(tmp_path / "cameras.toml", small_cameras(1))
    write_target(tmp_path / "target.toml", TARGET)
    write_robot(tmp_path / "robot.toml", declared_robot("bologna-4"))
    told = {"format": "freeswing-session/1", "name": "a", "robot": "robot.toml"}
    told |= {"target": "target.toml", "cameras": "cameras.toml", "frame_rate_hz": 50.0}
    told["runs"] = [{"name": "a", "role": "identify", "video": "runs/a"}]  # pyright: ignore[reportArgumentType]
    dump_toml(tmp_path / "session.toml", told)
    assert main(["track", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert "recordings of kam0, but cameras.toml knows cam0" in said
    assert "name the files as the cameras are named" in said
