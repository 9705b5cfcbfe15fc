"""A plate on three strings as two cameras film it, with what `freeswing new` printed on it.

The base frame is that of the hung tag, the platform frame that of the printed sheet, as the files
of `new` say; the truth is known here alone.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from freeswing.calib.board.declared_board import board_from
from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.measured.target import read_target
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import Array, Cable, Platform, Robot
from freeswing.cdpr.rotation import exp_rotation
from freeswing.session.session_file import Session, read_session
from freeswing.vision.render.patterns import Patch, charuco_patch, tag_patch
from freeswing.vision.render.record import record
from freeswing.vision.render.render_scene import Look, Scene, motion_of
from tests.vision.scenes import look_at

SECOND_TAG_M = (1.2, 0.0, 0.1)
MIDDLE_M = np.array([0.6, -0.9, -0.25])  # of the plate
SHEET_M = np.array([0.0, -0.15, 0.0])  # its cross from the plate's middle, on the front
SIZE_PX, RATE_HZ, SECONDS = (1024, 576), 20.0, 5.0
BOARD_SECONDS = 12.0
LOOK = Look(psf_px=0.6, noise=1.5, texture=8.0)
# Axes of the sheet in the plate's at rest: x to the right, y up, z towards the cameras.
SHEET_AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
COM_M = np.array([0.012, -0.008, -0.04])  # from the plate's middle, its own axes
MOMENTS_M2 = np.array([0.0125, 0.0135, 0.024])  # about it, over the mass
PLACES_M = ((0.0, 0.0), (0.1, 0.05), (-0.09, 0.08), (0.02, -0.1), (-0.07, -0.05), (0.06, 0.09))


@dataclass(frozen=True, slots=True)
class Plate:
    """The robot as a person would measure it, and what it really weighs and is."""

    robot: Robot
    inertia: Array


def plate() -> Plate:
    """Three strings of about 1.1 m."""
    angles = np.deg2rad([90.0, 210.0, 330.0])
    around = np.stack([np.cos(angles), np.sin(angles), np.zeros(3)], axis=1)
    com = SHEET_AXES @ (COM_M - SHEET_M)
    tensor = SHEET_AXES @ np.diag(MOMENTS_M2) @ SHEET_AXES.T
    tensor = tensor + com @ com * np.eye(3) - np.outer(com, com)
    entries = [*tensor.diagonal(), tensor[0, 1], tensor[0, 2], tensor[1, 2]]
    cables = tuple(
        Cable(
            str(k + 1),
            MIDDLE_M + np.array([0.0, 0.0, 1.05]) + 0.6 * place,
            0.0,
            SHEET_AXES @ (0.2 * place - SHEET_M),
        )
        for k, place in enumerate(around)
    )
    return Plate(
        Robot("plate", cables, platform=Platform(4.0, com, np.array(entries))),
        np.array([*com, *entries]),
    )


def fill_in(folder: Path, robot: Robot) -> None:
    """What a person measures goes where the files say nan."""
    text = (folder / "robot.toml").read_text(encoding="utf-8")
    head, *tables = text.split("[[cables]]")
    for k, cable in enumerate(robot.cables):
        for key in ("entry_m", "attachment_m"):
            value = np.round(getattr(cable, key), 6).tolist()
            tables[k] = re.sub(rf"(?m)^{key} = \[.*?\]", f"{key} = {value}", tables[k])
    (folder / "robot.toml").write_text("[[cables]]".join([head, *tables]), encoding="utf-8")
    path = folder / "session.toml"
    told = path.read_text(encoding="utf-8").replace("[nan, nan, nan]", str(list(SECOND_TAG_M)))
    path.write_text(told, encoding="utf-8")


def film_everything(folder: Path) -> None:
    """The board and all runs, by the files that `new` wrote and a person filled in."""
    session, body = read_session(folder), plate()
    record(
        folder / "calibration",
        _cameras(),
        _board_scene(session),
        _stamps(0.0, BOARD_SECONDS, 10.0),
        LOOK,
    )
    sheet = [
        tag_patch(tag.family, tag.id, tag.size_m, tag.T_platform_tag)
        for tag in read_target(folder / "target.toml").tags
    ]
    for k, run in enumerate(session.runs):
        assert run.video is not None
        scene = Scene((*_wall(session), *sheet), motion_of(_swing(body, k)))
        record(run.video, _cameras(), scene, _stamps(0.1, SECONDS, RATE_HZ), LOOK, k)


def _stamps(start_s: float, seconds: float, rate_hz: float) -> Array:
    return start_s + np.arange(round(seconds * rate_hz)) / rate_hz


def _cameras() -> tuple[Camera, ...]:
    centre = MIDDLE_M + np.array([0.0, 0.2, 0.1])
    left = np.array([1000.0, 1001.5, 509.0, 289.0, -0.10, 0.03, -4e-4, 2e-4])
    right = np.array([992.0, 991.0, 514.0, 285.0, -0.12, 0.05, 2e-4, 4e-4])
    return (
        Camera("left", SIZE_PX, "OPENCV", left, look_at((-0.2, -2.5, 0.1), centre)),
        Camera("right", SIZE_PX, "OPENCV", right, look_at((1.4, -2.5, 0.0), centre), 0.0031),
    )


def _swing(body: Plate, k: int) -> Trajectory:
    """Simulated a little longer than it is filmed."""
    x, y = PLACES_M[k % len(PLACES_M)]
    robot = body.robot
    plate_at = MIDDLE_M + np.array([x, y, 0.0])
    ends = plate_at + (robot.attachments_m @ SHEET_AXES) + SHEET_M
    lengths = np.linalg.norm(robot.entries_m - ends, axis=1)
    return robot.simulate(
        lengths, amplitude_m=0.035, duration_s=SECONDS + 0.5, rate_hz=400.0, seed=k
    )


def _wall(session: Session) -> list[Patch]:
    """The two hung tags: upright, facing the cameras."""
    assert session.calibration is not None
    found = []
    for tag in session.calibration.base_tags:
        corners = tag.corners_base_m
        pose = np.eye(4)
        pose[:3, 0] = (corners[1] - corners[0]) / np.linalg.norm(corners[1] - corners[0])
        pose[:3, 1] = (corners[0] - corners[3]) / np.linalg.norm(corners[0] - corners[3])
        pose[:3, 2] = np.cross(pose[:3, 0], pose[:3, 1])
        pose[:3, 3] = corners.mean(axis=0)
        side = float(np.linalg.norm(corners[1] - corners[0]))
        found.append(tag_patch(tag.family, tag.id, side, pose, "base"))
    return found


def _board_scene(session: Session) -> Scene:
    """The printed board carried through both views."""
    assert session.calibration is not None
    assert session.calibration.board is not None
    board = board_from(session.calibration.board)
    squares = (board.columns, board.rows)
    patch = charuco_patch(squares, board.square_m, board.marker_m, board.dictionary)
    facing = np.eye(4)
    facing[:3, :3] = SHEET_AXES.T

    def carried(times_s: Array) -> tuple[Array, Array]:
        t = np.asarray(times_s)
        way = [0.2 * np.sin(1.3 * t), 0.2 * np.sin(0.9 * t + 1.0), 0.15 * np.sin(2.1 * t + 0.5)]
        # Turned little about the vertical: each camera sees it from 30 degrees aside already.
        tilt = [0.5 * np.sin(1.7 * t), 0.3 * np.sin(1.1 * t + 2.0), 0.2 * np.sin(0.8 * t + 0.3)]
        middle = MIDDLE_M + np.array([0.0, -0.7, 0.15])
        return middle + np.stack(way, axis=1), exp_rotation(np.stack(tilt, axis=1))

    return Scene((*_wall(session), patch.moved(facing, "platform")), carried)
