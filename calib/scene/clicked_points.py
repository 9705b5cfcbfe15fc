"""What gives the map a scale and a frame: surveyed tags and points, known distances."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import Array
from freeswing.calib.rig.views import FixedPoints
from freeswing.calib.scene.stills import Still
from freeswing.calib.scene.tape_measured import SurveyedPoint
from freeswing.calib.tags.base_tags import SurveyedTag, find_base_tags
from freeswing.cdpr.files.documents import InputError, read_text
from freeswing.cdpr.files.number_table import comma_separated

CLICK_STD_PX = 0.5  # a point clicked by hand
_COLUMNS = ("point", "u_px", "v_px")
_MOST_BYTES = 1 << 24


@dataclass(frozen=True, slots=True)
class Click:
    """A point that a person marked in an image."""

    image: str
    point: str
    pixel: Array
    std_px: float


def read_clicks(
    path: Path, images: Sequence[str], points: Sequence[str], image: str = "image"
) -> tuple[Click, ...]:
    """Marked points: columns image, point, u_px, v_px and optionally std_px.

    Args:
        path: the table.
        images: names that an image may have.
        points: names that a point may have.
        image: what the column of images is called.

    Raises:
        InputError: not such a table, or a name that is not known.
    """
    lines = comma_separated(read_text(path, _MOST_BYTES)).splitlines()
    table = csv.DictReader(lines, skipinitialspace=True)
    columns = (image, *_COLUMNS)
    missing = [name for name in columns if name not in (table.fieldnames or ())]
    if missing:
        raise InputError(f"{path}: line 1: no column {', '.join(missing)}")
    found = []
    for row in table:
        where = f"{path}: line {table.line_num}"
        name, point = row[image] or "", row["point"] or ""
        if name not in images:
            few = ", ".join([*images][:12]) + (" ..." if len(images) > 12 else "")
            raise InputError(f"{where}: {image} {name[:60]!r} is none of them: {few}")
        if point not in points:
            known = ", ".join(points) or "none"
            raise InputError(
                f"{where}: point {point[:60]!r} is in no surveyed point and no distance of the "
                f"session ({known})"
            )
        try:
            pixel = np.array([float(row[key] or "") for key in ("u_px", "v_px")])
            deviation = float(row.get("std_px") or CLICK_STD_PX)
        except ValueError as error:
            raise InputError(f"{where}: u_px, v_px or std_px is not a number") from error
        if not (np.abs(pixel) < 1e6).all() or not 1e-3 <= deviation <= 1e2:
            raise InputError(f"{where}: u_px, v_px must be pixels, std_px from 0.001 to 100")
        found.append(Click(name, point, pixel, deviation))
    return tuple(found)


def surveyed_sightings(
    cameras: tuple[Camera, ...],
    stills: Mapping[str, Still],
    sigma_px: Array,
    tags: Sequence[SurveyedTag],
    points: Sequence[SurveyedPoint],
    clicks: Sequence[Click],
) -> FixedPoints:
    """Corners of base tags found in all images, and surveyed points that were clicked.

    Args:
        cameras: every image in the map, lenses known.
        stills: the images by name.
        sigma_px: noise of one feature in each.
        tags: surveyed tags.
        points: surveyed points.
        clicks: marks; those of other points are left out.
    """
    images = [[stills[camera.name].image] for camera in cameras]
    fixed = find_base_tags(cameras, images, tags, sigma_px).fixed if tags else _nothing()
    return joined(fixed, clicked(cameras, sigma_px, points, clicks))


def clicked(
    cameras: tuple[Camera, ...],
    sigma_px: Array,
    points: Sequence[SurveyedPoint],
    clicks: Sequence[Click],
) -> FixedPoints:
    """Clicked points as `calib.rig` takes surveyed ones."""
    index = {camera.name: k for k, camera in enumerate(cameras)}
    order = {point.name: k for k, point in enumerate(points)}
    own = [c for c in clicks if c.point in order and c.image in index]
    camera = np.array([index[c.image] for c in own], dtype=int)
    return FixedPoints(
        tuple(f"{point.name} point" for point in points),
        np.array([point.position_base_m for point in points], dtype=float).reshape(-1, 3),
        np.array([point.std_m for point in points], dtype=float),
        camera,
        np.array([order[c.point] for c in own], dtype=int),
        np.array([c.pixel for c in own], dtype=float).reshape(-1, 2),
        np.array([c.std_px for c in own], dtype=float) / sigma_px[camera],
    )


def _nothing() -> FixedPoints:
    none = np.zeros(0, dtype=int)
    return FixedPoints((), np.zeros((0, 3)), np.zeros(0), none, none, np.zeros((0, 2)), np.zeros(0))


def joined(first: FixedPoints, second: FixedPoints) -> FixedPoints:
    """Both surveys in one."""
    return FixedPoints(
        first.names + second.names,
        np.concatenate([first.points_base_m, second.points_base_m]),
        np.concatenate([first.std_m, second.std_m]),
        np.concatenate([first.camera, second.camera]),
        np.concatenate([first.point, second.point + len(first.names)]),
        np.concatenate([first.pixels, second.pixels]),
        np.concatenate([first.std_scale, second.std_scale]),
    )
