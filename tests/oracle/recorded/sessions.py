"""Whole sessions with undeclared effects: what a user would have recorded, and the sealed truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from freeswing.cdpr.robot import POSE_COORDINATES, Robot
from tests.oracle.mechanics.geometry import turn
from tests.oracle.mechanics.world import Array, Body, plain_world
from tests.oracle.recorded import session_files as files
from tests.oracle.scenes.effects import EFFECTS, Scene, add_effect
from tests.oracle.scenes.outside import OUTSIDE, OUTSIDE_MAGNITUDES
from tests.oracle.scenes.robots import declared_robot, true_body
from tests.oracle.scenes.runs import TrueRun, draw_run, workspace

HELD_BEFORE_RELEASE_S = 1.0


@dataclass(frozen=True, slots=True)
class SessionTruth:
    """Everything behind a session that the product does not get to see."""

    folder: Path
    body: Body
    scene: Scene
    runs: tuple[TrueRun, ...]


def make_session(
    folder: Path | str,
    seed: int,
    robot: str = "bologna-4",
    effects: Mapping[str, object] | None = None,
    *,
    pose: bool = True,
    n_runs: int = 10,
    duration_s: float = 10.0,
    noise_m: float = 1e-4,
    noise_rad: float = 5e-4,
    lengths_std_m: float | None = 5e-4,
    rate_hz: float = 100.0,
    window: bool = True,
    std_columns: bool = False,
    missing_share: float = 0.0,
    reach_share: float = 1.0,
) -> SessionTruth:
    """Writes a session folder with `truth/truth.json` in it, and returns the truth.

    The first runs (7 of 10) are for identification, the rest for validation. Each is a release
    from rest about an equilibrium of its own; the true body is a few percent off the nominal one.

    Args:
        folder: made when not there.
        seed: the same seed gives the same files.
        robot: "bologna-4" or "three-cable".
        effects: name -> "small", "medium", "large" or a magnitude; of `EFFECTS` or `OUTSIDE`.
        pose: full poses, or else the robot's free coordinates alone.
        n_runs: number of runs, at least 2.
        duration_s: length of the free motion.
        noise_m: standard deviation of a measured coordinate.
        noise_rad: standard deviation of each component of a measured small rotation.
        lengths_std_m: error of the told cable lengths; None tells no lengths.
        rate_hz: sampling rate.
        window: tell `window_s`; else the files start with the platform held for a second.
        std_columns: give the noise in the files.
        missing_share: share of the samples that are left out, in gaps of 1 to 20.
        reach_share: scales the displacement at release.

    Raises:
        ValueError: unknown robot, effect or size.
    """
    rng = np.random.default_rng(seed)
    declared = declared_robot(robot)
    body = true_body(robot, rng)
    scene = make_scene(declared, body, effects or {}, rng)
    free = declared.free_coordinates or ()
    rows = None if pose else tuple(POSE_COORDINATES.index(name) for name in free)
    folder = Path(folder)
    for sub in ("runs", "truth"):
        (folder / sub).mkdir(parents=True, exist_ok=True)
    runs, told = [], []
    for k in range(n_runs):
        run = draw_run(scene, rng, duration_s, rate_hz, rows, reach_share)
        name = f"swing-{k + 1:02d}"
        times, p, q = _recorded(scene, run, rng, noise_m, noise_rad, held=not window)
        columns = _columns(times, p, q, None if pose else free)
        header = files.POSE_HEADER if pose else tuple(_column_name(name) for name in free)
        _blank(columns, rng, missing_share)
        if std_columns:
            header, columns = _with_std(header, columns, noise_m, noise_rad, pose)
        files.write_samples(folder / "runs" / f"{name}.csv", header, columns)
        runs.append(run)
        told.append(_told(name, k, n_runs, scene, run, rng, lengths_std_m, duration_s, window))
    files.write_robot(folder / "robot.toml", declared)
    files.write_target(folder / "target.toml")
    files.write_session(folder / "session.toml", f"{robot}-{seed}", rate_hz, told)
    files.write_truth(folder / "truth" / "truth.json", _truth(robot, seed, body, scene, runs))
    return SessionTruth(folder, body, scene, tuple(runs))


def make_scene(
    declared: Robot, body: Body, effects: Mapping[str, object], rng: np.random.Generator
) -> Scene:
    """The truth of a session: the declared robot, the true body and the effects, drawn in order.

    Raises:
        ValueError: unknown effect or size.
    """
    low, high, heading, _ = workspace(declared.n_cables)
    world = plain_world(declared, body)
    scene = Scene(world, 0.5 * (low + high), heading, length_bias_m=np.zeros(declared.n_cables))
    for name, size in effects.items():
        if name in OUTSIDE:
            scene = add_effect(scene, name, size, rng, OUTSIDE_MAGNITUDES, OUTSIDE)
        else:
            scene = add_effect(scene, name, size, rng)
    return scene


def measured(scene: Scene, run: TrueRun) -> tuple[Array, Array, Array]:
    """Stamps (n_t,), points (n_t, 3) and quaternions (n_t, 4) of perfect instruments.

    The marker's offset, the delay of the orientation and the clock's rate are in, noise is not.
    """
    motion = run.motion
    points = motion.positions_m + motion.rotations @ scene.marker_offset_m
    seen = _delayed(motion.times_s, motion.quaternions, scene.orientation_delay_s)
    return motion.times_s * (1.0 + scene.clock_rate), points, seen


def _recorded(
    scene: Scene,
    run: TrueRun,
    rng: np.random.Generator,
    noise_m: float,
    noise_rad: float,
    held: bool,
) -> tuple[Array, Array, Array]:
    """The measurements with white noise, after a second of rest when `held`."""
    times, points, seen = measured(scene, run)
    if held:
        before = round(HELD_BEFORE_RELEASE_S / (times[1] - times[0]))
        points = np.concatenate([np.repeat(points[:1], before, axis=0), points])
        seen = np.concatenate([np.repeat(seen[:1], before, axis=0), seen])
        times = np.arange(len(points)) * (times[1] - times[0])
    points = points + rng.normal(0.0, noise_m, points.shape)
    for quaternion, error in zip(seen, rng.normal(0.0, noise_rad, points.shape), strict=True):
        turn(quaternion, error)
    return times, points, seen


def _delayed(times: Array, quaternions: Array, delay_s: float) -> Array:
    """Orientations as they were `delay_s` earlier; before the release they stood still."""
    if delay_s == 0.0:
        return quaternions.copy()
    from scipy.interpolate import CubicSpline

    earlier = np.maximum(times - delay_s, times[0])
    out = CubicSpline(times, quaternions)(earlier)
    return out / np.linalg.norm(out, axis=1, keepdims=True)


def _columns(times: Array, p: Array, q: Array, free: tuple[str, ...] | None) -> Array:
    if free is None:
        return np.concatenate([times[:, None], p, q], axis=1)
    angles = tait_bryan(q)
    values = np.concatenate([p, angles], axis=1)
    wanted = [POSE_COORDINATES.index(name) for name in free]
    return np.concatenate([times[:, None], values[:, wanted]], axis=1)


def tait_bryan(quaternions: Array) -> Array:
    """phi, theta, chi of R = Rx(phi) Ry(theta) Rz(chi), (n_t, 3)."""
    w, x, y, z = quaternions.T
    phi = np.arctan2(2.0 * (w * x - y * z), 1.0 - 2.0 * (x * x + y * y))
    theta = np.arcsin(np.clip(2.0 * (x * z + w * y), -1.0, 1.0))
    chi = np.arctan2(2.0 * (w * z - x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.unwrap(np.stack([phi, theta, chi], axis=1), axis=0)


def _column_name(coordinate: str) -> str:
    return f"{coordinate}_m" if coordinate in "xyz" else f"{coordinate}_rad"


def _with_std(
    header: tuple[str, ...], columns: Array, noise_m: float, noise_rad: float, pose: bool
) -> tuple[tuple[str, ...], Array]:
    added = files.POSE_STD_HEADER if pose else tuple(f"std_{name}" for name in header)
    row = [noise_m if name.endswith("_m") else noise_rad for name in added]
    return (*header, *added), np.hstack([columns, np.tile(row, (len(columns), 1))])


def _blank(columns: Array, rng: np.random.Generator, share: float) -> None:
    """Gaps of 1 to 20 samples, never at the two ends."""
    wanted = share * len(columns)
    while np.isnan(columns[:, 1]).sum() < wanted:
        start, size = rng.integers(1, len(columns) - 21), rng.integers(1, 21)
        columns[start : start + size, 1:] = np.nan


def _told(
    name: str,
    k: int,
    n_runs: int,
    scene: Scene,
    run: TrueRun,
    rng: np.random.Generator,
    std_m: float | None,
    duration_s: float,
    window: bool,
) -> dict[str, Any]:
    lengths = None
    if std_m is not None:
        lengths = run.world.length + scene.length_bias_m + rng.normal(0.0, std_m, scene.n_cables)
    end = duration_s * (1.0 + scene.clock_rate)
    return {
        "name": name,
        "role": "identify" if k < round(0.7 * n_runs) else "validate",
        "lengths_m": lengths,
        "lengths_std_m": std_m,
        "window_s": (0.0, end) if window else None,
    }


def _truth(robot: str, seed: int, body: Body, scene: Scene, runs: list[TrueRun]) -> dict[str, Any]:
    return {
        "robot": robot,
        "seed": seed,
        "effects": scene.record,
        "in_catalogue": all(entry["effect"] in EFFECTS for entry in scene.record),
        "mass_kg": body.mass_kg,
        "com_m": body.com_m,
        "specific_inertia_m2": body.specific_inertia_m2,
        "runs": [
            {
                "cable_lengths_m": run.world.length,
                "rest_position_m": run.rest.position_m,
                "rest_quaternion": run.rest.quaternion,
                "release_position_m": run.release_m,
                "release_quaternion": run.release_quaternion,
                "least_tension_n": run.motion.tensions_n.min(),
                "reach_m": np.linalg.norm(run.release_m - run.rest.position_m),
            }
            for run in runs
        ],
    }
