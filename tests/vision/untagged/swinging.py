"""A textured box without tags on a cable robot that really swings, filmed by three cameras.

The swings are those of the independent integrator in tests/oracle; lengths are told with errors.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import write_cameras
from freeswing.cdpr.files.documents import dump_toml
from freeswing.cdpr.rotation import transform
from freeswing.vision.render.record import record
from freeswing.vision.render.render_scene import Look, Scene, motion_of
from freeswing.vision.render.textured import textured_box, textured_room
from tests.calib.scene.rooms import looking
from tests.oracle.recorded import session_files as files
from tests.oracle.recorded.sessions import make_scene
from tests.oracle.scenes.robots import declared_robot, true_body
from tests.oracle.scenes.runs import TrueRun, draw_run
from tests.samples.make_filmed import _trajectory

RATE_HZ = 20.0
SECONDS = 4.0
LENGTH_NOISE_M = 3e-4
REST_FRAMES = 9
LOOK = Look(subpixels=2)
SIZE_M = (0.30, 0.26, 0.28)
MIDDLE_M = np.array([1.15, -0.12, -0.45])  # between the robot's rest poses
NEAR_M = 0.26  # rest poses farther from there are not filmed: pictures are small
LENS = np.array([1000.0, 1001.0, 402.0, 298.0, -0.05, 0.02, 0.0003, -0.0002])
NAMED = {
    "A": (-0.15, -0.13, -0.14),
    "B": (0.15, -0.13, -0.14),
    "C": (0.15, -0.13, 0.14),
    "D": (-0.15, -0.13, 0.14),
    "E": (0.15, 0.13, 0.14),
    "F": (-0.15, 0.13, 0.14),
}


def cameras() -> tuple[Camera, ...]:
    """Three, 22 degrees apart, 2 m in front of the platform and above it."""
    found = []
    for k, angle in enumerate((-0.38, 0.0, 0.38)):
        eye = MIDDLE_M + np.array([2.0 * np.sin(angle), -2.0 * np.cos(angle), 0.7])
        lens = LENS + np.array([3.0 * k, 3.0 * k, k, -k, 0, 0, 0, 0])
        pose = looking(tuple(eye), tuple(MIDDLE_M))
        found.append(Camera(f"cam{k}", (800, 600), "OPENCV", lens, pose))
    return tuple(found)


def near_run(scene, rng: np.random.Generator) -> TrueRun:
    """A run whose platform rests where the cameras look."""
    while True:
        run = draw_run(scene, rng, SECONDS + 0.4, 400.0)
        if np.abs(run.rest.position_m - MIDDLE_M).max() < NEAR_M:
            return run


def rest_pose(run: TrueRun) -> tuple[np.ndarray, np.ndarray]:
    w, x, y, z = run.rest.quaternion
    return run.rest.position_m, Rotation.from_quat([x, y, z, w]).as_matrix()


def make(folder: Path, roles: tuple[str, ...], click_px: float, seed: int):
    """A whole session, cameras as they truly are; gives the true body and motions by run."""
    rng = np.random.default_rng(seed)
    robot, body = declared_robot("bologna-4"), true_body("bologna-4", rng)
    scene = make_scene(robot, body, {}, rng)
    place = transform(np.eye(3), MIDDLE_M - [0.0, 0.0, 1.5])
    walls = tuple(
        tile.moved(place @ tile.T_parent_patch, "base")
        for tile in textured_room((6.0, 6.0, 3.0), 0.02, seed)
    )
    box, own = textured_box(SIZE_M, 0.004, seed), cameras()
    runs = [near_run(scene, rng) for _ in roles]
    at, turn = rest_pose(runs[0])
    home = Scene(walls + box, lambda t: (np.tile(at, (len(t), 1)), np.tile(turn, (len(t), 1, 1))))
    record(folder / "rest", own, home, np.zeros(REST_FRAMES), LOOK, seed + 1,
           images=True, stamps_file=False)  # fmt: skip
    write_clicks(folder / "clicks.csv", own, at, turn, click_px, rng)
    tables, motions = [], {}
    for number, (role, run) in enumerate(zip(roles, runs, strict=True), start=1):
        name = f"{'swing' if role == 'identify' else 'check'}-{number:02d}"
        motions[name] = motion_of(_trajectory(run))
        stamps = 0.2 + np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
        record(folder / "runs" / name, own, Scene(walls + box, motions[name]), stamps, LOOK, number)
        told = run.world.length + rng.normal(0.0, LENGTH_NOISE_M, robot.n_cables)
        tables.append(
            {
                "name": name,
                "role": role,
                "cable_lengths_m": np.round(told, 6),
                "cable_lengths_std_m": LENGTH_NOISE_M,
                "window_s": [0.25, 0.15 + SECONDS],
                "video": f"runs/{name}",
            }
        )
    write_cameras(folder / "cameras.toml", own)
    files.write_robot(folder / "robot.toml", robot)
    write_documents(folder, tables)
    return body, motions


def write_clicks(path: Path, own, at, turn, click_px: float, rng: np.random.Generator) -> None:
    """Marks of the corners that each camera sees, with such errors."""
    rows = ["camera,point,u_px,v_px,std_px"]
    for camera in own:
        for name, place in NAMED.items():
            pixel = camera.project(camera.to_camera(at + turn @ np.array(place)))
            u, v = pixel + click_px * rng.normal(size=2)
            rows.append(f"{camera.name},{name},{u:.4f},{v:.4f},{click_px}")
    path.write_text("\n".join(rows) + "\n")


def write_documents(folder: Path, tables: list[dict]) -> None:
    points = [{"name": name, "position_m": list(place)} for name, place in NAMED.items()]
    untagged = {"rest": "rest", "clicks": "clicks.csv", "points": points}
    dump_toml(folder / "target.toml", {"format": "freeswing-target/1", "untagged": untagged})
    dump_toml(
        folder / "session.toml",
        {
            "format": "freeswing-session/1",
            "name": "box",
            "robot": "robot.toml",
            "target": "target.toml",
            "cameras": "cameras.toml",
            "frame_rate_hz": RATE_HZ,
            "runs": tables,
        },
    )
