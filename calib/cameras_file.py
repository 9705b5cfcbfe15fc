"""cameras.toml: read and write calibrated cameras.

Beside the keys of every camera, `clock_offset_s` and `line_time_s` are optional and mean what
`calib.camera.Camera` says; files without them describe synchronous global shutters.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from calib.camera import Camera
from calib.camera_models import PARAMETER_NAMES
from cdpr.documents import InputError, Problems, dump_toml, load_toml
from cdpr.rotation import matrix_from_quaternion, quaternion_from_matrix, transform

_KEYS = {
    "name",
    "size_px",
    "model",
    "params",
    "q_camera_base",
    "t_camera_base_m",
    "clock_offset_s",
    "line_time_s",
}
_UNIT_TOLERANCE = 1e-3


def read_cameras(path: Path | str) -> tuple[Camera, ...]:
    """The cameras of a `freeswing-cameras/1` file, in its order.

    Raises:
        InputError: naming every key that is missing, unknown or out of range.
    """
    path = Path(path)
    document = load_toml(path, "cameras")
    problems = Problems()
    entries = document.get("cameras")
    if not isinstance(entries, list) or not entries:
        raise InputError(f"{path}: holds no [[cameras]] entry")
    cameras = [
        camera
        for index, entry in enumerate(entries)
        if (camera := _camera(entry, f"cameras[{index}]", problems)) is not None
    ]
    names = [camera.name for camera in cameras]
    for name in sorted({name for name in names if names.count(name) > 1}):
        problems.add("cameras", f"two cameras are named {name!r}")
    problems.raise_if_any(path)
    return tuple(cameras)


def write_cameras(path: Path | str, cameras: tuple[Camera, ...]) -> None:
    """Write cameras so that `read_cameras` gives them back to the last digit."""
    dump_toml(
        Path(path),
        {"format": "freeswing-cameras/1", "cameras": [camera_entry(c) for c in cameras]},
    )


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


def _camera(entry: Any, where: str, problems: Problems) -> Camera | None:
    if not isinstance(entry, dict):
        problems.add(where, "is not a table")
        return None
    name = entry.get("name")
    if not isinstance(name, str) or not name:
        problems.add(f"{where}.name", "is missing or not a text")
        name = where
    else:
        where = f"{where} ({name})"
    for key in sorted(set(entry) - _KEYS):
        problems.add(f"{where}.{key}", f"is unknown; known keys are {', '.join(sorted(_KEYS))}")
    model = entry.get("model")
    if model not in PARAMETER_NAMES:
        problems.add(f"{where}.model", f"is {model!r}, not one of {', '.join(PARAMETER_NAMES)}")
        return None
    parameter_names = PARAMETER_NAMES[model]
    size = _numbers(entry, "size_px", 2, where, problems)
    params = _numbers(
        entry, "params", len(parameter_names), where, problems, " ".join(parameter_names)
    )
    quaternion = _numbers(entry, "q_camera_base", 4, where, problems, "w x y z")
    position = _numbers(entry, "t_camera_base_m", 3, where, problems)
    times = [
        _optional_number(entry, key, where, problems) for key in ("clock_offset_s", "line_time_s")
    ]
    if size is None or params is None or quaternion is None or position is None:
        return None
    if (size < 1).any() or (size != np.round(size)).any():
        problems.add(f"{where}.size_px", f"is {size.tolist()}, not two positive whole numbers")
        return None
    norm = float(np.linalg.norm(quaternion))
    if abs(norm - 1.0) > _UNIT_TOLERANCE:
        problems.add(f"{where}.q_camera_base", f"has norm {norm:.6g}, a rotation needs 1")
        return None
    focal = params[: 1 if parameter_names[0] == "f" else 2]
    if (focal <= 0.0).any():
        problems.add(f"{where}.params", f"focal length {focal.tolist()} px must be above 0")
        return None
    pose = transform(matrix_from_quaternion(quaternion / norm), position)
    return Camera(name, (int(size[0]), int(size[1])), model, params, pose, *times)


def _numbers(
    entry: dict[str, Any], key: str, count: int, where: str, problems: Problems, names: str = ""
) -> np.ndarray | None:
    values = entry.get(key)
    is_list = isinstance(values, list) and all(
        isinstance(v, int | float) and not isinstance(v, bool) and np.isfinite(v) for v in values
    )
    if not is_list or len(values) != count:  # pyright: ignore[reportArgumentType]
        what = "is missing" if values is None else f"is {values}"
        problems.add(f"{where}.{key}", f"{what}; expected {count} finite numbers {names}".rstrip())
        return None
    return np.array(values, dtype=np.float64)


def _optional_number(entry: dict[str, Any], key: str, where: str, problems: Problems) -> float:
    value = entry.get(key, 0.0)
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        problems.add(f"{where}.{key}", f"is {value!r}, expected a finite number")
        return 0.0
    return float(value)
