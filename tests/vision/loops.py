"""Long recordings made cheaply: a motion that repeats, filmed once and played again and again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import write_cameras
from freeswing.cdpr.files.documents import dump_toml
from freeswing.cdpr.files.robot_file import write_robot
from freeswing.cdpr.measured.target import Target, write_target
from freeswing.cdpr.rotation import exp_rotation
from freeswing.vision.look.video import write_video
from freeswing.vision.render.render_scene import Look, Renderer
from tests.oracle.scenes.robots import declared_robot
from tests.vision.scenes import arc_of_cameras, platform_tags, scene_of

RATE_HZ = 50.0
PERIOD = 50
TARGET = Target(platform_tags())


def small_cameras(count: int) -> tuple[Camera, ...]:
    """Cameras of 200 x 160 pixels."""
    return arc_of_cameras(
        count, 1.9, size_px=(200, 160), params=[250.0, 250.0, 99.5, 79.5, -0.1, 0.03, 0.0, 0.0]
    )


def repeating(times_s):
    """A swing of one second's period: positions (n, 3), rotations (n, 3, 3)."""
    t = 2 * np.pi * np.asarray(times_s, float)[:, None] * RATE_HZ / PERIOD
    way = [0.05, 0.03, 0.02] * np.sin(t * [1, 2, 1] + [0.0, 1.0, 2.0])
    turn = [0.05, 0.08, 0.06] * np.sin(t * [1, 1, 2] + [0.5, 0.0, 1.5])
    return way, exp_rotation(turn)


def write_looped_session(folder: Path, cameras: Sequence[Camera], frames: int) -> Path:
    """A tracked-ready session of one run of so many frames a camera; its folder."""
    scene = scene_of(TARGET.tags, motion=repeating)
    for camera in cameras:
        renderer = Renderer(camera, scene, Look(noise=2.0, subpixels=3), 7)
        once = [renderer.frame(k / RATE_HZ, k) for k in range(PERIOD)]
        path = folder / "runs" / "long" / f"{camera.name}.mkv"
        write_video(path, _again(once, frames), np.arange(frames) / RATE_HZ)
    write_cameras(folder / "cameras.toml", tuple(cameras))
    write_target(folder / "target.toml", TARGET)
    write_robot(folder / "robot.toml", declared_robot("bologna-4"))
    session = {
        "format": "freeswing-session/1",
        "name": "long",
        "robot": "robot.toml",
        "target": "target.toml",
        "cameras": "cameras.toml",
        "frame_rate_hz": RATE_HZ,
        "runs": [{"name": "long", "role": "identify", "video": "runs/long"}],
    }
    dump_toml(folder / "session.toml", session)
    return folder


def _again(once: list[np.ndarray], frames: int) -> Iterator[np.ndarray]:
    return (once[k % len(once)] for k in range(frames))
