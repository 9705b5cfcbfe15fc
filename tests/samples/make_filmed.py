"""Films samples/filmed from a seed: `python -m tests.samples.make_filmed`.

The motions come from the independent integrator in tests/oracle; the pictures from the renderer
in `vision`, squeezed by a codec that loses some of them, as most cameras do.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import write_cameras
from freeswing.cdpr.files.documents import dump_toml
from freeswing.cdpr.files.trajectory_files import write_csv
from freeswing.cdpr.measured.target import Tag, write_target
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.cdpr.rotation import exp_rotation
from freeswing.demo.rig import base_tags, demo_target
from freeswing.vision.look.video import write_stamps
from freeswing.vision.render.patterns import Patch, charuco_patch, tag_patch
from freeswing.vision.render.render_scene import Look, Renderer, Scene, motion_of
from tests.oracle.recorded import session_files as files
from tests.oracle.recorded.sessions import make_scene, tait_bryan
from tests.oracle.scenes.robots import declared_robot, true_body
from tests.oracle.scenes.runs import TrueRun, draw_run
from tests.places import SAMPLES
from tests.vision.scenes import look_at

SEED = 53
ROLES = ("identify", "identify", "identify", "validate")
SIZE_PX = (480, 360)
PLACES_M = {"left": (0.35, -1.95, -0.05), "right": (2.15, -1.9, 0.1)}
LENSES = {
    "left": (470.0, 471.5, 241.3, 177.9, -0.10, 0.03, -4e-4, 2e-4),
    "right": (464.0, 463.0, 238.2, 181.4, -0.12, 0.05, 2e-4, 4e-4),
}
CLOCK_OFFSETS_S = {"left": 0.0, "right": 0.0031}
CENTRE_M = np.array([1.2, -0.15, -0.22])
RATE_HZ = 20.0
FILMED_S = (0.2, 5.6)
BOARD_S = 4.0
BOARD_RATE_HZ = 8.0
SPLINE_HZ = 400.0
TRUTH_STEP = 8  # of those samples, 50 a second
LENGTH_NOISE_M = 3e-4
BOARD = {
    "kind": "charuco",
    "squares": [7, 5],
    "square_m": 0.09,
    "marker_m": 0.07,
    "dictionary": "DICT_4X4_50",
}
LOOK = Look(psf_px=0.6, noise=1.0, texture=6.0)
CODEC = {"preset": "veryslow", "crf": "18", "tune": "grain"}


def main(folder: Path = SAMPLES / "filmed") -> None:
    """Make the sample anew; what is written by hand stays."""
    for part in ("calibration", "runs", "truth"):
        shutil.rmtree(folder / part, ignore_errors=True)
        (folder / part).mkdir(parents=True)
    rng = np.random.default_rng(SEED)
    robot, body = declared_robot("bologna-4"), true_body("bologna-4", rng)
    scene = make_scene(robot, body, {}, rng)
    film(folder / "calibration", _board_scene(), np.arange(BOARD_S * BOARD_RATE_HZ) / BOARD_RATE_HZ)
    tables = []
    for count, role in enumerate(ROLES, start=1):
        name = f"swing-{count:02d}" if role == "identify" else "check-01"
        run = draw_run(scene, rng, FILMED_S[1] + 0.2, SPLINE_HZ)
        motion = _trajectory(run)
        stamps = np.arange(FILMED_S[0], FILMED_S[1], 1.0 / RATE_HZ)
        film(folder / "runs" / name, Scene((*_still(), *_platform()), motion_of(motion)), stamps)
        write_csv(folder / "truth" / f"{name}.csv", _every(motion, TRUTH_STEP))
        told = run.world.length + rng.normal(0.0, LENGTH_NOISE_M, robot.n_cables)
        tables.append(_run_table(name, role, told))
    files.write_robot(folder / "robot.toml", robot)
    write_target(folder / "target.toml", demo_target())
    _write_session(folder, tables)
    _write_truth(folder, body)


def cameras() -> tuple[Camera, ...]:
    """Two distorting lenses that look at the workspace; the clock of one is late."""
    return tuple(
        Camera(
            name,
            SIZE_PX,
            "OPENCV",
            np.array(LENSES[name]),
            look_at(PLACES_M[name], CENTRE_M),
            CLOCK_OFFSETS_S[name],
        )
        for name in PLACES_M
    )


def film(folder: Path, scene: Scene, stamps_s: np.ndarray) -> None:
    """`<camera>.mkv` and `<camera>.csv` of all cameras."""
    folder.mkdir(exist_ok=True)
    for camera in cameras():
        frames = Renderer(camera, scene, LOOK, SEED).frames(stamps_s)
        _squeeze(folder / f"{camera.name}.mkv", camera.size_px, frames)
        write_stamps(folder / f"{camera.name}.csv", stamps_s)


def _squeeze(path: Path, size_px: tuple[int, int], frames: Iterator[np.ndarray]) -> None:
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=Fraction(round(RATE_HZ)), options=CODEC)
        stream.width, stream.height = size_px
        stream.pix_fmt = "gray"
        stream.codec_context.thread_count = 1
        for frame in frames:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="gray")))
        container.mux(stream.encode())


def _trajectory(run: TrueRun) -> Trajectory:
    motion = run.motion
    poses = np.concatenate([motion.positions_m, tait_bryan(motion.quaternions)], axis=1)
    return Trajectory(motion.times_s, POSE_COORDINATES, poses)


def _every(motion: Trajectory, step: int) -> Trajectory:
    return Trajectory(motion.times_s[::step], motion.coordinates, motion.values[::step])


def _board_scene() -> Scene:
    patch = charuco_patch((7, 5), BOARD["square_m"], BOARD["marker_m"], str(BOARD["dictionary"]))
    upright = np.eye(4)
    upright[:3, :3] = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
    return Scene((*_still(), patch.moved(upright, "platform")), _carried)


def _carried(times_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A board held at many places, near and far, tilted every way; never twice the same."""
    t = np.asarray(times_s)
    way = np.stack(
        [0.45 * np.sin(1.9 * t), 0.3 * np.sin(1.3 * t + 1.0), 0.3 * np.sin(2.9 * t + 0.5)], axis=1
    )
    tilt = np.stack(
        [0.5 * np.sin(2.3 * t), 0.3 * np.sin(1.6 * t + 2.0), 0.55 * np.sin(1.2 * t + 0.3)], axis=1
    )
    return CENTRE_M + np.array([0.0, -0.3, 0.0]) + way, exp_rotation(tilt)


