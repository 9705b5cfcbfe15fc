"""The demonstration as motion capture saw it: labelled markers in TRC files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from freeswing.cdpr.files.documents import dump_toml, write_json
from freeswing.cdpr.files.robot_file import write_robot
from freeswing.cdpr.files.trajectory_files import write_trc
from freeswing.cdpr.measured.marker_recording import MarkerRecording, recording_from_poses
from freeswing.cdpr.measured.target import Marker, Target, write_target
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import INERTIA_NAMES
from freeswing.cdpr.system.progress import Progress
from freeswing.demo.truth import (
    EFFECT,
    EFFECT_VALUES,
    TRUE_INERTIA,
    Swing,
    demo_robot,
    demo_swings,
)

RATE_HZ = 100.0
DURATION_S = 10.0
MARKER_NOISE_M = 1e-4
LENGTH_NOISE_M = 3e-4
MARKERS_M = {
    "P": (0.0, 0.0, 0.0),
    "M2": (-0.17, -0.18, 0.03),
    "M3": (0.20, -0.12, 0.05),
    "M4": (0.18, 0.17, 0.045),
    "M5": (-0.21, 0.11, 0.03),
}


def write_mocap_session(folder: Path, seed: int = 1, progress: Progress | None = None) -> Path:
    """Make the session and its `truth.json`; gives the path of session.toml.

    The same seed gives the same files.
    """
    generator = np.random.default_rng(seed)
    swings = demo_swings(generator, DURATION_S)
    target = Target(markers=tuple(Marker(n, np.array(p)) for n, p in MARKERS_M.items()))
    runs = []
    for count, swing in enumerate(swings):
        if progress is not None:
            progress("recording", count / len(swings))
        recording = _record(swing, target, generator)
        write_trc(folder / "runs" / f"{swing.name}.trc", recording)
        table = run_table(swing, generator, (0.0, DURATION_S))
        runs.append({**table, "trajectory": f"runs/{swing.name}.trc"})
    write_robot(folder / "robot.toml", demo_robot())
    write_target(folder / "target.toml", target)
    session = {
        "format": "freeswing-session/1",
        "name": "freeswing demo",
        "robot": "robot.toml",
        "target": "target.toml",
        "frame_rate_hz": RATE_HZ,
        "runs": runs,
    }
    write_json(folder / "truth.json", truth_document())
    dump_toml(folder / "session.toml", session)
    return folder / "session.toml"


def truth_document(
    effect_values: tuple[float, float] = EFFECT_VALUES,
) -> dict[str, object]:
    """What no file of the session declares."""
    return {
        "format": "freeswing-truth/1",
        "effects": [{"effect": EFFECT, "rate_1_s": effect_values[0]}],
        "parameters": dict(zip(INERTIA_NAMES, TRUE_INERTIA.tolist(), strict=True)),
    }


def _record(swing: Swing, target: Target, generator: np.random.Generator) -> MarkerRecording:
    times = np.arange(round(DURATION_S * RATE_HZ) + 1) / RATE_HZ
    poses = swing.motion.at(times)[0]
    motion = Trajectory(times, ("x", "y", "z", "phi", "theta", "chi"), poses)
    exact = recording_from_poses(motion, target)
    noise = generator.normal(0.0, MARKER_NOISE_M, exact.positions_m.shape)
    return MarkerRecording(times, exact.names, exact.positions_m + noise, swing.name)


def run_table(
    swing: Swing, generator: np.random.Generator, window_s: tuple[float, float]
) -> dict[str, object]:
    """What session.toml says of a swing, but for where its recording is."""
    told = swing.lengths_m + generator.normal(0.0, LENGTH_NOISE_M, len(swing.lengths_m))
    return {
        "name": swing.name,
        "role": swing.role,
        "cable_lengths_m": np.round(told, 6),
        "cable_lengths_std_m": LENGTH_NOISE_M,
        "window_s": list(window_s),
    }
