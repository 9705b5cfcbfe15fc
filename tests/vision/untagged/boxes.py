"""A textured platform without tags before three cameras, filmed at rest and swinging."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import write_cameras
from freeswing.vision.render.record import record
from freeswing.vision.render.render_scene import Look, Scene, still
from freeswing.vision.render.textured import textured_box, textured_room
from tests.calib.scene.rooms import looking
from tests.places import ROOT

SIZE_M = (0.30, 0.26, 0.28)
HOME_M = np.array([0.0, 0.0, 1.0])
RATE_HZ = 20.0
REST_FRAMES = 9
LOOK = Look(subpixels=2)
LENS = np.array([1300.0, 1301.0, 322.0, 238.0, -0.05, 0.02, 0.0003, -0.0002])
# Corners of the side that faces the cameras, and one of the lid.
NAMED = {
    "A": (0.15, -0.13, -0.14),
    "B": (0.15, 0.13, -0.14),
    "C": (0.15, 0.13, 0.14),
    "D": (0.15, -0.13, 0.14),
    "E": (-0.15, 0.13, 0.14),
}


def cameras() -> tuple[Camera, ...]:
    """Three, 22 degrees apart, 2 m away and a little above."""
    found = []
    for k, angle in enumerate((-0.38, 0.0, 0.38)):
        eye = (1.9 * np.cos(angle), 1.9 * np.sin(angle), 1.7)
        lens = LENS + np.array([3.0 * k, 3.0 * k, k, -k, 0, 0, 0, 0])
        found.append(Camera(f"cam{k}", (640, 480), "OPENCV", lens, looking(eye, (0.0, 0.0, 1.0))))
    return tuple(found)


def swing(times_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 3) and rotations (n, 3, 3): 70 mm to the sides, some degrees of each angle."""
    from freeswing.cdpr.rotation import exp_rotation

    t = times_s[:, None]
    place = HOME_M + np.array([0.03, 0.07, 0.008]) * np.sin(
        2 * np.pi * np.array([0.6, 0.7, 1.3]) * t + [0.3, 1.0, 0.0]
    )
    turn = np.array([0.06, 0.05, 0.12]) * np.sin(
        2 * np.pi * np.array([0.7, 0.6, 0.9]) * t + [1.0, 0.2, 2.0]
    )
    return place, exp_rotation(turn)


def make(folder: Path, frames: int, *, click_px: float = 0.02, seed: int = 4) -> None:
    """A whole session in a folder, with the cameras as they truly are."""
    rng = np.random.default_rng(seed)
    walls = textured_room((6.0, 6.0, 3.0), 0.02, seed)
    box = textured_box(SIZE_M, 0.004, seed)
    own = cameras()
    stamps = np.arange(frames) / RATE_HZ
    record(folder / "runs/a", own, Scene(walls + box, swing), stamps, LOOK, seed)
    home = Scene(walls + box, still(HOME_M))
    moments = np.zeros(REST_FRAMES)
    record(folder / "rest", own, home, moments, LOOK, seed + 1, images=True, stamps_file=False)
    rows = ["camera,point,u_px,v_px,std_px"]
    for camera in own:
        for name, place in NAMED.items():
            pixel = camera.project(camera.to_camera(HOME_M + place))
            u, v = pixel + click_px * rng.normal(size=2)
            rows.append(f"{camera.name},{name},{u:.4f},{v:.4f},{click_px}")
    (folder / "clicks.csv").write_text("\n".join(rows) + "\n")
    target = [
        'format = "freeswing-target/1"',
        "[untagged]",
        'rest = "rest"',
        'clicks = "clicks.csv"',
    ]
    for name, place in NAMED.items():
        target += ["[[untagged.points]]", f'name = "{name}"', f"position_m = {list(place)}"]
    (folder / "target.toml").write_text("\n".join(target) + "\n")
    (folder / "session.toml").write_text(
        'format = "freeswing-session/1"\nname = "box"\nrobot = "robot.toml"\n'
        'target = "target.toml"\ncameras = "cameras.toml"\nframe_rate_hz = 20.0\n'
        '[[runs]]\nname = "a"\nrole = "identify"\nvideo = "runs/a"\n'
    )
    shutil.copy(ROOT / "samples/filmed/robot.toml", folder / "robot.toml")
    write_cameras(folder / "cameras.toml", own)
