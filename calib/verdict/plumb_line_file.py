"""plumb_line.csv beside the calibration's recordings, and what it says of the declared gravity."""

from __future__ import annotations

import csv
from collections.abc import Collection
from pathlib import Path

import numpy as np

from freeswing.calib.camera.lens_models import Array
from freeswing.calib.verdict.plumb_line import LEAST_LENGTH_STD, StringView
from freeswing.cdpr.files.documents import InputError, read_text
from freeswing.cdpr.files.number_table import comma_separated

CLICK_STD_PX = 0.5  # where the file states none: people hit a thin string within the pixel
_COLUMNS = ("camera", "u_px", "v_px")
_MOST_BYTES = 1 << 24


def read_plumb_line(path: Path | str, cameras: Collection[str]) -> tuple[StringView, ...]:
    """The clicked strings: columns camera, u_px, v_px and optionally line, std_px.

    Raises:
        InputError: not such a table, a camera that is not there, too few or too close points,
            or fewer than two views.
    """
    lines = comma_separated(read_text(path, _MOST_BYTES)).splitlines()
    table = csv.DictReader(lines, skipinitialspace=True)
    missing = [name for name in _COLUMNS if name not in (table.fieldnames or ())]
    if missing:
        raise InputError(f"{path}: line 1: no column {', '.join(missing)}")
    points: dict[tuple[str, str], list[tuple[float, float, float]]] = {}
    for row in table:
        where = f"{path}: line {table.line_num}"
        camera = row["camera"] or ""
        if camera not in cameras:
            known = ", ".join(sorted(cameras))
            raise InputError(f"{where}: camera {camera[:60]!r} is not one of {known}")
        key = (camera, row.get("line") or "1")
        points.setdefault(key, []).append(_numbers(row, where))
    views = tuple(_view(path, *key, np.array(rows)) for key, rows in points.items())
    if len(views) < 2:
        seen = f"only {views[0]}" if views else "no string"
        raise InputError(
            f"{path}: holds {seen}; click the same string in a second camera, or a second string"
        )
    return views


def _numbers(row: dict[str, str | None], where: str) -> tuple[float, float, float]:
    texts = (row["u_px"], row["v_px"], row.get("std_px") or str(CLICK_STD_PX))
    try:
        u, v, std = (float(text or "") for text in texts)
    except ValueError as error:
        raise InputError(f"{where}: u_px, v_px or std_px is not a number") from error
    if not (abs(u) < 1e6 and abs(v) < 1e6 and 1e-4 <= std <= 1e3):
        raise InputError(
            f"{where}: u_px {u:g}, v_px {v:g}, std_px {std:g}; pixels must be below 1e6 and "
            "std_px from 0.0001 to 1000"
        )
    return u, v, std


def _view(path: Path | str, camera: str, line: str, rows: Array) -> StringView:
    view = StringView(camera, line, rows[:, :2], rows[:, 2])
    length = float(np.linalg.norm(view.pixels[-1] - view.pixels[0]))
    least = LEAST_LENGTH_STD * float(view.std_px.max())
    if length < least:
        raise InputError(
            f"{path}: {view}: {len(rows)} point(s), the first and the last {length:.1f} px apart, "
            f"which is less than {least:.1f}; click along the whole string, from the top down"
        )
    return view
