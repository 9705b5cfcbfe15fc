"""homing.toml and its table of static readings, read and written."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import (
    InputError,
    Problems,
    Reader,
    dump_toml,
    inside,
    load_toml,
    read_text,
    replace_file,
)
from freeswing.cdpr.files.number_table import comma_separated
from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.robot import Robot

Array = NDArray[np.float64]

_MOST_CSV_BYTES = 512 * 2**20
_MOST_PROBLEMS = 20
_ZERO = 1e-9


@dataclass(frozen=True, slots=True)
class ReadingNoise:
    """Standard deviations of what is read and of what the model leaves out.

    Attributes:
        sigma_rad: one swivel reading.
        length_m: one cable-length reading.
        statics: what keeps the platform from exact equilibrium, over its weight (a share of it for
            forces, metres for moments).
        tension_N: one tension reading; None when tensions serve only for the first guess.
        tilt_rad: one inclinometer reading.
        stated: whether sigma_rad and length_m come from the user; otherwise they are scaled to
            what the readings show.
    """

    sigma_rad: float = 5e-4
    length_m: float = 5e-4
    statics: float = 1e-4
    tension_N: float | None = None
    tilt_rad: float = 1e-3
    stated: bool = False


@dataclass(frozen=True, slots=True)
class GeometryNoise:
    """How well the declared geometry is known, standard deviations.

    Attributes:
        entry_m: each coordinate of D.
        attachment_m: each coordinate of A.
        radius_m: each pulley radius.
        com_m: each coordinate of the centre of mass.
    """

    entry_m: float = 0.002
    attachment_m: float = 0.002
    radius_m: float = 0.0002
    com_m: float = 0.002

    def stack(self, n_cables: int) -> Array:
        """Standard deviation of each geometry offset, (7 n + 3,)."""
        kinds = (self.entry_m, self.attachment_m, self.radius_m, self.com_m)
        return np.repeat(kinds, (3 * n_cables, 3 * n_cables, n_cables, 3))


@dataclass(frozen=True, slots=True)
class Readings:
    """Static poses as the encoders saw them; NaN where nothing was read.

    Attributes:
        sigma_rad: swivel angles less those of the start pose, (N, n); the first row is zero.
        length_m: cable lengths less those of the start pose, (N, n); the first row is zero.
        tension_N: cable tensions, or motor torques over the drum's radius, (N, n) or None.
        tilt_rad: an inclinometer's roll and pitch, (N, 2) or None.
    """

    sigma_rad: Array
    length_m: Array
    tension_N: Array | None = None
    tilt_rad: Array | None = None

    def rows(self, chosen: NDArray[np.intp]) -> Readings:
        """Some of the static poses alone."""
        tension = None if self.tension_N is None else self.tension_N[chosen]
        tilt = None if self.tilt_rad is None else self.tilt_rad[chosen]
        return Readings(self.sigma_rad[chosen], self.length_m[chosen], tension, tilt)


@dataclass(frozen=True, slots=True)
class Homing:
    """All that homing.toml says.

    Attributes:
        robot: the robot with its declared geometry.
        readings: the static poses.
        start_tensions_N: roughly the tensions of the first pose, (n,).
        max_tensions_N: roughly the largest tensions of the procedure, (n,).
        noise: of the readings.
        geometry: how well the geometry is known; None when homing.toml does not say.
    """

    robot: Robot
    readings: Readings
    start_tensions_N: Array
    max_tensions_N: Array
    noise: ReadingNoise = field(default_factory=ReadingNoise)
    geometry: GeometryNoise | None = None


def read_homing(path: Path | str) -> Homing:
    """Read homing.toml with its robot and readings.

    Raises:
        InputError: naming every problem of the file with its key, or line and column.
    """
    path, problems = Path(path), Problems()
    reader = Reader(load_toml(path, "homing", problems), problems)
    robot_name, table_name = reader.string("robot"), reader.string("readings")
    start = reader.vector("start_tensions_N", None)
    largest = reader.vector("max_tensions_N", None)
    noise = _read_noise(reader.child("readings_std", required=False))
    geometry = _read_geometry(reader.child("geometry_std", required=False))
    reader.finish()
    problems.raise_if_any(path)
    robot = read_robot(inside(path.parent, robot_name, "robot"))
    for key, values in (("start_tensions_N", start), ("max_tensions_N", largest)):
        if len(values) != robot.n_cables:
            problems.add(key, f"{len(values)} tensions, the robot has {robot.n_cables} cables")
        elif (values <= 0).any():
            problems.add(key, f"{values.min():g} N is not above 0: every cable must be taut")
    if not 0 < robot.n_cables < 6:
        problems.add("robot", f"{robot.n_cables} cables; a start pose is found for 1 to 5")
    problems.raise_if_any(path)
    readings = read_readings(inside(path.parent, table_name, "readings"), robot.n_cables)
    return Homing(robot, readings, start, largest, noise, geometry)


def read_readings(path: Path, n_cables: int) -> Readings:
    """Read the table of static poses; an empty cell is a missing reading.

    Raises:
        InputError: for unknown or missing columns, text that is not a number, a first row that is
            not zero.
    """
    text = comma_separated(read_text(path, _MOST_CSV_BYTES))
    try:
        rows = list(csv.reader(io.StringIO(text)))
    except csv.Error as error:  # a carriage return inside a row
        raise InputError(f"{path}: {error}: save it again as CSV") from error
    rows = [(line, row) for line, row in enumerate(rows, start=1) if any(c.strip() for c in row)]
    if not rows:
        raise InputError(f"{path}: empty; give a header and one static pose a row")
    header = [name.strip() for name in rows[0][1]]
    groups = {
        "sigma": [f"dsigma{i}_rad" for i in range(1, n_cables + 1)],
        "length": [f"dl{i}_m" for i in range(1, n_cables + 1)],
        "tension": [f"tau{i}_N" for i in range(1, n_cables + 1)],
        "tilt": ["roll_rad", "pitch_rad"],
    }
    _check_header(path, header, groups)
    table = _read_cells(path, rows[1:], header)
    columns = {
        group: [header.index(c) for c in names if c in header] for group, names in groups.items()
    }
    picked = {group: table[:, found] if found else None for group, found in columns.items()}
    sigma, length = picked["sigma"], picked["length"]
    if sigma is None or length is None:
        raise InputError(f"{path}: no columns dsigma1_rad.. and dl1_m..")
    first = np.concatenate([sigma[0], length[0]])
    if not (np.abs(first) <= _ZERO).all():
        raise InputError(
            f"{path}: the first row is the start pose and must be zero, found {first}; "
            "subtract it from all rows"
        )
    return Readings(sigma, length, picked["tension"], picked["tilt"])


def write_homing(folder: Path, homing: Homing, robot_name: str = "robot.toml") -> Path:
    """Write homing.toml and readings.csv into `folder`; gives the path of homing.toml."""
    table = {
        "format": "freeswing-homing/1",
        "robot": robot_name,
        "readings": "readings.csv",
        "start_tensions_N": homing.start_tensions_N,
        "max_tensions_N": homing.max_tensions_N,
    }
    if homing.noise.stated:
        noise = homing.noise
        stated = {
            "sigma_rad": noise.sigma_rad,
            "length_m": noise.length_m,
            "statics": noise.statics,
        }
        if noise.tension_N is not None:
            stated["tension_N"] = noise.tension_N
        table["readings_std"] = stated
    replace_file(folder / "readings.csv", _readings_text(homing.readings).encode())
    dump_toml(folder / "homing.toml", table)
    return folder / "homing.toml"


def _readings_text(readings: Readings) -> str:
    n = readings.sigma_rad.shape[1]
    names = [f"dsigma{i + 1}_rad" for i in range(n)] + [f"dl{i + 1}_m" for i in range(n)]
    blocks = [readings.sigma_rad, readings.length_m]
    if readings.tension_N is not None:
        names += [f"tau{i + 1}_N" for i in range(n)]
        blocks.append(readings.tension_N)
    if readings.tilt_rad is not None:
        names += ["roll_rad", "pitch_rad"]
        blocks.append(readings.tilt_rad)
    lines = [
        ",".join("" if math.isnan(value) else f"{value:.17g}" for value in row)
        for row in np.hstack(blocks)
    ]
    return "\n".join([",".join(names), *lines, ""])


def _read_noise(reader: Reader | None) -> ReadingNoise:
    if reader is None:
        return ReadingNoise()
    default = ReadingNoise()
    numbers = {
        key: reader.optional_number(key, above=0.0)
        for key in ("sigma_rad", "length_m", "statics", "tension_N", "tilt_rad")
    }
    reader.finish()
    return ReadingNoise(
        sigma_rad=numbers["sigma_rad"] or default.sigma_rad,
        length_m=numbers["length_m"] or default.length_m,
        statics=numbers["statics"] or default.statics,
        tension_N=numbers["tension_N"],
        tilt_rad=numbers["tilt_rad"] or default.tilt_rad,
        stated=numbers["sigma_rad"] is not None and numbers["length_m"] is not None,
    )


def _read_geometry(reader: Reader | None) -> GeometryNoise | None:
    if reader is None:
        return None
    default = GeometryNoise()
    keys = ("entry_m", "attachment_m", "radius_m", "com_m")
    stated = {key: reader.optional_number(key, above=0.0) for key in keys}
    reader.finish()
    return GeometryNoise(**{key: stated[key] or getattr(default, key) for key in keys})


def _check_header(path: Path, header: list[str], groups: dict[str, list[str]]) -> None:
    problems = Problems()
    known = [name for names in groups.values() for name in names]
    for name in header:
        if name not in known:
            problems.add(f"column {name[:40]!r}", f"unknown; known here: {', '.join(known)}")
        elif header.count(name) > 1:
            problems.add(f"column {name!r}", "stands twice")
    for group, names in groups.items():
        missing = [name for name in names if name not in header]
        if missing and (group in ("sigma", "length") or len(missing) < len(names)):
            problems.add(f"column {missing[0]!r}", "missing")
    problems.raise_if_any(path)


def _read_cells(path: Path, rows: list[tuple[int, list[str]]], header: list[str]) -> Array:
    if not rows:
        raise InputError(f"{path}: no static pose; give one a row")
    problems, table = Problems(), np.full((len(rows), len(header)), np.nan)
    for k, (line, row) in enumerate(rows):
        if len(row) != len(header):
            problems.add(f"line {line}", f"{len(row)} cells, the header has {len(header)}")
            continue
        for column, cell in enumerate(row):
            text = cell.strip()
            if not text:
                continue
            try:
                value = float(text)
            except ValueError:
                value = math.nan
            if not math.isfinite(value):
                problems.add(f"line {line}, {header[column]}", f"{text[:40]!r} is not a number")
            table[k, column] = value
        if len(problems.lines) >= _MOST_PROBLEMS:
            break
    problems.raise_if_any(path)
    return table
