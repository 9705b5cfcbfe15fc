"""cameras.toml: read and write calibrated cameras.

Beside the keys of every camera, `clock_offset_s` and `line_time_s` are optional and mean what
`calib.camera.camera.Camera` says; files without them describe synchronous global shutters.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.impossible_lenses import question_lens
from freeswing.calib.camera.lens_models import PARAMETER_NAMES
from freeswing.cdpr.files.documents import Problems, Reader, load_toml, replace_file
from freeswing.cdpr.files.toml_text import toml_text
from freeswing.cdpr.files.unit_quaternions import declared_quaternion
from freeswing.cdpr.rotation import matrix_from_quaternion, quaternion_from_matrix, transform


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
        question_lens(entry, model, size, params)
    quaternion = declared_quaternion(entry, "q_camera_base")
    position = entry.vector("t_camera_base_m", 3)
    clock_offset = entry.optional_number("clock_offset_s") or 0.0
    line_time = entry.optional_number("line_time_s") or 0.0
    entry.finish()
    if entry.problems:
        return None
    pose = transform(matrix_from_quaternion(quaternion), position)
    size_px = (int(size[0]), int(size[1]))
    return Camera(name, size_px, model, params, pose, clock_offset, line_time)