def _still() -> list[Patch]:
    return [_patch(tag, "base") for tag in base_tags()]


def _platform() -> list[Patch]:
    return [_patch(tag, "platform") for tag in demo_target().tags]


def _patch(tag: Tag, parent: str) -> Patch:
    return tag_patch(tag.family, tag.id, tag.size_m, tag.T_platform_tag, parent)  # pyright: ignore[reportArgumentType]


def _run_table(name: str, role: str, told: np.ndarray) -> dict[str, object]:
    return {
        "name": name,
        "role": role,
        "cable_lengths_m": np.round(told, 6),
        "cable_lengths_std_m": LENGTH_NOISE_M,
        "window_s": [FILMED_S[0] + 0.05, FILMED_S[1] - 0.1],
        "video": f"runs/{name}",
    }


def _write_session(folder: Path, runs: list[dict[str, object]]) -> None:
    surveyed = [
        {"family": t.family, "id": t.id, "corners_base_m": np.round(t.corners_platform_m, 6)}
        for t in base_tags()
    ]
    calibration = {"recordings": "calibration", "board": BOARD, "base_tags": surveyed}
    session = {
        "format": "freeswing-session/1",
        "name": folder.name,
        "robot": "robot.toml",
        "target": "target.toml",
        "cameras": "cameras.toml",
        "frame_rate_hz": RATE_HZ,
        "calibration": calibration,
        "runs": runs,
    }
    dump_toml(folder / "session.toml", session)


def _write_truth(folder: Path, body) -> None:
    truth = {
        "effects": [],
        "mass_kg": body.mass_kg,
        "com_m": body.com_m,
        "specific_inertia_m2": body.specific_inertia_m2,
    }
    files.write_truth(folder / "truth" / "truth.json", truth)
    write_cameras(folder / "truth" / "cameras.toml", cameras())


if __name__ == "__main__":
    main()
