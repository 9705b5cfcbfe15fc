"""session.toml: one recorded session, read with every error at once."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.scene.scene_keys import read_scene, read_surveyed
from freeswing.calib.scene.source import SceneSource
from freeswing.calib.scene.tape_measured import SurveyedPoint
from freeswing.cdpr.files.documents import InputError, Problems, Reader, inside, load_toml
from freeswing.cdpr.robot import LARGEST_FRAME_M, frozen_array
from freeswing.cdpr.system.confine import results_folder
from freeswing.ident.bench.channels import Channel
from freeswing.ident.bench.runs import KnownBody, Load, Placed
from freeswing.session.base_tag import BaseTag, read_base_tag
from freeswing.session.bench_keys import (
    check_loads,
    read_channels,
    read_loads,
    read_payloads,
    read_placed,
    read_planar,
)
from freeswing.session.mocap_keys import read_mocap_frame

Array = NDArray[np.float64]

ROLES = ("identify", "validate")
TRAJECTORY_SUFFIXES = (".csv", ".tsv", ".trc", ".c3d")
BOARD_KEYS = {
    "charuco": ("squares", "square_m", "marker_m", "dictionary"),
    "chessboard": ("squares", "square_m"),
    "aprilgrid": ("tagCols", "tagRows", "tagSize", "tagSpacing"),
    "circles": ("squares", "square_m", "diameter_m"),
    "asymmetric_circles": ("squares", "square_m", "diameter_m"),
}
OPTIONAL_BOARD_KEYS = {"charuco": ("legacy",), "aprilgrid": ("family",)}
MOST_RUNS = 10_000
_LONGEST_NAME = 100  # of a run: file names are longer nowhere than 255 bytes
PORTS = (f"{port}{number}" for port in ("com", "lpt") for number in range(10))
DEVICES = frozenset(("con", "prn", "aux", "nul", *PORTS))


@dataclass(frozen=True, slots=True)
class CalibrationSource:
    """What the cameras can be calibrated from.

    Attributes:
        recordings: folder with `<camera>.mkv` or `<camera>/*.png`, or None.
        board: the board's `kind` and its numbers as in the file, or None.
        base_tags: surveyed tags that tie the cameras to the base frame.
        surveyed: surveyed points that do, marked in `points.csv` beside the recordings.
        scene: images of the laboratory at rest, or None.
    """

    recordings: Path | None = None
    board: Mapping[str, object] | None = None
    base_tags: tuple[BaseTag, ...] = ()
    scene: SceneSource | None = None
    surveyed: tuple[SurveyedPoint, ...] = ()

    @property
    def plumb_line(self) -> Path | None:
        """`plumb_line.csv` beside the recordings, None where there is none."""
        return self._beside("plumb_line.csv")

    @property
    def points(self) -> Path | None:
        """`points.csv` beside the recordings, None where there is none."""
        return self._beside("points.csv")

    def _beside(self, name: str) -> Path | None:
        path = None if self.recordings is None else self.recordings / name
        return path if path is not None and path.is_file() else None


@dataclass(frozen=True, slots=True)
class Run:
    """One recorded swing: a video folder or a trajectory file, and what is known of it.

    Attributes:
        name: label, also the stem of its result files.
        role: `identify` or `validate`.
        video: folder with one recording a camera, or None.
        trajectory: measured trajectory or markers, or None.
        cable_lengths_m: lengths held by the locked actuators, (n,), or None.
        cable_lengths_std_m: their standard deviation, or None.
        window_s: start and end of the free motion, or None: found by the program.
        payloads: known masses on the platform.
        loads: objects to be measured, as they lie on it.
        level_std_rad: how well a level on the platform showed it to hang level, on two wires.
    """

    name: str
    role: str
    video: Path | None = None
    trajectory: Path | None = None
    cable_lengths_m: Array | None = None
    cable_lengths_std_m: float | None = None
    window_s: tuple[float, float] | None = None
    payloads: tuple[KnownBody, ...] = ()
    loads: tuple[Placed, ...] = ()
    level_std_rad: float | None = None

    def __post_init__(self) -> None:
        if self.cable_lengths_m is not None:
            lengths = np.asarray(self.cable_lengths_m, dtype=np.float64)
            lengths = frozen_array(lengths, lengths.shape, f"run {self.name}: cable_lengths_m")
            object.__setattr__(self, "cable_lengths_m", lengths)


@dataclass(frozen=True, slots=True)
class Session:
    """A session.toml whose paths are resolved; nothing they point to has been read yet.

    Attributes:
        path: the session.toml itself.
        name: label.
        robot: robot.toml.
        target: target.toml, or None.
        cameras: cameras.toml, which may not be there yet.
        frame_rate_hz: nominal rate of the recordings, or None.
        calibration: calibration recordings, or None.
        runs: the recorded swings.
        channels: uncalibrated signals that runs may hold.
        loads: objects to be measured.
        T_base_recorded: frame of measured trajectories, (4, 4), None: it is the base frame.
        results: folder that takes everything the commands write.
        planar: whether one camera from above filmed the runs (`track --planar`).
    """

    path: Path
    name: str
    robot: Path
    results: Path
    cameras: Path
    target: Path | None = None
    frame_rate_hz: float | None = None
    calibration: CalibrationSource | None = None
    runs: tuple[Run, ...] = field(default=())
    channels: tuple[Channel, ...] = ()
    loads: tuple[Load, ...] = ()
    T_base_recorded: Array | None = None
    planar: bool = False

    @property
    def folder(self) -> Path:
        """The folder that everything of the session is in."""
        return self.path.parent

    @property
    def video_runs(self) -> tuple[Run, ...]:
        """The runs that have to be tracked."""
        return tuple(run for run in self.runs if run.video is not None)

    @property
    def tracks(self) -> Path:
        """The folder of tracked trajectories."""
        return self.results / "tracks"


def read_session(path: Path | str, results: Path | str | None = None) -> Session:
    """Read a session's file; `path` is the folder or its session.toml.

    Args:
        path: the session.
        results: where results go instead of `results` in the session's folder (for sessions that
            are read-only). A `cameras.toml` found there goes before the session's own.

    Raises:
        InputError: naming every problem of the file: missing, unknown and repeated keys, wrong
            types and lengths, paths that leave the folder, repeated run names.
    """
    path = Path(path)
    path = path / "session.toml" if path.is_dir() else path
    problems = Problems()
    reader = Reader(load_toml(path, "session", problems), problems)
    paths = _Paths(path.parent)
    name = reader.string("name")
    robot = paths.required(reader, "robot")
    target = paths.optional(reader, "target")
    cameras = paths.optional(reader, "cameras") or inside(path.parent, "cameras.toml", "cameras")
    rate = reader.optional_number("frame_rate_hz", above=0.0, maximum=1e6)
    section = reader.child("calibration", required=False)
    calibration = None if section is None else _read_calibration(section, paths)
    tables = reader.children("runs")
    if len(tables) > MOST_RUNS:
        raise InputError(f"{path}: {len(tables)} runs, more than the {MOST_RUNS} read here")
    runs = tuple(_read_run(table, paths) for table in tables)
    _check_runs(reader, runs)
    channels, loads = read_channels(reader), read_loads(reader)
    frame = read_mocap_frame(reader.child("mocap", required=False))
    check_loads(reader, loads, [(run.name, run.loads) for run in runs])
    planar = read_planar(reader)
    reader.finish()
    problems.raise_if_any(path)
    folder = results_folder(path.parent, results)
    beside = folder / "cameras.toml"
    if results is not None and (beside.is_file() or not cameras.is_file()):
        cameras = beside
    return Session(
        path,
        name,
        robot,
        folder,
        cameras,
        target,
        rate,
        calibration,
        runs,
        channels,
        loads,
        frame,
        planar,
    )


class _Paths:
    """Paths of a session file; each has to stay in the session's folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def required(self, reader: Reader, key: str) -> Path:
        return self._inside(reader, key, reader.string(key)) or self._folder

    def optional(self, reader: Reader, key: str) -> Path | None:
        return self._inside(reader, key, reader.optional_string(key))

    def _inside(self, reader: Reader, key: str, text: str | None) -> Path | None:
        if not text:
            return None
        try:
            return inside(self._folder, text, key)
        except InputError as error:
            reader.add(key, str(error).removeprefix(f"{key}: "))
            return None


