"""A camera whose recording has another name is not lost in silence."""

from pathlib import Path

from freeswing.vision.track_session import unmatched
from tests.vision.loops import small_cameras


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
