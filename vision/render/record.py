"""Writes a rendered recording in the layout that sessions have."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.camera import Camera
from freeswing.vision.look.video import write_stamps, write_video
from freeswing.vision.render.render_scene import Look, Renderer, Scene

Array = NDArray[np.float64]


def record(
    folder: Path,
    cameras: Sequence[Camera],
    scene: Scene,
    stamps_s: Array,
    look: Look | None = None,
    seed: int = 0,
    *,
    images: bool = False,
    stamps_file: bool = True,
    suffix: str = ".mkv",
) -> None:
    """Films the scene with every camera: `<camera>.mkv` (FFV1) or `<camera>/*.png`, and stamps.

    `.avi` (MagicYUV) is written and read four times as fast and takes a fifth more room.

    Args:
        folder: the run's or the calibration's folder; made when absent.
        cameras: the true cameras, clocks included.
        scene: what they see.
        stamps_s: each frame's stamp by the camera's own clock, (n,).
        look: the sensors.
        seed: decides noise and background.
        images: numbered PNG files instead of a video.
        stamps_file: whether `<camera>.csv` is written.
        suffix: of the videos.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for camera in cameras:
        frames = Renderer(camera, scene, look or Look(), seed).frames(stamps_s)
        if images:
            place = folder / camera.name
            place.mkdir(exist_ok=True)
            for index, frame in enumerate(frames):
                cv2.imwrite(str(place / f"{index:06d}.png"), frame)
        else:
            write_video(folder / f"{camera.name}{suffix}", frames, stamps_s)
        if stamps_file:
            write_stamps(folder / f"{camera.name}.csv", stamps_s)
