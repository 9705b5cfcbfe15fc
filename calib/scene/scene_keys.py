"""[calibration.scene]: images of the laboratory at rest, and what was measured in it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from freeswing.calib.scene.source import SceneSource
from freeswing.calib.scene.tape_measured import TAPE_STD_M, Distance, SurveyedPoint
from freeswing.cdpr.files.documents import Reader


def read_scene(
    reader: Reader | None, path_of: Callable[[Reader, str], Path | None]
) -> SceneSource | None:
    """The table, None where there is none or it names no frames, which its problems then say.

    Args:
        reader: of the table.
        path_of: the path that a key of it names, inside the session's folder.
    """
    if reader is None:
        return None
    frames, walk = path_of(reader, "frames"), path_of(reader, "walk")
    clicks = path_of(reader, "clicks")
    surveyed = read_surveyed(reader)
    distances = [_distance(entry) for entry in reader.children("distances", required=False)]
    reader.finish()
    if frames is None:
        reader.add("frames", "missing: the folder with a recording of each camera at rest")
        return None
    return SceneSource(frames, walk, clicks, surveyed, tuple(distances))


def read_surveyed(reader: Reader) -> tuple[SurveyedPoint, ...]:
    """The points of `[[surveyed]]` in a table; names that stand twice are among its problems."""
    points = [_point(entry) for entry in reader.children("surveyed", required=False)]
    names = [point.name for point in points]
    for name in sorted({name for name in names if names.count(name) > 1}):
        reader.add("surveyed", f"two points are named {name!r}")
    return tuple(points)


def _std(reader: Reader) -> float:
    given = reader.optional_number("std_m", above=0.0)
    return TAPE_STD_M if given is None else given


def _point(reader: Reader) -> SurveyedPoint:
    name, place, std = reader.string("name"), reader.vector("position_base_m", 3), _std(reader)
    reader.finish()
    return SurveyedPoint(name, np.asarray(place, dtype=np.float64), std)


def _distance(reader: Reader) -> Distance:
    ends = reader.raw("between")
    names = [end for end in ends if isinstance(end, str)] if isinstance(ends, list) else []
    if len(names) != 2 or ends != names or names[0] == names[1]:
        reader.add("between", 'must be the names of two points, such as ["A", "B"]')
        names = ["", " "]
    length, std = reader.number("distance_m", above=0.0), _std(reader)
    reader.finish()
    return Distance((names[0], names[1]), length, std)
