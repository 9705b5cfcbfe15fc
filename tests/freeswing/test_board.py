"""Printed boards and tags have their true size: the files decoded, the pattern found, measured."""

from __future__ import annotations

import struct
import xml.etree.ElementTree as ET
from pathlib import Path

import cv2
import numpy as np
import pytest

from freeswing.calib.tags.tag_patterns import tag_dictionary
from freeswing.main import main
from tests.places import SAMPLES

ROBOT = SAMPLES / "three-cables" / "robot.toml"
CHARUCO = """board.kind = "charuco"
board.squares = [5, 4]
board.square_m = 0.0373
board.marker_m = 0.028
board.dictionary = "DICT_5X5_100"
"""
CHESSBOARD = """board.kind = "chessboard"
board.squares = [8, 5]
board.square_m = 0.0301
"""
APRILGRID = """board.kind = "aprilgrid"
board.tagCols = 3
board.tagRows = 2
board.tagSize = 0.055
board.tagSpacing = 0.3
"""
SESSION = """format = "freeswing-session/1"
name = "print"
robot = "robot.toml"
[calibration]
recordings = "calibration"
{board}[[calibration.base_tags]]
family = "tag36h11"
id = 100
corners_base_m = [[0,0,0],[0.123,0,0],[0.123,-0.123,0],[0,-0.123,0]]
[[runs]]
name = "a"
role = "identify"
video = "a"
"""
MOST_OFF_MM = 0.02


def printed(folder: Path, board: str, *more: str) -> Path:
    (folder / "robot.toml").write_bytes(ROBOT.read_bytes())
    (folder / "session.toml").write_text(SESSION.format(board=board), encoding="utf-8")
    assert main(["board", str(folder), "--quiet", *more]) == 0
    return folder / "results" / "print"


def picture_mm(path: Path) -> tuple[np.ndarray, float]:
    """A PNG's pixels and, from its pHYs chunk, how many of them are a millimetre."""
    data = path.read_bytes()
    place = data.index(b"pHYs") + 4
    across, down, unit = struct.unpack(">IIB", data[place : place + 9])
    assert (across, unit) == (down, 1), (across, down, unit)
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert image is not None
    return image, across / 1000.0


def charuco_squares_mm(image: np.ndarray, pixels_a_mm: float) -> np.ndarray:
    """Spacings of neighbouring corners of the 5 x 4 board."""
    board = cv2.aruco.CharucoBoard((5, 4), 0.0373, 0.028, tag_dictionary("DICT_5X5_100"))
    corners, ids, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(image)
    assert ids is not None
    assert len(ids) == 12, f"{len(ids)} of 12 corners"
    grid = np.reshape(corners, (3, 4, 2))[np.argsort(np.ravel(ids)[::4])] / pixels_a_mm
    along = np.linalg.norm(np.diff(grid, axis=1), axis=2)
    down = np.linalg.norm(np.diff(grid, axis=0), axis=2)
    return np.concatenate([along.ravel(), down.ravel()])


def tags_mm(image: np.ndarray, pixels_a_mm: float, border_cells: int = 1) -> np.ndarray:
    """Corners of all tags of tag36h11 that are found, (n, 4, 2)."""
    settings = cv2.aruco.DetectorParameters()
    settings.markerBorderBits = border_cells
    detector = cv2.aruco.ArucoDetector(tag_dictionary("tag36h11"), settings)
    found, ids, _ = detector.detectMarkers(image)
    return np.reshape(found, (-1, 4, 2))[np.argsort(np.ravel(ids))] / pixels_a_mm


@pytest.mark.parametrize("dpi", ["300", "601"])
def test_png_has_its_size(tmp_path: Path, dpi: str) -> None:
    folder = printed(tmp_path, CHARUCO, "--format", "png", "--dpi", dpi)
    image, pixels_a_mm = picture_mm(folder / "board.png")
    assert 0.8 < 25.4 * pixels_a_mm / float(dpi) < 1.25, f"{25.4 * pixels_a_mm} dots per inch"
    spacings = charuco_squares_mm(image, pixels_a_mm)
    off = np.abs(spacings - 37.3).max()
    assert off < MOST_OFF_MM, f"squares of {spacings} mm"
    image, pixels_a_mm = picture_mm(folder / "tag36h11-100.png")
    corners = tags_mm(image, pixels_a_mm)
    assert corners.shape == (1, 4, 2), corners.shape
    sides = np.linalg.norm(corners[0] - np.roll(corners[0], 1, axis=0), axis=1)
    pixel_mm = 1.0 / pixels_a_mm  # corners of black are found inside their outermost pixels
    assert np.abs(sides - 123.0).max() < 1.5 * pixel_mm, sides


