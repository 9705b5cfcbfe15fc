"""plumb_line.csv beside the calibration's recordings, and what it says of the declared gravity."""

from __future__ import annotations

import csv
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from freeswing.calib.camera.lens_models import Array
from freeswing.calib.verdict.plumb_line import StringView, Vertical
from freeswing.cdpr.files.documents import InputError, read_text
from freeswing.cdpr.files.number_table import comma_separated

CLICK_STD_PX = 0.5  # where the file states none: people hit a thin string within the pixel
_COLUMNS = ("camera", "u_px", "v_px")
_MOST_BYTES = 1 << 24
# A string this many click deviations long has its direction to 1/20 rad: shorter ones say nothing.
LEAST_LENGTH_STD = 20.0
# Scatter of the clicks over their deviation: people misjudge that by a half; twice is a wrong
# click.
WORST_SCATTER = 2.0
# Between the string and gravity_m_s2: by chance once in 90 where both are right.
DEVIATIONS = 3.0


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


def vertical_entry(
    vertical: Vertical, views: Sequence[StringView], gravity_m_s2: Array
) -> dict[str, Any]:
    """The `vertical` of results/calibration.json; `verdict` is agrees, differs or inconsistent.

    Deviations are the claimed ones, times the scatter where that is above one.
    """
    size = float(np.linalg.norm(gravity_m_s2))
    declared, down = gravity_m_s2 / size, vertical.down_base
    angle = float(np.arctan2(np.linalg.norm(np.cross(declared, down)), declared @ down))
    covariance = vertical.covariance * max(1.0, vertical.scatter) ** 2
    std = _std_along(declared - down * (declared @ down), covariance)
    verdict, sentence = _judged(vertical, angle, std, size * down)
    return {
        "verdict": verdict,
        "sentence": sentence,
        "down_base": down.tolist(),
        "covariance": covariance.tolist(),
        "gravity_m_s2": (size * down).tolist(),
        "angle_to_gravity_mrad": 1e3 * angle,
        "angle_std_mrad": 1e3 * std,
        "scatter": vertical.scatter,
        "degrees_of_freedom": vertical.degrees_of_freedom,
        "views": [
            {
                "camera": view.camera,
                "line": view.line,
                "points": len(view.pixels),
                "straightness_px": straightness,
            }
            for view, straightness in zip(views, vertical.straightness_px, strict=True)
        ],
    }


def _std_along(difference: Array, covariance: Array) -> float:
    """Deviation of the vertical along the difference; the largest one where there is none."""
    length = float(np.linalg.norm(difference))
    if length < 1e-9:
        return float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))
    return float(np.sqrt(difference @ covariance @ difference)) / length


def _judged(vertical: Vertical, angle: float, std: float, gravity: Array) -> tuple[str, str]:
    told = f"the plumb line is {1e3 * angle:.2f} mrad from gravity_m_s2 (deviation {1e3 * std:.2f})"
    if vertical.scatter > WORST_SCATTER:
        return "inconsistent", (
            f"{told}, but the clicked points scatter by {vertical.scatter:.1f} times their "
            f"std_px about one vertical, more than {WORST_SCATTER:g}: look for a wrong click, a "
            "string that swayed or touched something, or state a larger std_px"
        )
    if angle <= DEVIATIONS * std:
        return "agrees", f"{told}: they agree within {DEVIATIONS:g} deviations"
    vector = ", ".join(f"{value:.5f}" for value in gravity)
    turned = "the strings were clicked from the bottom up, or " if angle > np.pi / 2 else ""
    return "differs", f"{told}: {turned}set gravity_m_s2 = [{vector}] in robot.toml"
