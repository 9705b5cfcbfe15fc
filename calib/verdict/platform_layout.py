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
from freeswing.calib.rig.reprojection import shape_modes, warped
from freeswing.calib.rig.reprojection_kernels import WARP
from freeswing.calib.rig.solve_rig import Rig
from freeswing.calib.verdict.calibration_result import MOST_BYTES
from freeswing.calib.verdict.survey_check import rms_distance
from freeswing.cdpr.files.documents import InputError, read_text


@dataclass(frozen=True, slots=True)
class PlatformLayout:
    """The platform's tags as a calibration found them.

    Attributes:
        names: family and id of each.
        corners_platform_m: as found, TL TR BR BL, (n, 4, 3).
        target_corners_m: as target.toml had them then, (n, 4, 3).
    """

    names: tuple[tuple[str, int], ...]
    corners_platform_m: Array
    target_corners_m: Array


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
    return {"worst_mismatch_mm": max(tag["mismatch_mm"] for tag in tags), "tags": tags}


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
    except (ValueError, AttributeError, KeyError, TypeError, OverflowError, RecursionError) as why:
        raise InputError(f"{path}: its layout is not what calibrate writes ({why})") from why
    if not (np.isfinite(found).all() and np.isfinite(stated).all()):
        raise InputError(f"{path}: its layout holds numbers that are not finite")
    return PlatformLayout(names, found, stated)
