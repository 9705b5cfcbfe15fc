"""Boards that were found are found once: a calibration that was killed goes on where it was."""

from __future__ import annotations

import dataclasses
import json
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from freeswing.calib.board import kept_boards
from freeswing.calib.board.board_corners import BoardCorners, BoardDetector
from freeswing.calib.board.declared_board import board_from
from freeswing.calib.board.kept_boards import FRAMES_A_PIECE, MOST_PIECE_BYTES
from freeswing.calib.board.recordings import find_recordings
from freeswing.calib.board.sightings import Sightings, see_boards
from freeswing.vision.look.video import write_video
from tests.calib.films import BOARD, patch
from tests.places import SAMPLES

FRAMES = 2 * FRAMES_A_PIECE + 7
SEE = """
import sys
from freeswing.calib.board.declared_board import board_from
from freeswing.calib.board.recordings import find_recordings
from freeswing.calib.board.sightings import see_boards
from pathlib import Path
from tests.calib.films import BOARD
see_boards(find_recordings(sys.argv[1]), board_from(BOARD), 40.0, 3, None, Path(sys.argv[2]))
"""


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small board, white on black, that moves a little and is gone now and then."""
    image = np.pad(40.0 + 180.0 * patch().cells[1::2, 1::2], 12, constant_values=220.0)
    for axis in (0, 1):
        image = 0.25 * (np.roll(image, 1, axis) + 2.0 * image + np.roll(image, -1, axis))
    image = 255 - image.astype(np.uint8)
    frames = [np.roll(image, k % 5, axis=k % 2) if k % 9 else 0 * image for k in range(FRAMES)]
    folder = tmp_path_factory.mktemp("film")
    write_video(folder / "cam0.mkv", frames, np.arange(FRAMES) / 40.0)
    return folder


def seen(film: Path, kept: Path | None) -> Sightings:
    return see_boards(find_recordings(film), board_from(BOARD), 40.0, 3, None, kept)[0]


def same(first: Sightings, second: Sightings) -> None:
    for entry in dataclasses.fields(Sightings):
        one, other = getattr(first, entry.name), getattr(second, entry.name)
        np.testing.assert_array_equal(one, other, err_msg=entry.name)


def test_a_killed_search_goes_on(film: Path, tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", SEE, str(film), str(tmp_path)]) as process:
        while not list(tmp_path.glob("*.npz")) and process.poll() is None:
            time.sleep(0.002)
        process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL, "it ended by itself"
    pieces = sorted(tmp_path.glob("*.npz"))
    assert 1 <= len(pieces) < 3
    written = {path: path.stat().st_mtime_ns for path in pieces}
    found = seen(film, tmp_path)
    same(found, seen(film, None))
    assert 80 < len(found.numbers) < FRAMES
    assert {path: path.stat().st_mtime_ns for path in pieces} == written
    assert len(list(tmp_path.iterdir())) == 3


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """A quick detector of made-up corners; grows by one with each frame that it looks at."""
    looks: list[int] = []

    def detect(self: BoardDetector, image: np.ndarray) -> BoardCorners | None:
        looks.append(1)
        if image.max() == 0:
            return None
        self.is_negative = True
        blank, told = self.nothing(), float(image[::40, ::40].sum())
        return BoardCorners(np.full_like(blank.pixels, told), blank.covariance_px2)

    monkeypatch.setattr(kept_boards.BoardDetector, "detect", detect)
    return looks


@pytest.fixture
def kept(film: Path, tmp_path: Path, counted: list[int]) -> Path:
    """The three pieces of the film."""
    seen(film, tmp_path / "kept")
    assert len(counted) == FRAMES
    counted.clear()
    return tmp_path / "kept"


def spoilt(path: Path, how: str) -> None:
    with np.load(path) as data:
        members = dict(data)
    if how == "cut short":
        path.write_bytes(path.read_bytes()[:-40])
        return
    if how == "packed":
        np.savez_compressed(path, **members)
        return
    if how == "overlarge":
        members["more"] = np.zeros(MOST_PIECE_BYTES + 1, dtype=np.uint8)
    if how == "missing":
        del members["state"]
    if how == "other state":
        members["state"] = np.array([0, 7])
    if how == "other count":
        members["seen"] = members["seen"][1:]
    if how == "other board":
        members["pixels"] = members["pixels"][:, 1:]
    if how == "infinite":
        members["pixels"] = members["pixels"] + np.inf
    np.savez(path, **members)


@pytest.mark.parametrize(
    "how",
    [
        "cut short", "packed", "overlarge", "missing", "other state", "other count",
        "other board", "infinite",
    ],
)  # fmt: skip
def test_a_piece_that_is_none_is_made_again(
    film: Path, kept: Path, counted: list[int], how: str
) -> None:
    middle = sorted(kept.iterdir())[1]
    good = middle.read_bytes()
    spoilt(middle, how)
    again = seen(film, kept)
    assert len(counted) == FRAMES_A_PIECE
    assert middle.read_bytes() == good
    same(again, seen(film, None))


def test_another_recording_or_board_is_looked_at_anew(
    film: Path, kept: Path, tmp_path: Path, counted: list[int]
) -> None:
    other = shutil.copytree(film, tmp_path / "film")  # with its time: the same recording
    seen(other, kept)
    assert counted == []
    (other / "cam0.mkv").touch()
    seen(other, kept)
    assert len(counted) == FRAMES
    counted.clear()
    see_boards(find_recordings(film), board_from({**BOARD, "square_m": 0.13}), 40.0, 0, None, kept)
    assert len(counted) == FRAMES


@pytest.mark.slow
def test_calibrate_after_kill_9_gives_the_same_bytes(tmp_path: Path) -> None:
    session = shutil.copytree(SAMPLES / "filmed", tmp_path / "filmed")

    def words(results: str) -> list[str]:
        start = [sys.executable, "-m", "freeswing", "calibrate", str(session), "--quiet"]
        return [*start, "--results", str(tmp_path / results)]

    with subprocess.Popen(words("killed")) as process:
        while not list(tmp_path.glob("killed/.boards/*.npz")) and process.poll() is None:
            time.sleep(0.002)
        process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    assert not (tmp_path / "killed" / "calibration.json").exists()
    for results in ("killed", "whole"):
        subprocess.run(words(results), check=True)
    for name in ("calibration.json", "cameras.toml"):
        assert (tmp_path / "killed" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    assert json.loads((tmp_path / "whole" / "calibration.json").read_bytes())["verdict"]["usable"]
