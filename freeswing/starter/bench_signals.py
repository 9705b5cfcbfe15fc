"""session.toml of a bench whose recordings exist: any part of a pose, or channels, in CSV."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.files.noise_columns import POSE_NOISE, QUATERNION, correlation_names
from freeswing.cdpr.files.signal_csv import SignalTable, coordinates_in, header_of, read_signals
from freeswing.cdpr.files.toml_text import toml_string
from freeswing.cdpr.files.trajectory_csv import column_name
from freeswing.cdpr.files.trajectory_files import holds_markers
from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.session.session_file import as_run_name
from freeswing.starter.kinds import MISSING

TIME = "t_s"
SPOKEN = {"roll": "phi", "pitch": "theta", "yaw": "chi"}
DEGREES = frozenset({"deg", "degree", "degrees"})
UNITS = frozenset({"m", "mm", "cm", "rad", "mrad", *DEGREES})
_LOAD_ENDS = (
    "mass_std_kg = 0.001",
    "# com_m = [0.0, 0.0, 0.0]   # where its centre of mass should be, with com_std_m = 0.01",
    "",
    "# Each run is of the empty platform, of a known mass on it (payload), or of the object",
    "# (loads): uncomment what it carried.",
)
_CARRIED = (
    "# payload = { mass_kg = 0.5, position_m = [0.1, 0.0, 0.0] }",
    '# loads = ["object"]',
)


@dataclass(frozen=True, slots=True)
class Signals:
    """Recordings of a bench.

    Attributes:
        files: in the order of their names.
        coordinates: of the pose that all of them hold.
        channels: columns beside them, uncalibrated.
        rate_hz: samples a second.
    """

    files: tuple[Path, ...]
    coordinates: tuple[str, ...]
    channels: tuple[str, ...]
    rate_hz: float

    @property
    def words(self) -> str:
        """What was recorded."""
        return ", ".join((*self.coordinates, *self.channels))

    @property
    def taken_for(self) -> list[str]:
        """What each column is taken for, a sentence a kind."""
        pose = ", ".join(map(column_name, self.coordinates))
        others = ", ".join(self.channels)
        told = [f"{pose}: taken for the pose, in m and rad"] if pose else []
        if others:
            told.append(
                f"{others}: taken for the motion's signals of unknown scale ([[channels]]); leave "
                "out of the files what is none"
            )
        return told


def are_signals(files: Sequence[Path]) -> bool:
    """Whether any is a table of time and numbers that is neither of markers nor of whole poses."""
    return any(
        _is_table(path) and coordinates_in(header_of(path)) != POSE_COORDINATES for path in files
    )


def _is_table(path: Path) -> bool:
    return path.suffix.lower() == ".csv" and not holds_markers(path) and TIME in header_of(path)


def look_over_signals(files: Sequence[Path]) -> Signals:
    """Read a bench's recordings.

    Raises:
        InputError: a file that is no such table, that holds other columns than the first, or one
            sample; a column that is a pose's in other words or units, or counts.
    """
    ordered = tuple(sorted(files, key=lambda path: path.name))
    for path in ordered:
        if not _is_table(path):
            raise InputError(
                f"{path}: it is no table with a column {TIME}, and others are: begin a session "
                "with recordings of one kind"
            )
    held = [_columns(path) for path in ordered]
    for path, columns in zip(ordered, held, strict=True):
        if columns != held[0]:
            raise InputError(
                f"{path}: it holds {', '.join(sum(columns, ()))}, and {ordered[0]} "
                f"{', '.join(sum(held[0], ()))}: begin a session with recordings of the same "
                "columns, and add the others to session.toml"
            )
    coordinates, channels = held[0]
    for channel in channels:
        _question_name(ordered[0], channel)
    tables = [read_signals(path, channels) for path in ordered]
    for path, table in zip(ordered, tables, strict=True):
        _question_values(path, table, channels)
    rate = round(1.0 / float(np.median(np.diff(tables[0].times_s))), 3)
    return Signals(ordered, coordinates, channels, rate)


def _columns(path: Path) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The coordinates that a file holds, and its other columns by name."""
    header = header_of(path)
    coordinates = coordinates_in(header)
    noise = POSE_NOISE if QUATERNION[0] in header else coordinates
    known = {TIME, *QUATERNION, *map(column_name, coordinates), *correlation_names(noise)}
    others = (name for name in header if name not in known and not name.startswith("std_"))
    return coordinates, tuple(sorted(others))


