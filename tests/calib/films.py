"""Rendered calibration recordings with known truth, and how the result compares with it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from freeswing.calib.calibrate import CalibrationResult, calibrate_session
from freeswing.calib.camera.camera import Camera
from freeswing.calib.rig.solve_rig import Rig
from freeswing.vision.render.patterns import Patch, charuco_patch
from freeswing.vision.render.record import record
from freeswing.vision.render.render_scene import Look, Scene
from tests.calib import rigs

FLIP = np.diag([1.0, -1.0, -1.0, 1.0])
BOARD = {
    "kind": "charuco",
    "squares": [6, 5],
    "square_m": 0.12,
    "marker_m": 0.09,
    "dictionary": "DICT_5X5_100",
}
CLOCKS = ((0.0, 0.0), (0.0043, 0.0), (-0.0068, 1.6e-5))


def small_rig(count: int, seed: int = 0) -> tuple[Camera, ...]:
    """Cameras of 800 x 640 pixels with lenses that bend, around the origin."""
    scale = np.array([0.625] * 4 + [1.0] * 4)
    return tuple(
        replace(camera, size_px=(800, 640), params=camera.params * scale)
        for camera in rigs.rig(count, seed, arc_rad=0.9)
    )


def free_running(cameras: tuple[Camera, ...]) -> tuple[Camera, ...]:
    """The same cameras with clocks of their own, one with a rolling shutter."""
    return tuple(
        replace(camera, clock_offset_s=offset, line_time_s=line)
        for camera, (offset, line) in zip(cameras, CLOCKS, strict=True)
    )


def calibrate_still(folder: Path, cameras: tuple[Camera, ...], count: int, seed: int) -> Rig:
    """Films a board that rests in `count` poses and calibrates from the images."""
    boards = rigs.poses(cameras, count, seed + 50) @ FLIP

    def motion(times_s):
        index = np.clip(np.round(times_s).astype(int), 0, count - 1)
        return boards[index, :3, 3], boards[index, :3, :3]

    scene = Scene((patch(),), motion)
    stamps = np.arange(float(count))
    record(folder, cameras, scene, stamps, Look(), seed, images=True, stamps_file=False)
    return calibrate_session(folder, BOARD).rig


def calibrate_moving(
    folder: Path, cameras: tuple[Camera, ...], rate_hz: float, count: int, seed: int
) -> CalibrationResult:
    """Films a board waved by hand with every camera's own clock and calibrates from the videos."""
    hand = rigs.hand_motion(cameras, seed)

    def motion(times_s):
        places, turns = hand(times_s)
        return places, turns @ FLIP[:3, :3]

    record(folder, cameras, Scene((patch(),), motion), np.arange(count) / rate_hz, Look(), seed)
    return calibrate_session(folder, BOARD, frame_rate_hz=rate_hz)


def patch() -> Patch:
    """The board, its print facing the cameras."""
    return charuco_patch(
        tuple(BOARD["squares"]), BOARD["square_m"], BOARD["marker_m"], BOARD["dictionary"]
    )
