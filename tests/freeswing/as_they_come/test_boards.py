"""Boards that are not as session.toml states them, through `freeswing calibrate` and `board`."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import read_cameras
from freeswing.calib.tags.tag_patterns import tag_dictionary
from freeswing.calib.verdict.calibration_result import read_camera_covariance
from freeswing.cdpr.files.documents import dump_toml
from freeswing.main import main
from freeswing.vision.render.patterns import Patch, charuco_patch
from freeswing.vision.render.record import record
from freeswing.vision.render.render_scene import Look, Scene
from tests.calib import rigs
from tests.calib.films import FLIP, small_rig
from tests.places import SAMPLES

SQUARE_M, MARKER_M, DICTIONARY = 0.09, 0.0675, "DICT_4X4_50"
SQUARES = (7, 6)  # even rows: the layouts of OpenCV before and after 4.6 differ
BOARD = {
    "kind": "charuco",
    "squares": list(SQUARES),
    "square_m": SQUARE_M,
    "marker_m": MARKER_M,
    "dictionary": DICTIONARY,
}
SLOW = pytest.mark.slow


def film(folder: Path, patch: Patch, count: int) -> tuple[Camera, ...]:
    """Stills of a board in `count` poses by two cameras."""
    cameras = small_rig(2)
    poses = rigs.poses(cameras, count, 52, tilt=0.5) @ FLIP

    def motion(times_s):
        index = np.clip(np.round(times_s).astype(int), 0, count - 1)
        return poses[index, :3, 3], poses[index, :3, :3]

    stamps = np.arange(float(count))
    record(folder, cameras, Scene((patch,), motion), stamps, Look(), 3,
           images=True, stamps_file=False)  # fmt: skip
    return cameras


@pytest.fixture(scope="module")
def few(tmp_path_factory) -> Path:
    """A few stills: enough to see what is wrong."""
    folder = tmp_path_factory.mktemp("few")
    film(folder, charuco_patch(SQUARES, SQUARE_M, MARKER_M, DICTIONARY), 4)
    return folder


@pytest.fixture(scope="module")
def many(tmp_path_factory) -> tuple[Path, tuple[Camera, ...]]:
    """Stills for a calibration, and the true cameras."""
    folder = tmp_path_factory.mktemp("many")
    return folder, film(folder, charuco_patch(SQUARES, SQUARE_M, MARKER_M, DICTIONARY), 20)


def grey(path: Path) -> np.ndarray:
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    assert image is not None, path
    return np.asarray(image, np.uint8)


def session(
    folder: Path,
    stills: Path,
    image: Callable[[np.ndarray], np.ndarray] | None = None,
    **board: Any,
) -> Path:
    """A session of such stills, their pictures changed, and such a board."""
    folder.mkdir(exist_ok=True)
    for name in ("robot.toml", "target.toml"):
        shutil.copy(SAMPLES / "filmed" / name, folder)
    shutil.copytree(stills, folder / "calibration")
    if image is not None:
        for path in (folder / "calibration").rglob("*.png"):
            cv2.imwrite(str(path), image(grey(path)))
    document = {
        "format": "freeswing-session/1",
        "name": "board",
        "robot": "robot.toml",
        "target": "target.toml",
        "cameras": "cameras.toml",
        "calibration": {"recordings": "calibration", "board": {**BOARD, **board}},
        "runs": [{"name": "swing", "role": "identify", "video": "runs/swing"}],
    }
    dump_toml(folder / "session.toml", document)
    return folder


def check_cameras(folder: Path, true: tuple[Camera, ...]) -> None:
    """Lenses within their claimed deviations, cameras as far apart as they are."""
    found = read_cameras(folder / "cameras.toml")
    covariance = read_camera_covariance(folder / "results" / "calibration.json")
    for camera, one in zip(found, true, strict=True):
        std = np.sqrt(np.diag(covariance.lens(camera)))
        off = np.abs((camera.params - one.params)[:4] / std[:4])
        assert off.max() < 4.0, off
        assert std[:4].max() < 2.0, std
    apart, wanted = (
        np.linalg.norm(pair[0].position_base_m - pair[1].position_base_m) for pair in (found, true)
    )
    assert abs(apart / wanted - 1.0) < 2e-3, apart


def warnings(folder: Path) -> str:
    document = json.loads((folder / "results" / "calibration.json").read_text(encoding="utf-8"))
    return " ".join(document["verdict"]["warnings"])


def test_the_back_of_a_board_or_a_mirrored_picture_is_named(few, tmp_path, capsys) -> None:
    folder = session(tmp_path / "s", few, lambda image: np.ascontiguousarray(image[:, ::-1]))
    assert main(["calibrate", str(folder), "--quiet"]) == 1
    assert "shows the board's mirrored image" in capsys.readouterr().err


def test_columns_and_rows_exchanged_are_named(few, tmp_path, capsys) -> None:
    folder = session(tmp_path / "s", few, squares=list(SQUARES[::-1]))
    assert main(["calibrate", str(folder), "--quiet"]) == 1
    assert "columns and rows are exchanged, 7 x 6" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["target.toml", "robot.toml"])
def test_a_file_that_only_later_commands_need_is_named_already(few, tmp_path, capsys, name) -> None:
    """Whatever comes of the boards: whoever calibrates on Monday is not refused on Tuesday."""
    folder = session(tmp_path / "s", few)
    (folder / name).write_text("format = 3\n", encoding="utf-8")
    main(["calibrate", str(folder), "--quiet"])
    said = capsys.readouterr().err
    assert f"{folder / name}: " in said, said
    assert "cameras can be calibrated, track and identify will refuse" in said, said


def test_squares_in_millimetres_are_named(few, tmp_path, capsys) -> None:
    folder = session(tmp_path / "s", few, square_m=24, marker_m=18)
    assert main(["calibrate", str(folder), "--quiet"]) == 2
    assert "24 m: lengths are in metres, 0.024" in capsys.readouterr().err


@SLOW
def test_a_board_printed_white_on_black_is_simply_used(many, tmp_path) -> None:
    stills, true = many
    folder = session(tmp_path / "s", stills, lambda image: 255 - image)
    assert main(["calibrate", str(folder), "--quiet"]) == 0
    check_cameras(folder, true)


def legacy_patch() -> Patch:
    """The board as OpenCV itself draws it in its old layout, half a square of white around."""
    board = cv2.aruco.CharucoBoard(SQUARES, SQUARE_M, MARKER_M, tag_dictionary(DICTIONARY))
    board.setLegacyPattern(True)
    side = 48  # a marker of 36 and cells of 6
    drawn = board.generateImage((SQUARES[0] * side, SQUARES[1] * side), marginSize=0)
    sheet = np.asarray(drawn, np.float64) / 255.0
    whole = np.pad(sheet, side // 2, constant_values=1.0)
    return Patch(whole, (SQUARE_M * (SQUARES[0] + 1), SQUARE_M * (SQUARES[1] + 1)))


@SLOW
@pytest.mark.parametrize("stated", [False, True])
def test_a_board_of_the_old_layout_is_used_and_said(tmp_path, stated) -> None:
    true = film(tmp_path / "stills", legacy_patch(), 20)
    folder = session(
        tmp_path / "s", tmp_path / "stills", None, **({"legacy": True} if stated else {})
    )
    assert main(["calibrate", str(folder), "--quiet"]) == 0
    check_cameras(folder, true)
    assert ("legacy = true" in warnings(folder)) != stated, warnings(folder)


@pytest.mark.parametrize("legacy", [False, True])
def test_a_board_is_printed_in_the_layout_that_is_stated(few, tmp_path, legacy) -> None:
    """The first square of the old layout is a marker's where the count of rows is even."""
    folder = session(tmp_path / "s", few, legacy=legacy)
    assert main(["board", str(folder), "--quiet", "--format", "png", "--dpi", "100"]) == 0
    image = grey(folder / "results" / "print" / "board.png")
    found, ids, _ = cv2.aruco.ArucoDetector(tag_dictionary(DICTIONARY)).detectMarkers(image)
    assert len(ids) == SQUARES[0] * SQUARES[1] // 2
    first = found[int(np.argmin(np.ravel(ids)))][0].mean(axis=0)
    pixel_m = 25.4e-3 / 100.0
    column = (first[0] * pixel_m - SQUARE_M / 2.0) / SQUARE_M  # half a square of margin
    assert int(column) == (0 if legacy else 1), column