def _question_name(path: Path, column: str) -> None:
    """A part of the pose in other words or units is no signal of unknown scale."""
    first, *units = [word for word in re.split(r"[^a-z]+", column.lower()) if word]
    coordinate = SPOKEN.get(first, first)
    is_pose = coordinate in POSE_COORDINATES and UNITS.issuperset(units)
    if is_pose or DEGREES.intersection(units):
        wanted = column_name(coordinate) if is_pose else "phi_rad, theta_rad or chi_rad"
        raise InputError(
            f"{path}: column {column!r}: is it a part of the pose? Write it as {wanted} (metres; "
            "radians, which are degrees x 0.0174533). If its scale is not known, name it "
            "otherwise, as dot_px"
        )


def _question_values(path: Path, table: SignalTable, channels: Sequence[str]) -> None:
    """One sample has no rate, and what rises from row to row swings with nothing."""
    if len(table.times_s) < 2:
        raise InputError(
            f"{path}: it holds one sample, of which neither a rate nor a swing can be told: "
            "record again, or leave it out"
        )
    for channel in channels:
        steps = np.diff(table.values[channel])
        if len(steps) > 1 and (steps > 0.0).all():
            raise InputError(
                f"{path}: column {channel!r} rises from each row to the next, as a counter or a "
                "clock does and no swing: leave it out"
            )


def signals_session(name: str, found: Signals, cables: int) -> str:
    """A run a recording, and what each may carry to be filled in or deleted."""
    lines = [
        'format = "freeswing-session/1"',
        f"name = {toml_string(name)}",
        'robot = "robot.toml"',
        f"frame_rate_hz = {found.rate_hz:g}",
    ]
    for channel in found.channels:
        lines += [
            "",
            "[[channels]]       # an uncalibrated signal of the platform's motion",
            f"name = {toml_string(channel)}",
            f"column = {toml_string(channel)}",
            'coordinates = ["chi", "x", "y"]   # what moves it',
            "order = 3          # a dot on a flat wall is a curved map of yaw",
        ]
    lines += load_lines()
    rolls = cables == 2 and "phi" not in found.coordinates
    names: list[str] = []
    for path in found.files:
        names.append(as_run_name(path.stem, names))
        lines += [
            "",
            "[[runs]]",
            f"name = {toml_string(names[-1])}",
            'role = "identify"      # or validate: never fitted',
            f"trajectory = {toml_string(f'runs/{path.name}')}",
            *carried_lines(cables),
            "# window_s = [2.0, 32.0]    # from after the hand has let go; absent: all of it",
        ]
        if rolls:
            lines.append("# level_std_rad = 0.003     # a spirit level showed that it hangs level")
    return "\n".join([*lines, ""])


def load_lines() -> list[str]:
    """The object that a bench measures, and what its runs are of."""
    return [
        "",
        "[[loads]]          # the object to be measured; without one delete this table",
        'name = "object"',
        f"mass_kg = {MISSING}      # weigh it",
        *_LOAD_ENDS,
    ]


def carried_lines(cables: int) -> list[str]:
    """A bench's run: how long its wires are and what lay on the platform."""
    lengths = ", ".join([MISSING] * cables)
    return [
        f"cable_lengths_m = [{lengths}]   # hanging loaded, from bend to bend",
        "cable_lengths_std_m = 0.001",
        *_CARRIED,
    ]


def bench_of_poses(cables: int) -> tuple[list[str], list[str]]:
    """The same of whole poses, of the session and of a run: as comments, for a swing needs none."""
    lengths = ", ".join(["1.2"] * cables)
    load = [
        "",
        "# An object that lay on the platform in some runs, which is to be measured:",
        "# [[loads]]",
        '# name = "object"',
        "# mass_kg = 0.8      # weigh it",
        *(line if line.startswith("#") or not line else f"# {line}" for line in _LOAD_ENDS),
    ]
    run = [
        f"# cable_lengths_m = [{lengths}]   # hanging loaded, from bend to bend; absent: from the "
        "poses",
        "# cable_lengths_std_m = 0.001",
        *_CARRIED,
    ]
    return load, run
