"""Where the named points of a platform without tags were clicked, and the frame they give."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.camera import Camera
from freeswing.calib.rig.triangulation import triangulate
from freeswing.cdpr.files.documents import DataError, InputError, read_text
from freeswing.cdpr.files.number_table import comma_separated
from freeswing.cdpr.measured.rigid_fit import fit_rigid
from freeswing.cdpr.measured.target import Untagged
from freeswing.cdpr.rotation import transform
from freeswing.vision.untagged.still_pose import still_pose

Array = NDArray[np.float64]

# Named points where clicked against where stated: a millimetre is a click, 10 mm another point.
WORST_NAMED_M = 0.01
CLICK_STD_PX = 0.5  # a point clicked by hand
_MOST_BYTES = 1 << 24
_COLUMNS = ("camera", "point", "u_px", "v_px")


def named_frame(cameras: Sequence[Camera], untagged: Untagged) -> tuple[Array, Array]:
    """T_base_platform at rest from the clicked named points, and its covariance, (6, 6)."""
    clicks = _clicks(untagged, [camera.name for camera in cameras])
    names = [point.name for point in untagged.points]
    pixels = np.full((len(cameras), len(names), 2), np.nan)
    std_px = np.ones((len(cameras), len(names)))
    for row, camera in enumerate(cameras):
        for column, name in enumerate(names):
            if (camera.name, name) in clicks:
                pixels[row, column] = clicks[camera.name, name][:2]
                std_px[row, column] = clicks[camera.name, name][2]
    places = triangulate(cameras, pixels)
    known = np.isfinite(places[:, 0])
    if known.sum() < 3:
        lost = ", ".join(name for name, ok in zip(names, known, strict=True) if not ok)
        raise DataError(
            f"{untagged.clicks}: {int(known.sum())} named points are marked in two cameras, need "
            f"three; mark {lost} in two cameras each"
        )
    stated = np.array([point.position_m for point in untagged.points])
    own = np.array(names)[known].tolist()
    start = rigid(stated[known], places[known], str(untagged.clicks), own)
    camera_of, which = np.nonzero(np.isfinite(pixels[..., 0]))
    marks, std = pixels[camera_of, which], std_px[camera_of, which]
    return still_pose(cameras, camera_of, stated[which], marks, std, start)


def rigid(stated: Array, places: Array, where: str, names: Sequence[str]) -> Array:
    """T (4, 4) with places = T stated of least squares.

    Raises:
        DataError: the points do not fit, with the one that is off most, or lie on a line.

    Source:
        Kabsch 1976, A solution for the best rotation to relate two sets of vectors.
    """
    turn, shift = (found[0] for found in fit_rigid(stated, places[None]))
    off = np.linalg.norm(places - stated @ turn.T - shift, axis=1)
    if np.isnan(off).any():
        raise DataError(f"{where}: points {', '.join(names)} lie on a line: they fix no frame")
    if off.max() > WORST_NAMED_M:
        raise DataError(
            f"{where}: point {names[int(off.argmax())]} lies {1e3 * off.max():.1f} mm from where "
            f"target.toml has it beside the others, limit {1e3 * WORST_NAMED_M:.0f} mm: a wrong "
            "mark, a wrong position_m, or millimetres for metres"
        )
    return transform(turn, shift)


def _clicks(untagged: Untagged, cameras: Sequence[str]) -> dict[tuple[str, str], Array]:
    """Marks by camera and point: u, v and their deviation, (3,)."""
    path: Path = untagged.clicks
    lines = comma_separated(read_text(path, _MOST_BYTES)).splitlines()
    table = csv.DictReader(lines, skipinitialspace=True)
    missing = [name for name in _COLUMNS if name not in (table.fieldnames or ())]
    if missing:
        raise InputError(f"{path}: line 1: no column {', '.join(missing)}")
    names = [point.name for point in untagged.points]
    found = {}
    for row in table:
        where = f"{path}: line {table.line_num}"
        for key, known in (("camera", cameras), ("point", names)):
            if row[key] not in known:
                told = ", ".join(known)
                raise InputError(f"{where}: {key} {(row[key] or '')[:60]!r} is not one of {told}")
        try:
            mark = np.array([float(row["u_px"] or ""), float(row["v_px"] or ""), CLICK_STD_PX])
            mark[2] = float(row.get("std_px") or CLICK_STD_PX)
        except ValueError as error:
            raise InputError(f"{where}: u_px, v_px or std_px is not a number") from error
        if not ((np.abs(mark[:2]) < 1e6).all() and 1e-3 <= mark[2] <= 1e2):
            raise InputError(
                f"{where}: u_px {mark[0]:g}, v_px {mark[1]:g} must be pixels, std_px {mark[2]:g} "
                "from 0.001 to 100"
            )
        found[row["camera"] or "", row["point"] or ""] = mark
    return found