def rendered(path: Path, pixels_a_mm: float) -> np.ndarray:
    """A PDF's only page as an independent reader draws it."""
    pdfium = pytest.importorskip("pypdfium2", reason="pypdfium2 draws the PDF to be measured")
    document = pdfium.PdfDocument(str(path))
    try:
        assert len(document) == 1
        scale = 25.4 * pixels_a_mm / 72.0
        return document[0].render(scale=scale, grayscale=True).to_numpy().copy()
    finally:
        document.close()


def test_pdf_has_its_size(tmp_path: Path) -> None:
    folder = printed(tmp_path, CHARUCO)
    data = (folder / "board.pdf").read_bytes()
    assert b"/Subtype /Image" not in data, "a picture, not a drawing"
    pixels_a_mm = 12.0
    image = rendered(folder / "board.pdf", pixels_a_mm)
    width_mm = image.shape[1] / pixels_a_mm
    assert abs(width_mm - 37.3 * 6) < 1.0 / pixels_a_mm, f"{width_mm} mm wide"
    spacings = charuco_squares_mm(image, pixels_a_mm)
    assert np.abs(spacings - 37.3).max() < MOST_OFF_MM, f"squares of {spacings} mm"


def test_a_chessboard_has_its_size(tmp_path: Path) -> None:
    image = rendered(printed(tmp_path, CHESSBOARD) / "board.pdf", 4.0)
    found, corners = cv2.findChessboardCornersSB(cv2.GaussianBlur(image, (0, 0), 1.0), (8, 5))
    assert found
    grid = np.reshape(corners, (5, 8, 2)) / 4.0
    spacings = np.linalg.norm(np.diff(grid, axis=1), axis=2)
    assert np.abs(spacings - 30.1).max() < MOST_OFF_MM, f"squares of {spacings} mm"


def test_an_aprilgrid_has_its_size(tmp_path: Path) -> None:
    image = rendered(printed(tmp_path, APRILGRID) / "board.pdf", 10.0)
    centres = tags_mm(image, 10.0, border_cells=2).mean(axis=1)
    assert centres.shape == (6, 2), centres.shape
    steps = np.linalg.norm(np.diff(np.reshape(centres, (2, 3, 2)), axis=1), axis=2)
    pitch_mm = 55.0 * (1.0 + 0.3)
    assert np.abs(steps - pitch_mm).max() < 0.1, f"tags {steps} mm apart"


def test_svg_has_its_size(tmp_path: Path) -> None:
    folder = printed(tmp_path, CHARUCO, "--format", "svg")
    sheet = ET.parse(folder / "board.svg").getroot()
    width_mm = float(str(sheet.get("width")).removesuffix("mm"))
    assert width_mm == pytest.approx(37.3 * (5 + 1), abs=1e-6)
    assert [path.name for path in sorted(folder.iterdir())] == ["board.svg", "tag36h11-100.svg"]


def test_the_same_board_gives_the_same_files(tmp_path: Path) -> None:
    kinds = ("--format", "pdf", "--format", "png", "--format", "svg")
    files = [
        {path.name: path.read_bytes() for path in printed(tmp_path, CHARUCO, *kinds).iterdir()}
        for _ in range(2)
    ]
    assert len(files[0]) == 6
    assert files[0] == files[1]


def test_a_wrong_resolution_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    printed(tmp_path, CHARUCO)
    assert main(["board", str(tmp_path), "--dpi", "0"]) == 2
    assert "--dpi 0 must lie in 10 to 4800" in capsys.readouterr().err


def test_pages_of_paper_hold_all_with_a_ruler(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pdfium = pytest.importorskip("pypdfium2")
    folder = printed(tmp_path, CHARUCO, "--paper", "a3")
    book = pdfium.PdfDocument(folder / "a3.pdf")
    sizes = {tuple(sorted(round(25.4 / 72.0 * side) for side in page.get_size())) for page in book}
    assert sizes == {(297, 420)}
    texts = [page.get_textpage().get_text_range() for page in book]
    assert all("this ruler must be 100.0 mm long" in text for text in texts)
    assert "tag36h11 100" in texts[1]
    assert main(["board", str(tmp_path), "--paper", "a4", "--quiet"]) == 2
    assert "take larger paper" in capsys.readouterr().err
