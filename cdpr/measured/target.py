"""What is fixed to the platform: fiducial tags and round markers (target.toml)."""

from __future__ import annotations

from dataclasses import dataclass
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
)
from freeswing.cdpr.files.unit_quaternions import declared_quaternion
from freeswing.cdpr.robot import frozen_array
from freeswing.cdpr.rotation import matrix_from_quaternion, quaternion_from_matrix, transform

Array = NDArray[np.float64]

SMALLEST_M = 1e-4  # a tenth of a millimetre: neither printed nor seen
LARGEST_TAG_M = 3.0  # a tag wider than a room's wall; 5 mm taken for metres is above it
LARGEST_MARKER_M = 0.5  # wider than any; 5 mm taken for metres is above it
# Of named points' extent: nearer to one line they leave the turn about it to a click's error.
LEAST_BREADTH = 0.1  # of named points' extent: nearer to a line the turn about it is hardly told
UNIT_CORNERS = 0.5 * np.array([[-1.0, 1, 0, 0], [1, 1, 0, 0], [1, -1, 0, 0], [-1, -1, 0, 0]])


@dataclass(frozen=True, slots=True)
class Tag:
    """A square fiducial; tag frame: origin at its centre, x right, y up, z out of the print.

    Attributes:
        family: name of the dictionary, such as `tag36h11`.
        id: number in the family.
        size_m: side of the black border.
        T_platform_tag: tag to platform coordinates, (4, 4).
        std_m: how far it may be from there, each axis, one standard deviation; None: as a survey.
    """

    family: str
    id: int
    size_m: float
    T_platform_tag: Array
    std_m: float | None = None

    def __post_init__(self) -> None:
        what = f"tag {self.family} {self.id}: T_platform_tag"
        object.__setattr__(self, "T_platform_tag", frozen_array(self.T_platform_tag, (4, 4), what))
        if not (np.isfinite(self.size_m) and self.size_m > 0.0):
            raise ValueError(f"tag {self.family} {self.id}: size_m is {self.size_m}, must be > 0")

    @property
    def corners_platform_m(self) -> Array:
        """Border corners TL TR BR BL, seen facing the print, platform frame, (4, 3)."""
        return self.size_m * UNIT_CORNERS[:, :3] @ self.T_platform_tag[:3, :3].T + self.centre_m

    @property
    def centre_m(self) -> Array:
        """Centre of the tag, platform frame, (3,)."""
        return self.T_platform_tag[:3, 3]


@dataclass(frozen=True, slots=True)
class Marker:
    """A round (retro-reflective) point.

    Attributes:
        name: its label in recordings.
        position_m: its centre, platform frame, (3,).
        diameter_m: its size, None when unknown.
    """

    name: str
    position_m: Array
    diameter_m: float | None = None

    def __post_init__(self) -> None:
        position = frozen_array(self.position_m, (3,), f"marker {self.name}: position_m")
        object.__setattr__(self, "position_m", position)


@dataclass(frozen=True, slots=True)
class Untagged:
    """A platform that is followed by its own looks.

    Attributes:
        rest: folder with `<camera>/*.png` or `<camera>.mkv` of the platform at rest.
        clicks: table of the named points marked there: camera, point, u_px, v_px.
        points: the named points, which give the platform frame; no diameters.
    """

    rest: Path
    clicks: Path
    points: tuple[Marker, ...]


@dataclass(frozen=True, slots=True)
class Target:
    """Everything on the platform that can be seen."""

    tags: tuple[Tag, ...] = ()
    markers: tuple[Marker, ...] = ()
    untagged: Untagged | None = None

    @property
    def marker_names(self) -> tuple[str, ...]:
        """Labels of the markers, in order."""
        return tuple(marker.name for marker in self.markers)

    @property
    def marker_positions_m(self) -> Array:
        """Marker centres, platform frame, (n_markers, 3)."""
        return np.array([marker.position_m for marker in self.markers]).reshape(-1, 3)


