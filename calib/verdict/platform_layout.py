"""Where a calibration that was tied by the platform's tags has them, in results/calibration.json.

The tags' places are unknowns beside the cameras (`calib.rig.tie_by_swings`), and cameras that are
tied by them agree about these places alone: whoever goes on from such cameras has to take both.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from freeswing.calib.camera.lens_models import Array
from freeswing.calib.rig.bundle_adjustment import named
from freeswing.calib.rig.reprojection import camera_slices, shape_modes, warped
from freeswing.calib.rig.reprojection_kernels import WARP
from freeswing.calib.rig.solve_rig import Rig
from freeswing.calib.verdict.calibration_result import MOST_BYTES, TANGENT, CameraCovariance
from freeswing.calib.verdict.survey_check import rms_distance
from freeswing.cdpr.files.documents import InputError, read_text

TAG_NUMBERS = ("tx_m", "ty_m", "tz_m", "rx_rad", "ry_rad", "rz_rad")
LAYOUT_TANGENT = (
    f"{TANGENT}; a tag's entries: of the true place less the one found, shift of its middle and "
    "turn about it, along the platform's axes"
)


@dataclass(frozen=True, slots=True)
class PlatformLayout:
    """The platform's tags as a calibration found them.

    Attributes:
        names: family and id of each.
        corners_platform_m: as found, TL TR BR BL, (n, 4, 3).
        target_corners_m: as target.toml had them then, (n, 4, 3).
        covariance: of all cameras' numbers and the tags' places together (`tag_entries`), None
            where the file tells none.
    """

    names: tuple[tuple[str, int], ...]
    corners_platform_m: Array
    target_corners_m: Array
    covariance: CameraCovariance | None = None


def tag_entries(family: str, number: int) -> list[str]:
    """How the numbers of a tag's place are named: shifts, then turns."""
    return [f"platform.{family} {number}.{kind}" for kind in TAG_NUMBERS]


def layout_entry(rig: Rig) -> dict[str, Any] | None:
    """`layout` of the document, None where the platform's tags took no part."""
    if rig.platform is None:
        return None
    told = np.array(rig.platform.corners_m).reshape(-1, 4, 3)
    problem, result = rig.problem, rig.adjustment
    first = len(problem.board_points_m) - 4 * len(told)
    found = warped(problem.board_points_m, result.scene.warp_m)[first:].reshape(told.shape)
    shape = len(problem.free) - len(result.scene.warp_m) - 3 * len(result.scene.base_points_m)
    modes = shape_modes(problem.board_points_m)
    tags = []
    for k, (family, number) in enumerate(rig.platform.names):
        own = slice(WARP + 6 * k, WARP + 6 * k + 6)
        spread = result.covariance[shape + own.start : shape + own.stop]
        spread = spread[:, shape + own.start : shape + own.stop]
        moved = modes[first + 4 * k :][:4, :, own]
        square = np.einsum("cak,kl,cal->", moved, spread, moved) / 4
        tags.append(
            {
                "family": family,
                "id": number,
                "mismatch_mm": 1e3 * rms_distance(found[k] - told[k]),
                "std_mm": 1e3 * float(np.sqrt(square)),
                "corners_platform_m": found[k].tolist(),
                "target_corners_m": told[k].tolist(),
            }
        )
    return {
        "worst_mismatch_mm": max(tag["mismatch_mm"] for tag in tags),
        "tags": tags,
        "covariance": _covariance_entry(rig, rig.platform.names, told),
    }


def _covariance_entry(
    rig: Rig, names: tuple[tuple[str, int], ...], corners_m: Array
) -> dict[str, Any]:
    """Joint covariance of the cameras' numbers and the tags' places.

    The adjustment turns a tag by what moves its corners so far in the mean (`shape_modes`); here
    turns are radians.
    """
    cameras = camera_slices(rig.cameras)[-1].stop
    shape = cameras + WARP
    taken = np.r_[0:cameras, shape : shape + 6 * len(names)]
    arms = corners_m - corners_m.mean(axis=1, keepdims=True)
    reach = np.linalg.norm(arms, axis=2).mean(axis=1)
    units = np.ones(len(taken))
    units[cameras:].reshape(-1, 6)[:, 3:] = 1.0 / reach[:, None]
    covariance = rig.adjustment.covariance[np.ix_(taken, taken)] * np.outer(units, units)
    tags = [entry for family, number in names for entry in tag_entries(family, number)]
    return {
        "tangent": LAYOUT_TANGENT,
        "names": [*named(rig.adjustment.scene)[:cameras], *tags],
        "matrix": covariance.tolist(),
    }


def read_layout(path: Path | str) -> PlatformLayout | None:
    """The layout in a calibration.json, None where it tells none or is not there.

    Raises:
        InputError: when it is not such a document.
    """
    if not Path(path).is_file():
        return None
    try:
        told = json.loads(read_text(path, MOST_BYTES)).get("layout")
        if told is None:
            return None
        tags = told["tags"]
        names = tuple((str(tag["family"]), int(tag["id"])) for tag in tags)
        found, stated = (
            np.array([tag[key] for tag in tags], dtype=np.float64).reshape(len(tags), 4, 3)
            for key in ("corners_platform_m", "target_corners_m")
        )
        covariance = _read_covariance(told.get("covariance"))
    except (ValueError, AttributeError, KeyError, TypeError, OverflowError, RecursionError) as why:
        raise InputError(f"{path}: its layout is not what calibrate writes ({why})") from why
    if not (np.isfinite(found).all() and np.isfinite(stated).all()):
        raise InputError(f"{path}: its layout holds numbers that are not finite")
    return PlatformLayout(names, found, stated, covariance)


def _read_covariance(told: Any) -> CameraCovariance | None:
    """The joint covariance, None where it tells none.

    Raises:
        ValueError: where it is no square of its names.
    """
    if told is None:
        return None
    names = tuple(str(name) for name in told["names"])
    matrix = np.array(told["matrix"], dtype=np.float64)
    if matrix.shape != (len(names), len(names)):
        raise ValueError(f"covariance is {matrix.shape} for {len(names)} names")
    return CameraCovariance(names, matrix)
