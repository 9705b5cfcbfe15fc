"""The texts of target.toml and session.toml for cameras, and the sheets that go with them.

Four tags on one sheet are the platform's frame, so that nothing of it has to be measured; a tag on
the wall, hung with a spirit level, is the base frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from freeswing.cdpr.files.toml_text import toml_string
from freeswing.printing.pages import PAPERS_MM, Page, Placed, label_of, page_room_mm
from freeswing.printing.sheet import Sheet

FAMILY = "tag36h11"
TAG_CELLS, RIM_CELLS = 8, 1  # black border and code; the white rim that a detector needs
BASE_IDS = (100, 101)
UPRIGHT = "[0.7071067811865476, 0.7071067811865476, 0.0, 0.0]"  # x right, y up along base z
# The largest that A4 takes: cells of its markers are 4.5 mm, three pixels at 2.3 m from a phone
# whose focal length is 1500 px.
SMALL_BOARD = ((6, 4), 0.036, 0.027)
LARGE_BOARD = ((9, 6), 0.038, 0.0285)
BOARD_DICTIONARY = "DICT_4X4_50"


@dataclass(frozen=True, slots=True)
class Filmed:
    """What a person chose for a session of cameras.

    Attributes:
        cameras: their names; recordings are called like them.
        rate_hz: frames a second.
        tag_m: side of the platform's tags, black border.
        paper: that everything is printed on.
    """

    cameras: tuple[str, ...]
    rate_hz: float
    tag_m: float
    paper: str

    @property
    def board(self) -> tuple[tuple[int, int], float, float]:
        """Squares across and down, their side and the markers' in metres."""
        return LARGE_BOARD if self.paper == "a3" else SMALL_BOARD

    @property
    def centre_m(self) -> float:
        """How far the tags' centres lie from the sheet's middle, along x and along y."""
        return 0.5 * self.tag_m * (TAG_CELLS + 2 * RIM_CELLS) / TAG_CELLS

    @property
    def base_tag_m(self) -> float:
        """Side of the base tags: as large as the paper takes, in whole centimetres."""
        room = min(page_room_mm(self.paper))
        return int(room * TAG_CELLS / (TAG_CELLS + 2 * RIM_CELLS) / 10.0) / 100.0

    @property
    def places(self) -> tuple[tuple[float, float], ...]:
        """Centres of tags 0 to 3 on the sheet, seen facing it: top left and right, then below."""
        at = self.centre_m
        return ((-at, at), (at, at), (-at, -at), (at, -at))


def largest_tag_m(paper: str) -> float:
    """The largest tag of which two stand side by side on a paper."""
    return 1e-3 * min(page_room_mm(paper)) / 2.0 * TAG_CELLS / (TAG_CELLS + 2 * RIM_CELLS)


def tag_target(filmed: Filmed) -> str:
    """target.toml of the printed sheet of four tags: complete as it stands."""
    lines = [
        'format = "freeswing-target/1"',
        "# Platform frame: the middle of the printed sheet (its cross) is P; x to the right of the",
        "# print, y up, z out of it. Glue it flat and stiff where all cameras see it. If the test",
        "# ruler is not 100.0 mm long, multiply every number here by its length over 100 mm.",
    ]
    for k, (x, y) in enumerate(filmed.places):
        lines += [
            "",
            "[[tags]]",
            f'family = "{FAMILY}"',
            f"id = {k}",
            f"size_m = {filmed.tag_m:g}",
            "q_platform_tag = [1.0, 0.0, 0.0, 0.0]",
            f"t_platform_tag_m = [{x:g}, {y:g}, 0.0]",
        ]
    return "\n".join([*lines, ""])


def opening_lines(name: str, rate_hz: float) -> list[str]:
    """How session.toml of any session with cameras begins."""
    return [
        'format = "freeswing-session/1"',
        f"name = {toml_string(name)}",
        'robot = "robot.toml"',
        'target = "target.toml"',
        f"frame_rate_hz = {rate_hz:g}",
    ]


def filmed_session(name: str, filmed: Filmed, runs: Sequence[tuple[str, str]]) -> str:
    """session.toml of cameras: recordings to be put where it says."""
    (columns, rows), square, marker = filmed.board
    files = ", ".join(f"{camera}.mp4" for camera in filmed.cameras)
    lines = [
        *opening_lines(name, filmed.rate_hz),
        "",
        "[calibration]      # film the printed board, held near and far and tilted every way",
        f'recordings = "calibration"       # {files} in that folder, all started together',
        f'board = {{ kind = "charuco", squares = [{columns}, {rows}], square_m = {square:g}, '
        f'marker_m = {marker:g}, dictionary = "{BOARD_DICTIONARY}" }}',
        "",
        f"# The base frame is tag {BASE_IDS[0]}: hang it upright by a spirit level behind the",
        "# platform, where all cameras see it. Origin at its centre, x to its right, z up, y into",
        "# the wall. Measure entry_m in robot.toml from there.",
        *_base_tag(BASE_IDS[0], filmed.base_tag_m, "[0.0, 0.0, 0.0]"),
        "",
        f"# Tag {BASE_IDS[1]} a metre or more away, upright too, ties the frame's direction down:",
        "# measure its centre in the base frame, or delete this table.",
        *_base_tag(BASE_IDS[1], filmed.base_tag_m, "[nan, nan, nan]"),
    ]
    for run, kind in runs:
        lines += ["", "[[runs]]", f"name = {toml_string(run)}", f'role = "{kind}"']
        lines.append(f'video = "runs/{run}"      # {files} in that folder')
        lines.append("# window_s = [2.0, 12.0]   # the free motion; absent: it is found")
    return "\n".join([*lines, ""])


def _base_tag(number: int, size_m: float, place: str) -> list[str]:
    return [
        "[[calibration.base_tags]]",
        f'family = "{FAMILY}"',
        f"id = {number}",
        f"size_m = {size_m:g}",
        f"centre_base_m = {place}",
        f"q_base_tag = {UPRIGHT}",
    ]


def pages(filmed: Filmed) -> list[Page]:
    """Everything to print: the platform's sheet, the base tags, the board."""
    from freeswing.vision.render.patterns import charuco_patch, tag_patch

    def tag(number: int, size_m: float) -> Sheet:
        patch = tag_patch(FAMILY, number, size_m)
        return Sheet(patch.cells, patch.size_m, f"{FAMILY} {number}")

    side = 1e3 * tag(0, filmed.tag_m).size_m[0]
    four = [
        Placed(tag(k, filmed.tag_m), side * (k % 2), side * (k // 2))
        for k in range(len(filmed.places))
    ]
    found = [
        Page(
            tuple(four),
            f"platform: tags 0 to 3, black border {1e3 * filmed.tag_m:g} mm; P is the cross",
            cross_mm=(side, side),
        )
    ]
    for number in BASE_IDS:
        told = f"base: tag {number}, black border {1e3 * filmed.base_tag_m:g} mm; hang it upright"
        found.append(Page((Placed(tag(number, filmed.base_tag_m), 0.0, 0.0),), told))
    squares, square, marker = filmed.board
    patch = charuco_patch(squares, square, marker, BOARD_DICTIONARY)
    told = label_of(squares, square, BOARD_DICTIONARY)
    found.append(Page((Placed(Sheet(patch.cells, patch.size_m, told), 0.0, 0.0),), told))
    return found


__all__ = ["PAPERS_MM", "Filmed", "filmed_session", "largest_tag_m", "pages", "tag_target"]
