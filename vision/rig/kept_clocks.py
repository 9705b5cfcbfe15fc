"""Clocks that the swings told, for cameras.toml: what all runs agree on is the camera's own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.vision.rig.rig_step import Finding

MOST_APART_S = 1e-3
"""Cameras of one trigger keep their clocks from run to run to microseconds, free-running ones drift
by less than this in an hour; ones started by hand differ by tenths of a second."""


def with_kept_clocks(
    cameras: Sequence[Camera],
    seen: Mapping[str, Sequence[str]],
    findings: Mapping[str, Sequence[Finding]],
) -> tuple[tuple[Camera, ...], list[str]]:
    """Cameras with the clocks that all runs ask for, and what was done.

    Args:
        cameras: as the runs were tracked with them.
        seen: names of the cameras of each run.
        findings: of each run.

    A clock that differs between the runs is no property of the camera: it is left, and said.
    """
    kept, said = [], []
    for camera in cameras:
        runs = [run for run, names in seen.items() if camera.name in names]
        found = {
            run: finding.parameters[0][1]
            for run, own in findings.items()
            for finding in own
            if finding.effect == "clock_offset" and finding.camera == camera.name
        }
        offsets = np.array([found.get(run, 0.0) for run in runs])
        kept.append(camera)
        if not offsets.any():
            continue
        if np.ptp(offsets) > MOST_APART_S:
            said.append(
                f"camera {camera.name}: its clock differs between the runs by "
                f"{np.ptp(offsets):.3g} s: not written"
            )
            continue
        clock = camera.clock_offset_s + float(np.mean(offsets))
        kept[-1] = replace(camera, clock_offset_s=clock)
        said.append(f"camera {camera.name}: clock_offset_s = {clock:.6f} from {len(runs)} runs")
    return tuple(kept), said
