"""Days in a laboratory: sessions at the level of markers, with all that goes wrong at once.

Markers sit where target.toml says to some tenths of a millimetre, one of them by more; in half of
the runs one marker's centroid is partly hidden and moves with the pose; one is hidden for a moment.
The robot's attachment is off, its cables stretch, swivels rub, the air brakes and the base is not
level. The motions are the independent integrator's.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from freeswing.cdpr.files.trajectory_files import write_trc
from freeswing.cdpr.measured.marker_recording import MarkerRecording
from freeswing.cdpr.measured.target import Marker, Target, write_target
from tests.oracle.mechanics.newton_euler import Motion
from tests.oracle.mechanics.world import Array
from tests.oracle.recorded import session_files as files
from tests.oracle.recorded.sessions import SessionTruth, make_scene
from tests.oracle.scenes.robots import declared_robot, true_body
from tests.oracle.scenes.runs import TrueRun, draw_run

EFFECTS: Mapping[str, object] = {
    "attachment_offset": 0.005,
    "cable_elasticity": 8e4,
    "swivel_friction": "medium",
    "rotational_drag": "medium",
    "gravity_tilt": "small",
}
PLACES_M = np.array(
    [
        [0.0, 0.0, 0.0],
        [-0.17, -0.15, 0.04],
        [0.19, -0.14, 0.05],
        [0.2, 0.14, 0.04],
        [-0.18, 0.15, 0.03],
    ]
)
NAMES = ("P", "M2", "M3", "M4", "M5")
WHITE_M = 2e-5
LAYOUT_M, WORST_MARKER_M = 2e-4, 1.5e-3
FROM_RUN_TO_RUN_M = 1e-4
# Rms of what a half-hidden marker adds, linear in the pose, over one run.
HALF_HIDDEN_M = 3e-4
HIDDEN_SAMPLES = 40


def make_lab_day(
    folder: Path | str,
    seed: int,
    robot: str = "bologna-4",
    effects: Mapping[str, object] = EFFECTS,
    *,
    n_runs: int = 10,
    duration_s: float = 10.0,
    spoiled_share: float = 0.5,
) -> SessionTruth:
    """Writes a session folder of marker recordings, and returns the truth.

    Args:
        folder: made when not there.
        seed: the same seed gives the same files.
        robot: "bologna-4" or "three-cable".
        effects: name -> size, see `tests.oracle.scenes.effects`.
        n_runs: number of runs, of which seven tenths identify.
        duration_s: of each.
        spoiled_share: of the runs in which one marker is half hidden.
    """
    rng = np.random.default_rng(seed)
    declared, body = declared_robot(robot), true_body(robot, rng)
    scene = make_scene(declared, body, effects, rng)
    folder = Path(folder)
    for sub in ("runs", "truth"):
        (folder / sub).mkdir(parents=True, exist_ok=True)
    layout = PLACES_M + LAYOUT_M * rng.normal(size=PLACES_M.shape)
    layout[0] = 0.0  # P is P by definition
    off = rng.normal(size=3)
    layout[rng.integers(1, len(layout))] += WORST_MARKER_M * off / np.linalg.norm(off)
    runs: list[TrueRun] = []
    told, spoiled = [], {}
    for k in range(n_runs):
        run = draw_run(scene, rng, duration_s, 100.0)
        name = f"swing-{k + 1:02d}"
        bad = (
            int(rng.integers(len(layout))) if k % round(1.0 / max(spoiled_share, 1e-9)) == 0 else -1
        )
        points = _points(run.motion, layout, rng)
        if bad >= 0:
            points[:, bad] += _half_hidden(run.motion, rng)
            spoiled[name] = NAMES[bad]
        start = int(rng.integers(100, len(points) - 100))
        points[start : start + HIDDEN_SAMPLES, rng.integers(1, len(layout))] = np.nan
        made = MarkerRecording(run.motion.times_s, NAMES, points, name)
        write_trc(folder / "runs" / f"{name}.trc", made)
        role = "identify" if k < round(0.7 * n_runs) else "validate"
        told.append({"name": name, "role": role, "window_s": (0.0, duration_s)})
        runs.append(run)
    files.write_robot(folder / "robot.toml", declared)
    markers = tuple(Marker(n, p) for n, p in zip(NAMES, PLACES_M, strict=True))
    write_target(folder / "target.toml", Target(markers=markers))
    _write_session(folder / "session.toml", f"lab-day-{robot}-{seed}", told)
    truth = {
        "robot": robot,
        "seed": seed,
        "effects": scene.record,
        "in_catalogue": True,
        "mass_kg": body.mass_kg,
        "com_m": body.com_m,
        "specific_inertia_m2": body.specific_inertia_m2,
        "layout_m": layout,
        "spoiled": spoiled,
    }
    files.write_truth(folder / "truth" / "truth.json", truth)
    return SessionTruth(folder, body, scene, tuple(runs))


def _points(motion: Motion, layout: Array, rng: np.random.Generator) -> Array:
    """Markers (n_t, n_m, 3) of a run, each where this run has it, with white noise."""
    here = layout + FROM_RUN_TO_RUN_M * rng.normal(size=layout.shape)
    points = motion.positions_m[:, None] + np.einsum("tij,mj->tmi", motion.rotations, here)
    return points + WHITE_M * rng.normal(size=points.shape)


def _half_hidden(motion: Motion, rng: np.random.Generator) -> Array:
    """A centroid's error (n_t, 3), a linear function of the pose and constant in the platform."""
    poses = np.concatenate([motion.positions_m, motion.rotations[:, [2, 0, 1], [1, 2, 0]]], axis=1)
    poses = (poses - poses.mean(axis=0)) / poses.std(axis=0)
    error = poses @ rng.normal(size=(6, 3))
    error *= HALF_HIDDEN_M / np.sqrt(np.mean(error**2))
    return np.einsum("tij,tj->ti", motion.rotations, error)


def _write_session(path: Path, name: str, runs: list[dict[str, object]]) -> None:
    lines = ['format = "freeswing-session/1"', f'name = "{name}"', 'robot = "robot.toml"']
    lines += ['target = "target.toml"', "frame_rate_hz = 100.0"]
    for run in runs:
        low, high = run["window_s"]
        lines += ["", "[[runs]]", f'name = "{run["name"]}"', f'role = "{run["role"]}"']
        lines += [f"window_s = [{low}, {high}]", f'trajectory = "runs/{run["name"]}.trc"']
    path.write_text("\n".join([*lines, ""]))