@SLOW
def test_markers_of_another_size_are_said_and_move_no_lens(many, tmp_path) -> None:
    """Whatever `marker_m` the search starts from, lenses end within a part of their deviations."""
    stills, true = many
    lenses, claimed = [], []
    for number, factor in enumerate((0.96, 1.0, 1.005)):
        folder = session(tmp_path / f"s{number}", stills, marker_m=MARKER_M * factor)
        assert main(["calibrate", str(folder), "--quiet"]) == 0
        check_cameras(folder, true)
        assert ("67.50 mm beside squares of 90.00" in warnings(folder)) == (factor < 0.99)
        covariance = read_camera_covariance(folder / "results" / "calibration.json")
        found = read_cameras(folder / "cameras.toml")
        lenses.append([camera.params[:4] for camera in found])
        claimed.append([np.sqrt(np.diag(covariance.lens(camera)))[:4] for camera in found])
    moved = np.ptp(np.array(lenses), axis=0) / np.min(claimed, axis=0)
    assert moved.max() < 0.5, moved


def stills_turned(folder: Path, turn: int, orientation: int) -> None:
    """Stills as JPEG, stored turned, the way back in their EXIF data."""
    from PIL import Image

    for path in sorted(folder.rglob("*.png")):
        stored = np.rot90(grey(path), turn)
        exif = Image.Exif()
        exif[0x0112] = orientation
        picture = Image.fromarray(np.ascontiguousarray(stored))
        picture.save(path.with_suffix(".jpg"), quality=98, exif=exif)
        path.unlink()


def videos_turned(folder: Path, turn: int, _: int) -> None:
    """The same stills as videos, stored turned, the way back in their container's data."""
    from tests.vision.footage.phones import write_phone_video

    for place in [path for path in folder.iterdir() if path.is_dir()]:
        paths = sorted(place.glob("*.png"))
        frames = [grey(path) for path in paths]
        write_phone_video(
            folder / f"{place.name}.mp4", frames, np.arange(len(frames)) / 29.97, 90 * turn,
        )  # fmt: skip
        shutil.rmtree(place)


@SLOW
@pytest.mark.parametrize(("turn", "orientation"), [(1, 6), (2, 3), (3, 8)])
@pytest.mark.parametrize("store", [stills_turned, videos_turned])
def test_turned_stills_and_videos_show_the_same_upright_camera(
    many, tmp_path, store, turn, orientation
) -> None:
    stills, true = many
    folder = session(tmp_path / "s", stills)
    store(folder / "calibration", turn, orientation)
    assert main(["calibrate", str(folder), "--quiet"]) == 0
    assert [camera.size_px for camera in read_cameras(folder / "cameras.toml")] == [(800, 640)] * 2
    check_cameras(folder, true)
