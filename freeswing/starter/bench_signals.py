"""session.toml of a bench whose recordings exist: any part of a pose, or channels, in CSV."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.files.signal_csv import coordinates_in, header_of, read_signals
from freeswing.cdpr.files.trajectory_files import holds_markers
from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.starter.kinds import MISSING

TIME = "t_s"


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


def are_signals(files: Sequence[Path]) -> bool:
    """Whether all are tables of time and numbers, neither markers nor whole poses."""
    return all(
        path.suffix.lower() == ".csv"
        and not holds_markers(path)
        and TIME in header_of(path)
        and coordinates_in(header_of(path)) != POSE_COORDINATES
        for path in files
    )


def look_over_signals(files: Sequence[Path]) -> Signals:
    """Read a bench's recordings.

    Raises:
        InputError: a file that is no such table, or that holds other columns than the first.
    """
    ordered = tuple(sorted(files, key=lambda path: path.name))
    held = [_columns(path) for path in ordered]
    for path, columns in zip(ordered, held, strict=True):
        if columns != held[0]:
            raise InputError(
                f"{path}: it holds {', '.join(sum(columns, ()))}, and {ordered[0]} "
                f"{', '.join(sum(held[0], ()))}: begin a session with recordings of the same "
                "columns, and add the others to session.toml"
            )
    coordinates, channels = held[0]
    tables = [read_signals(path, channels) for path in ordered]
    rate = round(1.0 / float(np.median(np.diff(tables[0].times_s))), 3)
    return Signals(ordered, coordinates, channels, rate)


def _columns(path: Path) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The coordinates that a file holds, and its other columns."""
    header = header_of(path)
    coordinates = coordinates_in(header)
    known = {TIME, *(f"{name}_{_unit(name)}" for name in coordinates)}
    others = tuple(name for name in header if name not in known and not name.startswith("std_"))
    return coordinates, others


def _unit(coordinate: str) -> str:
    return "m" if POSE_COORDINATES.index(coordinate) < 3 else "rad"


def signals_session(name: str, found: Signals, cables: int) -> str:
    """A run a recording, and what each may carry to be filled in or deleted."""
    lengths = ", ".join([MISSING] * cables)
    lines = [
        'format = "freeswing-session/1"',
        f'name = "{name}"',
        'robot = "robot.toml"',
        f"frame_rate_hz = {found.rate_hz:g}",
    ]
    for channel in found.channels:
        lines += [
            "",
            "[[channels]]       # an uncalibrated signal of the platform's motion",
            f'name = "{channel}"',
            f'column = "{channel}"',
            'coordinates = ["chi", "x", "y"]   # what moves it',
            "order = 3          # a dot on a flat wall is a curved map of yaw",
        ]
    lines += [
        "",
        "[[loads]]          # the object to be measured; without one delete this table",
        'name = "object"',
        f"mass_kg = {MISSING}      # weigh it",
        "mass_std_kg = 0.001",
        "# com_m = [0.0, 0.0, 0.0]   # where its centre of mass should be, with com_std_m = 0.01",
        "",
        "# Each run is of the empty platform, of a known mass on it (payload), or of the object",
        "# (loads): uncomment what it carried.",
    ]
    rolls = cables == 2 and "phi" not in found.coordinates
    for path in found.files:
        lines += [
            "",
            "[[runs]]",
            f'name = "{path.stem}"',
            'role = "identify"      # or validate: never fitted',
            f'trajectory = "runs/{path.name}"',
            f"cable_lengths_m = [{lengths}]   # hanging loaded, from bend to bend",
            "cable_lengths_std_m = 0.001",
            "# payload = { mass_kg = 0.5, position_m = [0.1, 0.0, 0.0] }",
            '# loads = ["object"]',
            "# window_s = [2.0, 32.0]    # from after the hand has let go; absent: all of it",
        ]
        if rolls:
            lines.append("# level_std_rad = 0.003     # a spirit level showed that it hangs level")
    return "\n".join([*lines, ""])
