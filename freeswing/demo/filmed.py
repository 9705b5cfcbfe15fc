"""The demonstration as cameras saw it: videos, calibration footage, surveyed tags."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from freeswing.cdpr.files.documents import dump_toml, write_json
from freeswing.cdpr.files.robot_file import write_robot
from freeswing.cdpr.measured.target import write_target
from freeswing.cdpr.system.progress import Progress
from freeswing.demo.mocap import run_table, truth_document
from freeswing.demo.rig import (
    BOARD,
    RATE_HZ,
    base_tags,
    board_shots,
    demo_target,
    film,
    swing_shots,
    true_cameras,
)
from freeswing.demo.truth import EFFECT_VALUES, Swing, demo_robot, demo_swings

DURATION_S = 4.6
CUT_S = 0.2  # nothing is filmed this close to the ends of the simulated motion
FILMED = ("swing-01", "swing-02", "swing-03", "check-01")


def write_filmed_session(
    folder: Path,
    seed: int = 1,
    progress: Progress | None = None,
    filmed: tuple[str, ...] = FILMED,
    effect_values: tuple[float, float] = EFFECT_VALUES,
) -> Path:
    """Film the calibration and the swings; gives the path of session.toml.

    The same seed gives the same files. `truth.json` holds what no file declares.
    """
    generator = np.random.default_rng(seed)
    swings = demo_swings(generator, DURATION_S, effect_values, filmed)
    shots = board_shots(folder / "calibration", seed)
    for swing in swings:
        shots += swing_shots(folder / "runs" / swing.name, swing, CUT_S, seed)
    film(shots, progress)
    write_robot(folder / "robot.toml", demo_robot())
    write_target(folder / "target.toml", demo_target())
    cameras = {camera.name: {"clock_offset_s": camera.clock_offset_s} for camera in true_cameras()}
    write_json(folder / "truth.json", {**truth_document(effect_values), "cameras": cameras})
    session = {
        "format": "freeswing-session/1",
        "name": "freeswing demo",
        "robot": "robot.toml",
        "target": "target.toml",
        "cameras": "cameras.toml",
        "frame_rate_hz": RATE_HZ,
        "calibration": _calibration_table(),
        "runs": [_run(swing, generator) for swing in swings],
    }
    dump_toml(folder / "session.toml", session)
    return folder / "session.toml"


def _calibration_table() -> dict[str, object]:
    surveyed = [
        {
            "family": tag.family,
            "id": tag.id,
            "corners_base_m": np.round(tag.corners_platform_m, 6).tolist(),
        }
        for tag in base_tags()
    ]
    return {"recordings": "calibration", "board": BOARD, "base_tags": surveyed}


def _run(swing: Swing, generator: np.random.Generator) -> dict[str, object]:
    window_s = (CUT_S + 0.05, DURATION_S - CUT_S - 0.05)
    return {**run_table(swing, generator, window_s), "video": f"runs/{swing.name}"}