def _read_calibration(reader: Reader, paths: _Paths) -> CalibrationSource:
    recordings = paths.optional(reader, "recordings")
    table = reader.child("board", required=False)
    board = None if table is None else _read_board(table)
    tags = [read_base_tag(entry) for entry in reader.children("base_tags", required=False)]
    surveyed = read_surveyed(reader)
    scene = read_scene(reader.child("scene", required=False), paths.optional)
    reader.finish()
    if (recordings is None) != (board is None):
        reader.add("recordings, board", "give both or neither: footage of a board and the board")
    known = tuple(tag for tag in tags if tag is not None)
    return CalibrationSource(recordings, board, known, scene, surveyed)


def _read_board(reader: Reader) -> Mapping[str, object]:
    kind = reader.string("kind", choices=tuple(BOARD_KEYS))
    board: dict[str, object] = {"kind": kind}
    for key in BOARD_KEYS.get(kind, ()):
        board[key] = _board_value(reader, key)
    for key in OPTIONAL_BOARD_KEYS.get(kind, ()):
        if key in reader:
            board[key] = _board_value(reader, key)
    if kind in BOARD_KEYS:
        reader.finish()
    square, marker = board.get("square_m"), board.get("marker_m")
    if isinstance(square, float) and isinstance(marker, float) and marker >= square:
        reader.add("marker_m", f"{marker:g} must be below square_m, which is {square:g}")
    return MappingProxyType(board)


