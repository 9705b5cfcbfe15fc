"""cameras.toml: read and write calibrated cameras.

Beside the keys of every camera, `clock_offset_s` and `line_time_s` are optional and mean what
`calib.camera.camera.Camera` says; files without them describe synchronous global shutters.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import PARAMETER_NAMES, Array, focal_and_centre, normalise
from freeswing.cdpr.files.documents import Problems, Reader, load_toml, replace_file
from freeswing.cdpr.files.toml_text import toml_text
from freeswing.cdpr.rotation import matrix_from_quaternion, quaternion_from_matrix, transform

_UNIT_TOLERANCE = 1e-3  # a quaternion written with three decimals
# Focal length over the longer side: a fisheye of 220 degrees has 0.25, a lens of one degree 57.
SHORTEST_FOCAL = 0.1  # of the larger side of the image: a fisheye has three times as much
LONGEST_FOCAL = 100.0  # a telescope; what is longer is in millimetres or of another camera
HALFWAY = 0.5  # of the way from the middle to the corners every usable calibration reaches
LEAST_SEEN = 0.3  # of a pinhole's angle there: the worst pincushion of a lens leaves 0.8


def read_cameras(path: Path | str) -> tuple[Camera, ...]:
    """The cameras of a `freeswing-cameras/1` file, in its order.

    Raises:
        InputError: naming every key that is missing, unknown or out of range.
    """
    problems = Problems()
    document = Reader(load_toml(path, "cameras", problems), problems)
    entries = document.children("cameras")
    document.finish()
    cameras = [camera for entry in entries if (camera := _camera(entry)) is not None]
    names = [camera.name for camera in cameras]
    for name in sorted({name for name in names if names.count(name) > 1}):
        problems.add("cameras", f"two cameras are named {name!r}")
    problems.raise_if_any(path)
    return tuple(cameras)


def write_cameras(path: Path | str, cameras: tuple[Camera, ...]) -> None:
    """Write cameras so that `read_cameras` gives them back to the last digit."""
    replace_file(path, cameras_text(cameras).encode())


def cameras_text(cameras: tuple[Camera, ...]) -> str:
    """The same as text."""
    entries = [camera_entry(camera) for camera in cameras]
    return toml_text({"format": "freeswing-cameras/1", "cameras": entries})


def camera_entry(camera: Camera) -> dict[str, Any]:
    """One camera as the table that cameras.toml holds."""
    entry: dict[str, Any] = {
        "name": camera.name,
        "size_px": list(camera.size_px),
        "model": camera.model,
        "params": camera.params.tolist(),
        "q_camera_base": quaternion_from_matrix(camera.T_camera_base[:3, :3]).tolist(),
        "t_camera_base_m": camera.T_camera_base[:3, 3].tolist(),
    }
    if camera.clock_offset_s != 0.0:
        entry["clock_offset_s"] = camera.clock_offset_s
    if camera.line_time_s != 0.0:
        entry["line_time_s"] = camera.line_time_s
    return entry


def _question_lens(entry: Reader, model: str, size_px: Array, params: Array) -> None:
    """Record numbers that no lens on such a sensor has: they belong to another file or unit."""
    focal, centre = focal_and_centre(model, params)
    share = focal / size_px.max()
    if not ((share >= SHORTEST_FOCAL) & (share <= LONGEST_FOCAL)).all():
        entry.add(
            "params",
            f"focal lengths {focal.tolist()} px, expected {SHORTEST_FOCAL:g} to {LONGEST_FOCAL:g} "
            f"times the image's {size_px.max():g} px",
        )
        return
    if not ((centre >= -size_px / 2) & (centre <= 1.5 * size_px)).all():
        entry.add(
            "params",
            f"principal point {centre.tolist()} px is far outside the image of "
            f"{size_px.astype(int).tolist()} px: of another image size, or cx and cy exchanged",
        )
        return
    middle = (size_px - 1) / 2
    halfway = middle + HALFWAY * np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]]) * middle
    seen = normalise(model, halfway, params)
    if not np.isfinite(seen).all():
        entry.add(
            "params",
            f"the distortion {params[len(focal) + 2 :].tolist()} folds the image over within half "
            "of its diagonal: no lens does; check the model's name and the coefficients' order",
        )
        return
    straight = np.linalg.norm((halfway - centre) / focal, axis=1)
    far = int(np.argmax(straight))
    shrunk = float(np.linalg.norm(seen[far]) / straight[far])
    if shrunk < LEAST_SEEN:
        entry.add(
            "params",
            f"the distortion {params[len(focal) + 2 :].tolist()} leaves {100 * shrunk:.2g} % "
            "of the angle that half of the image's diagonal sees: no lens does; check the model's "
            "name and the coefficients' order",
        )


def _camera(entry: Reader) -> Camera | None:
    name = entry.string("name")
    model = entry.string("model", choices=tuple(PARAMETER_NAMES))
    size = entry.vector("size_px", 2)
    if (size < 1).any() or (size != np.round(size)).any():
        entry.add("size_px", f"{size.tolist()} is not two positive whole numbers")
    params = entry.vector("params", None)
    parameter_names = PARAMETER_NAMES.get(model, ())
    if parameter_names and len(params) != len(parameter_names):
        wanted = f"{len(parameter_names)} ({' '.join(parameter_names)})"
        entry.add("params", f"{len(params)} numbers, {model} takes {wanted}")
    elif parameter_names and (params[: 1 if parameter_names[0] == "f" else 2] <= 0.0).any():
        entry.add("params", f"focal length {params[0]:g} px must be above 0")
    if not entry.problems:
        _question_lens(entry, model, size, params)
    quaternion = entry.unit_vector("q_camera_base", 4, _UNIT_TOLERANCE)
    position = entry.vector("t_camera_base_m", 3)
    clock_offset = entry.optional_number("clock_offset_s") or 0.0
    line_time = entry.optional_number("line_time_s") or 0.0
    entry.finish()
    if entry.problems:
        return None
    pose = transform(matrix_from_quaternion(quaternion), position)
    size_px = (int(size[0]), int(size[1]))
    return Camera(name, size_px, model, params, pose, clock_offset, line_time)
