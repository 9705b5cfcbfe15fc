"""Files of every further reader, right as they stand: footage, meshes, results."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import trimesh
from trimesh.exchange.ply import export_ply

from freeswing.calib.board.board_corners import BoardDetector
from freeswing.calib.board.declared_board import board_from
from freeswing.calib.board.kept_boards import KeptBoards
from freeswing.calib.board.recordings import Recording, find_recordings, read_frames
from freeswing.calib.exchange import colmap_binary
from freeswing.calib.footage.first_frames import condition_of
from freeswing.calib.footage.frame_times import frame_times
from freeswing.calib.verdict.plumb_line_file import read_plumb_line
from freeswing.cdpr.files.drive_csv import read_drive_run, read_static, run_columns, static_columns
from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.files.signal_csv import read_signals
from freeswing.cdpr.files.trajectory_csv import csv_pieces
from freeswing.cdpr.files.trajectory_files import (
    read_recording,
    read_trajectory,
    write_c3d,
    write_tum,
)
from freeswing.cdpr.measured.target import Target, read_target
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.mesh.nominal_inertia import platform_from_mesh
from freeswing.results.comparison import read_side
from freeswing.servo.files.controller_file import read_controller
from freeswing.servo.files.task_file import read_task
from freeswing.servo.files.weights_file import read_weights
from freeswing.servo.files.wrench_file import COLUMNS, read_wrenches
from freeswing.session.drive_session import read_drive_session
from freeswing.session.session_file import read_session
from freeswing.vision.look.follow import Follower, FrameView
from freeswing.vision.look.pieces import Piece, is_whole, load_piece, restore, save_piece
from freeswing.vision.look.video import write_video
from freeswing.vision.look.watched_target import Watch
from tests.calib.films import BOARD
from tests.cdpr.files.test_mocap_exports import EXPORTS, body
from tests.freeswing.hostile.text_files import Case, cameras
from tests.freeswing.report.report_material import whole_material
from tests.ident.drive.made_sessions import TOML
from tests.places import SAMPLES
from tests.vision.loops import small_cameras
from tests.vision.scenes import platform_tags

PLUMB = "camera,u_px,v_px\n" + "".join(
    f"{name},{100 + 3 * k},{50 + 60 * k}\n" for name in ("left", "right") for k in range(8)
)


def footage(path: Path) -> None:
    """All that is asked of a recording: times, condition, every frame."""
    for recording in find_recordings(path.parent):
        frame_times(recording, None)
        condition_of(recording)
        for _ in read_frames(recording):
            pass


def piece_of_boards(path: Path) -> None:
    recording = Recording("cam0", path)
    kept = KeptBoards(BoardDetector(board_from(BOARD)), path.parent, recording, 2)
    kept._inputs = "0"
    shutil.copy(path, path.with_name("cam0-0-000000.npz"))
    kept._load()


def more_cases(folder: Path) -> dict[str, Case]:
    """One case for each kind of file that `text_cases` does not have."""
    found = {**_videos(folder), **_images(folder), **_meshes(), **_motions(folder)}
    found |= {**_driven(), **_results(), **_pieces(folder)}
    for name in ("filmed", "two-cables"):
        data = (SAMPLES / name / "session.toml").read_bytes()
        found[f"session {name}"] = Case("session.toml", data, read_session)
    found["plumb line"] = Case(
        "plumb_line.csv", PLUMB.encode(), lambda path: read_plumb_line(path, ("left", "right"))
    )
    try:
        colmap_binary.write(folder / "model", cameras())
    except ImportError:
        return found
    for part in ("cameras", "images"):
        others = tuple(p for p in (folder / "model").iterdir() if p.stem != part)
        data = (folder / "model" / f"{part}.bin").read_bytes()
        found[f"colmap {part}.bin"] = Case(
            f"{part}.bin",
            data,
            lambda path: colmap_binary.read(path.parent, lambda _: None),
            others,
        )
    return found


def _videos(folder: Path) -> dict[str, Case]:
    frames = np.random.default_rng(0).integers(0, 255, (12, 48, 64), dtype=np.uint8)
    kinds = {"mkv": "ffv1", "avi": "ffv1", "mp4": "mpeg4", "mov": "mjpeg"}
    found = {}
    for suffix, codec in kinds.items():
        path = folder / f"cam0.{suffix}"
        if codec == "ffv1":
            write_video(path, iter(frames), np.arange(12) / 40.0)
        else:
            _write_colour(path, frames, codec)
        found[f"video {suffix}"] = Case(path.name, path.read_bytes(), footage)
    return found


def _nobody(said: str) -> None:
    """Is told."""


def _write_colour(path: Path, frames: np.ndarray, codec: str) -> None:
    import av

    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=40)
        assert isinstance(stream, av.VideoStream)
        stream.width, stream.height = 64, 48
        stream.pix_fmt = "yuvj420p" if codec == "mjpeg" else "yuv420p"
        for frame in frames:
            picture = av.VideoFrame.from_ndarray(np.repeat(frame[..., None], 3, 2), "rgb24")
            container.mux(stream.encode(picture))
        container.mux(stream.encode())


def _images(folder: Path) -> dict[str, Case]:
    image = np.random.default_rng(1).integers(0, 255, (48, 64), dtype=np.uint8)
    found = {}
    for suffix in ("png", "jpg", "tif", "bmp", "pgm"):
        path = folder / f"a.{suffix}"
        cv2.imwrite(str(path), image)

        def read(path: Path) -> None:
            for _ in read_frames(Recording("cam0", path.parent, (path,), (0,))):
                pass

        found[f"image {suffix}"] = Case(f"000000.{suffix}", path.read_bytes(), read)
    return found


def _meshes() -> dict[str, Case]:
    box = trimesh.creation.box((0.4, 0.3, 0.2))
    found = {}
    for kind, suffix in (("stl", "stl"), ("stl_ascii", "stl"), ("obj", "obj"), ("off", "off")):
        data = box.export(file_type=kind)
        data = data.encode() if isinstance(data, str) else bytes(data)
        found[f"mesh {kind}"] = Case(f"body.{suffix}", data, platform_from_mesh)
    for encoding in ("ascii", "binary"):
        data = export_ply(box, encoding=encoding)
        found[f"mesh ply {encoding}"] = Case("body.ply", data, platform_from_mesh)
    return found


def _motions(folder: Path) -> dict[str, Case]:
    robot = read_robot(SAMPLES / "mocap-trc/robot.toml")
    target = read_target(SAMPLES / "mocap-trc/target.toml")
    recording = read_recording(SAMPLES / "mocap-trc" / "runs" / "swing-01.trc")
    few = replace(recording, times_s=recording.times_s[:20], positions_m=recording.positions_m[:20])
    write_c3d(folder / "few.c3d", few)
    motion = read_trajectory(SAMPLES / "two-cables/runs/swing-01.csv").take(np.arange(20))
    write_tum(folder / "few.tum", motion)
    head = b"".join(
        (SAMPLES / "two-cables/runs/swing-01.csv").read_bytes().splitlines(keepends=True)[:25]
    )
    return {
        "c3d": Case("a.c3d", (folder / "few.c3d").read_bytes(), read_recording),
        "c3d as a motion": Case(
            "a.c3d",
            (folder / "few.c3d").read_bytes(),
            lambda path: read_trajectory(path, robot, target),
        ),
        "tum": Case("a.tum", (folder / "few.tum").read_bytes(), read_trajectory),
        "signals": Case("a.csv", head, read_signals),
        "free coordinates": Case(
            "a.csv", free_csv(motion), lambda path: read_trajectory(path, robot)
        ),
        **_exports(),
    }


def free_csv(motion: Trajectory) -> bytes:
    """The same motion, x and y alone."""
    return b"".join(csv_pieces(motion.select(("x", "y"))))


def _exports() -> dict[str, Case]:
    """What motion-capture programs write as text; markers, and a rigid body as a pose."""
    found = {
        f"export {name}": Case(name, text.encode(), read_recording)
        for name, text in EXPORTS.items()
    }
    return {**found, "export body": Case("body.csv", body().encode(), read_trajectory)}


def _driven() -> dict[str, Case]:
    columns = run_columns(8)
    rows = [",".join(columns)]
    for k in range(60):
        values = {"t_s": 0.001 * k, "qw": 1.0}
        rows.append(",".join(f"{values.get(name, 0.1 * (name[0] != 'q')):.6g}" for name in columns))
    run = "\n".join([*rows, ""]).encode()
    pose = ["0"] * 3 + ["1"] + ["0"] * 3
    still = [",".join(["0.5"] * 16 + pose)] * 12
    static = "\n".join([",".join(static_columns(8)), *still, ""]).encode()
    robot = SAMPLES / "inca-6d" / "robot.toml"
    toml = TOML.partition("[static]")[0] + '[[runs]]\nname = "a"\nrole = "identify"\nfile = '
    toml += '"a.csv"\n[[runs]]\nname = "b"\nrole = "validate"\nfile = "a.csv"\n'

    def session(path: Path) -> None:
        (path.parent / "a.csv").write_bytes(run)
        read_drive_session(path)

    head = "\n".join([",".join(COLUMNS), ",".join(["0", "0", "0", "1", *"000123000"])]) + "\n"
    controller = {
        "format": "freeswing-controller/1",
        "sample_rate_hz": 200.0,
        "order": 2,
        **{key: np.zeros(shape).tolist() for key, shape in _SHAPES.items()},
        "operating_point": {k: [0.0] * n for k, n in _POINT.items()},
    }
    return {
        "drive run": Case("a.csv", run, lambda path: read_drive_run(path, 8)),
        "drive static": Case("a.csv", static, lambda path: read_static(path, 8)),
        "drive.toml": Case("drive.toml", toml.encode(), session, (robot,)),
        "driven robot": Case("robot.toml", robot.read_bytes(), read_robot),
        "task": Case("task.toml", (SAMPLES / "inca-6d/task.toml").read_bytes(), read_task),
        "weights": Case(
            "weights.toml", (SAMPLES / "inca-6d/weights.toml").read_bytes(), read_weights
        ),
        "wrenches": Case(
            "w.csv", head.encode(), lambda path: read_wrenches(path, np.full(3, 1.0), 100.0)
        ),
        "controller": Case("controller.json", json.dumps(controller).encode(), read_controller),
    }


_POINT = {"wrench": 6, "position_m": 3, "angles_rad": 3}
_SHAPES = {"A": (2, 2), "B": (2, 6), "C": (6, 2), "D": (6, 6)}


def _results() -> dict[str, Case]:
    from freeswing.report.material import read_material
    from freeswing.report.page import render_page

    material, found = whole_material(), {}
    for kind in ("calibration", "tracking", "identification", "diagnosis", "motion"):
        data = json.dumps(getattr(material, kind).to_json()).encode()
        found[f"result {kind}"] = Case(
            f"{kind}.json", data, lambda path: render_page(read_material("a", path.parent))
        )
    identification = material.identification
    assert identification is not None
    data = json.dumps(identification.to_json()).encode()
    found["compared"] = Case("identification.json", data, lambda path: read_side(str(path.parent)))
    return found


def _pieces(folder: Path) -> dict[str, Case]:
    detector = BoardDetector(board_from(BOARD))
    recording = Recording("cam0", folder / "a.png")
    (folder / "a.png").touch()
    kept = KeptBoards(detector, folder / "kept", recording, 2)
    for _ in range(2):
        kept.look(np.zeros((48, 64), dtype=np.uint8))
    (path,) = (folder / "kept").iterdir()
    seen = _sightings(folder / "seen.npz")
    return {
        "piece of boards": Case("piece.npz", path.read_bytes(), piece_of_boards),
        "piece of sightings": Case("piece.npz", seen, piece_of_sightings),
    }


@cache
def a_follower() -> Follower:
    return Follower(small_cameras(1)[0], Watch.of(Target(platform_tags())))


def piece_of_sightings(path: Path) -> None:
    if is_whole(path):
        load_piece(path)
        restore(a_follower(), path)


def _sightings(path: Path) -> bytes:
    blank = FrameView(0, (), (np.eye(3), np.ones(3)))
    follower = a_follower()
    save_piece(path, Piece.of(range(4), [0.0, 0.1, 0.2, 0.3], [blank] * 4), follower)
    return path.read_bytes()
