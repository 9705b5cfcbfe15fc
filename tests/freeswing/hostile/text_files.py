"""Text files of every reader, right before anything is done to them."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from freeswing.calib import exchange
from freeswing.calib.board.declared_board import read_board
from freeswing.calib.board.recordings import Recording
from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import read_cameras, write_cameras
from freeswing.calib.footage.frame_times import frame_times
from freeswing.calib.verdict.calibration_result import read_camera_covariance
from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.files.trajectory_files import read_recording, read_trajectory, write_trc
from freeswing.cdpr.measured.marker_recording import MarkerRecording
from freeswing.cdpr.measured.target import read_target
from freeswing.cdpr.rotation import exp_rotation, transform
from freeswing.homing.homing_files import read_homing
from freeswing.vision.fuse.calibration_share import read_calibration_noise
from tests.places import SAMPLES

CAMERA_FILES = {
    "opencv": "rig.yml",
    "kalibr": "chain.yaml",
    "ros": "info.yaml",
    "anipose": "anipose.toml",
    "qualisys": "rig.qca.txt",
}
APRILGRID = b"""target_type: 'aprilgrid'
tagCols: 6
tagRows: 5
tagSize: 0.055
tagSpacing: 0.3
"""


@dataclass(frozen=True)
class Case:
    """A file that is right, where it stands, and how it is read."""

    name: str
    data: bytes
    read: Callable[[Path], Any]
    beside: tuple[Path, ...] = ()

    def laid(self, folder: Path, data: bytes) -> Path:
        """The file with these bytes in a folder made anew, with what stands beside it."""
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        for other in self.beside:
            shutil.copy(other, folder / other.name)
        (folder / self.name).write_bytes(data)
        return folder / self.name


def cameras(count: int = 2) -> tuple[Camera, ...]:
    lens = np.array([1100.0, 1101.0, 640.25, 511.125, -0.1, 0.05, 1e-3, -2e-3])
    pose = transform(exp_rotation(np.array([0.1, 0.2, 0.3])), np.array([1.0, 2.0, 3.5]))
    return tuple(
        Camera(f"cam{k}", (1280, 1024), "OPENCV", lens, pose, 1e-3 * k) for k in range(count)
    )


def stamps_of(path: Path) -> None:
    """The reader of a recording's stamps."""
    frame_times(Recording("cam0", path.parent / "cam0.mkv", (path,), (0,)), 40.0)


def covariance_of(path: Path) -> None:
    """Both readers of a calibration's covariance."""
    noise = read_calibration_noise(path)
    if noise is not None:
        noise.roots()
    read_camera_covariance(path)


def colmap_of(path: Path) -> None:
    exchange.read(path.parent, "colmap")


def text_cases(folder: Path) -> dict[str, Case]:
    """One case for each kind of text file."""
    found = {
        "robot": Case("robot.toml", (SAMPLES / "mocap-trc/robot.toml").read_bytes(), read_robot),
        "target": Case("target.toml", (SAMPLES / "filmed/target.toml").read_bytes(), read_target),
        "homing": Case(
            "homing.toml",
            (SAMPLES / "homing/homing.toml").read_bytes(),
            read_homing,
            (SAMPLES / "homing/robot.toml", SAMPLES / "homing/readings.csv"),
        ),
        "readings": Case(
            "readings.csv",
            head("homing/readings.csv"),
            lambda path: read_homing(path.parent / "homing.toml"),
            (SAMPLES / "homing/robot.toml", SAMPLES / "homing/homing.toml"),
        ),
        "stamps": Case(
            "cam0.csv",
            b"frame,t_s\n" + b"".join(b"%d,%.3f\n" % (k, k / 40) for k in range(30)),
            stamps_of,
        ),
        "board": Case("april.yaml", APRILGRID, read_board),
        "covariance": Case("calibration.json", covariance_json(), covariance_of),
        "csv": Case("a.csv", head("two-cables/runs/swing-01.csv"), read_trajectory),
        "trc": Case("a.trc", trc_file(folder), read_recording),
    }
    write_cameras(folder / "cameras.toml", cameras())
    found["cameras"] = Case("cameras.toml", (folder / "cameras.toml").read_bytes(), read_cameras)
    for kind, name in CAMERA_FILES.items():
        exchange.write(folder / name, cameras(1 if kind == "ros" else 2), kind)
        data = (folder / name).read_bytes()
        found[kind] = Case(name, data, exchange.read)
        found[f"{kind}, told"] = Case(name, data, lambda path, k=kind: exchange.read(path, k))
    exchange.write(folder / "model", cameras(), "colmap")
    for part, other in (("cameras.txt", "images.txt"), ("images.txt", "cameras.txt")):
        data = (folder / "model" / part).read_bytes()
        found[f"colmap {part}"] = Case(part, data, colmap_of, (folder / "model" / other,))
    return found


def head(name: str) -> bytes:
    return b"".join((SAMPLES / name).read_bytes().splitlines(keepends=True)[:25])


def trc_file(folder: Path) -> bytes:
    whole = read_recording(SAMPLES / "mocap-trc" / "runs" / "swing-01.trc")
    few = MarkerRecording(whole.times_s[:20], whole.names, whole.positions_m[:20])
    write_trc(folder / "few.trc", few)
    return (folder / "few.trc").read_bytes()


def covariance_json() -> bytes:
    names = [f"cam{k}.{entry}" for k in range(2) for entry in ("fx", "fy", "tx_m", "rx_rad")]
    share = {"names": names, "matrix": (1e-6 * np.eye(len(names))).tolist()}
    return json.dumps({"format": "freeswing-calibration/1", "covariance": share}).encode()
