"""results/calibration.json: what a calibration found and how far it can be trusted."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import camera_entry
from freeswing.calib.camera.lens_models import PARAMETER_NAMES, Array
from freeswing.calib.rig.bundle_adjustment import named
from freeswing.calib.rig.reprojection import camera_slices
from freeswing.calib.rig.solve_rig import Rig
from freeswing.cdpr.files.documents import InputError, read_text

FORMAT = "freeswing-calibration/1"
TANGENT = (
    "pose entries tx_m ty_m tz_m rx_rad ry_rad rz_rad: t_true = t + dt, R_true = exp(dr) R of "
    "T_camera_base; base_point entries are metres in the base frame"
)
MOST_BYTES = 1 << 28


@dataclass(frozen=True, slots=True)
class CameraCovariance:
    """Joint covariance of all cameras' parameters.

    Attributes:
        names: such as `cam0.fx`, `cam0.tx_m`, `cam1.clock_offset_s`, (n,).
        matrix: covariance, zero for what was held, (n, n).
    """

    names: tuple[str, ...]
    matrix: Array

    def pose(self, camera: str) -> Array:
        """Covariance of one camera's (dt, dr), (6, 6); tangent as `calib.camera.camera` has it."""
        return self.poses((camera,))

    def poses(self, cameras: tuple[str, ...]) -> Array:
        """Joint covariance of the cameras' (dt, dr), in that order, (6 n, 6 n)."""
        tangent = ("tx_m", "ty_m", "tz_m", "rx_rad", "ry_rad", "rz_rad")
        return self.block([f"{camera}.{entry}" for camera in cameras for entry in tangent])

    def lens(self, camera: Camera) -> Array:
        """Covariance of one camera's lens parameters, (k, k)."""
        return self.block([f"{camera.name}.{entry}" for entry in PARAMETER_NAMES[camera.model]])

    def block(self, names: list[str]) -> Array:
        """The sub-matrix of the named parameters.

        Raises:
            ValueError: when a name is not there.
        """
        at = {name: index for index, name in enumerate(self.names)}
        missing = [name for name in names if name not in at]
        if missing:
            raise ValueError(f"covariance holds no {', '.join(missing[:5])}; calibrate again")
        index = [at[name] for name in names]
        return self.matrix[np.ix_(index, index)]


def read_camera_covariance(path: Path | str) -> CameraCovariance:
    """The cameras' joint covariance from results/calibration.json.

    Raises:
        InputError: when the file is not such a document.
    """
    try:
        document = json.loads(read_text(path, MOST_BYTES))
        if document.get("format") != FORMAT:
            raise InputError(f'{path}: format is {document.get("format")!r}, expected "{FORMAT}"')
        names = tuple(str(name) for name in document["covariance"]["names"])
        matrix = np.array(document["covariance"]["matrix"], dtype=np.float64)
    except InputError:
        raise
    except (
        ValueError,
        AttributeError,
        KeyError,
        TypeError,
        OverflowError,
        RecursionError,
    ) as error:
        raise InputError(f"{path}: not a calibration result ({error})") from error
    if matrix.shape != (len(names), len(names)):
        raise InputError(f"{path}: covariance is {matrix.shape} for {len(names)} names")
    return CameraCovariance(names, matrix)


def camera_covariance(rig: Rig) -> CameraCovariance:
    """The covariance of the cameras' unknowns."""
    end = camera_slices(rig.cameras)[-1].stop
    names = tuple(named(rig.adjustment.scene)[:end])
    return CameraCovariance(names, rig.adjustment.covariance[:end, :end])


def covariance_entry(rig: Rig) -> dict[str, Any]:
    """The same as the document stores it."""
    known = camera_covariance(rig)
    return {
        "tangent": TANGENT,
        "names": list(known.names),
        "matrix": known.matrix.tolist(),
    }


def camera_entries(rig: Rig) -> list[dict[str, Any]]:
    """One table a camera: values, standard deviations and residuals."""
    result, views = rig.adjustment, rig.problem.views
    deviations = np.sqrt(np.diag(result.covariance))
    timed = bool(result.scene.motion.any())  # a board at rest tells nothing of clocks
    entries = []
    for index, (camera, own) in enumerate(
        zip(rig.cameras, camera_slices(rig.cameras), strict=True)
    ):
        k = len(camera.params)
        residuals = result.residuals_px[views.camera == index]
        std = deviations[own]
        entries.append(
            {
                **camera_entry(camera),
                "clock_offset_s": camera.clock_offset_s,
                "line_time_s": camera.line_time_s,
                "views": int((views.camera == index).sum()),
                "dropped_views": sum(
                    drop.label.startswith((f"{camera.name}/", f"{camera.name}."))
                    for drop in rig.dropped
                ),
                "corners": int(np.isfinite(residuals[..., 0]).sum()),
                "corner_noise_px": float(result.sigma_px[index]),
                "reprojection_px": _rms(residuals),
                "params_std": std[:k].tolist(),
                "position_std_m": std[k : k + 3].tolist(),
                "rotation_std_rad": std[k + 3 : k + 6].tolist(),
                "clock_offset_std_s": float(std[k + 6]) if timed else None,
                "line_time_std_s": float(std[k + 7]),
            }
        )
    return entries


def _rms(residuals: Array) -> float:
    """Root mean square of the seen residuals, each axis; NaN without any."""
    seen = residuals[np.isfinite(residuals)]
    return float(np.sqrt(np.mean(seen**2))) if seen.size else float("nan")
