"""Tags where a calibration has them: cameras that were tied by the platform fit no others."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from freeswing.calib.verdict.platform_layout import read_layout
from freeswing.vision.look.watched_target import Watch

SAME_PLACE_M = 1e-6
"""Files hold nanometres, and whoever measures a tag anew does not hit the old micrometre."""


def tied_watch(watch: Watch, calibration: Path) -> tuple[Watch, list[str]]:
    """The watch with the platform's tags where a calibration found them, and what to say of it.

    Cameras of a ring see different tags. Where these tied them, what target.toml is off by went
    into the tags' places; with its own places the same cameras contradict each other.

    Args:
        watch: what target.toml says.
        calibration: results/calibration.json; the watch stays where it tells no layout.

    Raises:
        InputError: when it is not what calibrate writes.
    """
    layout = read_layout(calibration)
    if layout is None:
        return watch, []
    corners = watch.tag_corners_m.copy()
    moved = []
    for key, found, stated in zip(
        layout.names, layout.corners_platform_m, layout.target_corners_m, strict=True
    ):
        if key not in watch.tags:
            continue
        at = watch.tags.index(key)
        if np.abs(watch.tag_corners_m[at] - stated).max() > SAME_PLACE_M:
            moved.append(f"{key[0]} {key[1]}")
        corners[at] = found
    if moved:
        return watch, [
            f"target.toml has {', '.join(moved)} elsewhere than when calibrate tied the cameras by "
            "the platform's tags: calibrate again"
        ]
    return replace(watch, tag_corners_m=corners), []
