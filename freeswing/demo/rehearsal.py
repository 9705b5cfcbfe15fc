"""The first run on a machine: what follows the recording is compiled beside it.

Functions are compiled when they are first called, and kept on the disk. A process of its own
tracks a film of a few frames while the session is recorded; by the time that the session's films
are tracked, what that needs is there, once for all workers.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from freeswing.calib.camera.cameras_file import write_cameras
from freeswing.cdpr.compiled.kernels import is_kept
from freeswing.cdpr.files.documents import DataError, dump_toml
from freeswing.cdpr.files.robot_file import write_robot
from freeswing.cdpr.measured.target import write_target
from freeswing.cdpr.system.lifeline import tie_to
from freeswing.demo.rig import RATE_HZ, demo_target, film, swing_shots, true_cameras
from freeswing.demo.truth import demo_robot, demo_swings
from freeswing.vision.fuse.pose_kernels import solve_block

if TYPE_CHECKING:
    from freeswing.console import Console

SWING = "swing-01"
LASTS_S = 0.8  # 24 frames: more than a motion's polynomial needs, filmed and tracked in a second


@contextmanager
def rehearsed() -> Iterator[None]:
    """Compiles beside what the block does, where nothing is compiled yet.

    What the process comes to is of no account: what it did not compile is compiled when it is
    called.
    """
    if is_kept(solve_block):
        yield
        return
    with TemporaryDirectory() as folder:
        context = multiprocessing.get_context("spawn")
        process = context.Process(target=rehearse, args=(Path(folder), os.getpid()), daemon=True)
        process.start()
        try:
            yield
        finally:
            process.terminate()
            process.join()


def rehearse(folder: Path, parent: int | None = None) -> bool:
    """Films and tracks a short swing in a folder; whether its films could be tracked.

    Args:
        folder: empty.
        parent: process whose end ends this one.
    """
    from freeswing.console import Console
    from freeswing.session.session_file import read_session
    from freeswing.session.stages import TRACK
    from freeswing.workers.crew import Crew

    if parent is not None:
        tie_to(parent)
    session = read_session(write_rehearsal(folder))
    with Console(quiet=True) as console:
        try:
            TRACK.take(session, console, crew=Crew(1))
        except DataError:
            return False
    return True


def compile_ahead(folder: Path, console: Console) -> None:
    """Has everything compiled that filming, calibrating and tracking call, by one short session.

    Args:
        folder: empty.
        console: told of each step.
    """
    from freeswing.console import Console as Quiet
    from freeswing.demo.filmed import write_filmed_session
    from freeswing.session.session_file import read_session
    from freeswing.session.stages import CALIBRATE, TRACK

    console.say("compiling what filming calls")
    session = read_session(write_filmed_session(folder, filmed=(SWING,)))
    with Quiet(quiet=True) as silent:
        for stage in (CALIBRATE, TRACK):
            console.say(f"compiling what {stage.name} calls")
            stage.take(session, silent)


def write_rehearsal(folder: Path) -> Path:
    """The session of one short swing, its cameras known; the path of session.toml."""
    generator = np.random.default_rng(0)
    (swing,) = demo_swings(generator, LASTS_S, names=(SWING,))
    film(swing_shots(folder / "runs" / SWING, swing, 0.0, 0))
    write_robot(folder / "robot.toml", demo_robot())
    write_target(folder / "target.toml", demo_target())
    write_cameras(folder / "cameras.toml", true_cameras())
    run = {
        "name": SWING,
        "role": "identify",
        "cable_lengths_m": np.round(swing.lengths_m, 6),
        "video": f"runs/{SWING}",
    }
    session = {
        "format": "freeswing-session/1",
        "name": "rehearsal",
        "robot": "robot.toml",
        "target": "target.toml",
        "cameras": "cameras.toml",
        "frame_rate_hz": RATE_HZ,
        "runs": [run],
    }
    dump_toml(folder / "session.toml", session)
    return folder / "session.toml"