def read_target(path: Path | str) -> Target:
    """Read target.toml.

    Raises:
        InputError: naming every problem of the file.
    """
    problems = Problems()
    reader = Reader(load_toml(path, "target", problems), problems)
    tag_readers = reader.children("tags", required=False)
    marker_readers = reader.children("markers", required=False)
    untagged = _read_untagged(reader.child("untagged", required=False), Path(path).parent)
    if not tag_readers and not marker_readers and "untagged" not in reader:
        problems.add("tags, markers", "none; a target needs at least one tag or marker")
    tags = [_read_tag_values(table) for table in tag_readers]
    markers = [_read_marker_values(table) for table in marker_readers]
    _add_repeats(problems, "tags", [f"{family} {number}" for family, number, *_ in tags])
    _add_repeats(problems, "markers", [name for name, *_ in markers])
    reader.finish()
    problems.raise_if_any(path)
    return Target(
        tuple(
            Tag(family, number, size, transform(matrix_from_quaternion(q), t), std)
            for family, number, size, q, t, std in tags
        ),
        tuple(Marker(*values) for values in markers),
        untagged,
    )


def _read_untagged(reader: Reader | None, folder: Path) -> Untagged | None:
    """The table, None where there is none or its numbers are wrong, which the problems say."""
    if reader is None:
        return None
    paths = []
    for key in ("rest", "clicks"):
        try:
            paths.append(inside(folder, reader.string(key), key))
        except InputError as error:
            reader.add(key, str(error).removeprefix(f"{key}: "))
    tables = reader.children("points")
    points = [(table.string("name"), table.vector("position_m", 3)) for table in tables]
    for table in tables:
        table.finish()
    reader.finish()
    places = np.array([place for _, place in points]).reshape(-1, 3)
    breadth = np.linalg.svd(places - places.mean(axis=0), compute_uv=False) if len(points) else []
    if len(points) < 3 or not breadth[1] > LEAST_BREADTH * breadth[0]:
        reader.add("points", f"{len(points)}; three that are not on one line give the frame")
        return None
    if len(paths) < 2 or not np.isfinite(places).all():
        return None
    return Untagged(paths[0], paths[1], tuple(Marker(name, place) for name, place in points))


def write_target(path: Path | str, target: Target) -> None:
    """Write target.toml; the file is replaced whole."""
    tags = [
        {
            "family": tag.family,
            "id": tag.id,
            "size_m": tag.size_m,
            "q_platform_tag": quaternion_from_matrix(tag.T_platform_tag[:3, :3]),
            "t_platform_tag_m": tag.centre_m,
            **({} if tag.std_m is None else {"std_m": tag.std_m}),
        }
        for tag in target.tags
    ]
    markers = [
        {"name": m.name, "position_m": m.position_m, "diameter_m": m.diameter_m}
        for m in target.markers
    ]
    table = {"format": "freeswing-target/1", "tags": tags or None, "markers": markers or None}
    dump_toml(path, table)


def _read_tag_values(reader: Reader) -> tuple[str, int, float, Array, Array, float | None]:
    values = (
        reader.string("family"),
        reader.integer("id", minimum=0),
        reader.number("size_m", above=0.0),
        declared_quaternion(reader, "q_platform_tag"),
        reader.vector("t_platform_tag_m", 3),
        reader.optional_number("std_m", above=0.0),
    )
    _question_size(reader, "size_m", values[2], LARGEST_TAG_M)
    reader.finish()
    return values


def _read_marker_values(reader: Reader) -> tuple[str, Array, float | None]:
    values = (
        reader.string("name"),
        reader.vector("position_m", 3),
        reader.optional_number("diameter_m", above=0.0),
    )
    _question_size(reader, "diameter_m", values[2], LARGEST_MARKER_M)
    reader.finish()
    return values


def _question_size(reader: Reader, key: str, size_m: float | None, largest_m: float) -> None:
    """Record a size that no printed tag and no marker has."""
    if size_m and np.isfinite(size_m) and not SMALLEST_M <= size_m <= largest_m:
        likely = f": millimetres? {size_m / 1e3:g} m then" if size_m > largest_m else ""
        reader.add(key, f"{size_m:g} m, expected {SMALLEST_M:g} to {largest_m:g} m{likely}")


def _add_repeats(problems: Problems, key: str, names: list[str]) -> None:
    first: dict[str, int] = {}
    for count, name in enumerate(names, start=1):
        if first.setdefault(name, count) < count and name:
            problems.add(f"{key}[{count}]", f"{name!r} is already {key}[{first[name]}]")
