"""Numbers of a lens that no lens on such a sensor has: of another file, unit or model."""

from __future__ import annotations

import numpy as np

from freeswing.calib.camera.lens_models import Array, focal_and_centre, normalise
from freeswing.cdpr.files.documents import Reader

# Focal length over the longer side: a fisheye of 220 degrees has 0.25, a lens of one degree 57.
SHORTEST_FOCAL = 0.1  # of the larger side of the image: a fisheye has three times as much
LONGEST_FOCAL = 100.0  # a telescope; what is longer is in millimetres or of another camera
HALFWAY = 0.5  # of the way from the middle to the corners every usable calibration reaches
LEAST_SEEN = 0.3  # of a pinhole's angle there: the worst pincushion of a lens leaves 0.8


def question_lens(entry: Reader, model: str, size_px: Array, params: Array) -> None:
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