def _board_value(reader: Reader, key: str) -> object:
    if key == "squares":
        counts = reader.vector(key, 2)
        whole = np.isfinite(counts).all() and (counts == np.round(counts)).all()
        if not whole or (counts < 2).any() or (counts > 200).any():
            reader.add(key, f"{counts.tolist()} must be two whole numbers from 2 to 200")
            return (0, 0)
        return (int(counts[0]), int(counts[1]))
    if key in ("tagCols", "tagRows"):
        return reader.integer(key, minimum=1, maximum=200)
    if key in ("dictionary", "family"):
        return reader.string(key)
    if key == "legacy":
        value = reader.raw(key)
        if not isinstance(value, bool):
            reader.add(key, "must be true or false")
        return bool(value)
    return reader.number(key, above=0.0)


def _read_run(reader: Reader, paths: _Paths) -> Run:
    name = reader.string("name")
    role = reader.string("role", choices=ROLES)
    video = paths.optional(reader, "video")
    trajectory = paths.optional(reader, "trajectory")
    lengths = reader.optional_vector("cable_lengths_m", None)
    lengths_std = reader.optional_number("cable_lengths_std_m", above=0.0)
    window = reader.optional_vector("window_s", 2)
    payloads, loads = read_payloads(reader), read_placed(reader)
    level = reader.optional_number("level_std_rad", above=0.0)
    reader.finish()
    if name and not _is_file_stem(name):
        why = ": letters, digits, . _ - only"
        why = ", which Windows keeps for a device: take another" if is_device(name) else why
        reader.add("name", f"{name[:40]!r} becomes a file name{why}")
    if (video is None) == (trajectory is None):
        reader.add("video, trajectory", "give one of them")
    if trajectory is not None and trajectory.suffix.lower() not in TRAJECTORY_SUFFIXES:
        allowed = ", ".join(TRAJECTORY_SUFFIXES)
        reader.add("trajectory", f"{trajectory.suffix!r} is not one of {allowed}")
    if lengths is not None and (not len(lengths) or (lengths <= 0.0).any()):
        reader.add("cable_lengths_m", f"{lengths.tolist()} must all be > 0")
    elif lengths is not None and lengths.max() > LARGEST_FRAME_M:
        said = f"{lengths.max():g} m, more than {LARGEST_FRAME_M:g} m: this looks like mm or cm"
        reader.add("cable_lengths_m", f"{said}; write metres")
    if window is not None and not window[0] < window[1]:
        reader.add("window_s", f"{window.tolist()}: its end must follow its start")
    has_numbers = lengths is not None and np.isfinite(lengths).all()
    return Run(
        name,
        role,
        video,
        trajectory,
        lengths if has_numbers else None,
        lengths_std,
        None if window is None else (float(window[0]), float(window[1])),
        payloads,
        loads,
        level,
    )


def _is_file_stem(name: str) -> bool:
    plain = all(letter.isalnum() or letter in "._- " for letter in name)
    tidy = not name.startswith(".") and not name.endswith(".") and name.strip() == name
    return plain and tidy and len(name) <= _LONGEST_NAME and not is_device(name)


def as_run_name(text: str, taken: Collection[str] = ()) -> str:
    """A name that a run may have, as near to a text as it can be, and none of those taken."""
    plain = "".join(letter if letter.isalnum() or letter in "._- " else "-" for letter in text)
    plain = plain[:_LONGEST_NAME].strip(" .") or "run"
    plain = f"run-{plain}"[:_LONGEST_NAME].rstrip(" .") if is_device(plain) else plain
    name, others = plain, {one.casefold() for one in taken}
    for k in itertools.count(2):
        if name.casefold() not in others:
            break
        ending = f"-{k}"
        name = plain[: _LONGEST_NAME - len(ending)] + ending
    return name


def is_device(name: str) -> bool:
    """Whether Windows takes a file of this name, with any suffix, for a device."""
    return name.partition(".")[0].strip().casefold() in DEVICES


def _check_runs(reader: Reader, runs: tuple[Run, ...]) -> None:
    if "runs" in reader and not runs:
        reader.add("runs", "none; a session needs at least one [[runs]]")
    names = [run.name.casefold() for run in runs]
    for count, name in enumerate(names):
        if name and name in names[:count]:
            first = names.index(name) + 1
            reader.add(
                f"runs[{count + 1}].name", f"{runs[count].name!r} is already runs[{first}]'s"
            )
