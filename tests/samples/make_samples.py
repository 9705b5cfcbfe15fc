"""Writes the measured sessions of samples/ from a seed: `python -m tests.samples.make_samples`.

The motions come from the independent integrator in tests/oracle, never from the product's model.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np

from freeswing.cdpr.files.trajectory_files import write_trc
from freeswing.cdpr.measured.marker_recording import MarkerRecording
from freeswing.cdpr.measured.target import Marker, Target, write_target
from freeswing.cdpr.robot import Cable, Platform, Robot
from tests.oracle.mechanics.equilibrium import displaced, lengths_at, settle, tensions_at_rest
from tests.oracle.mechanics.geometry import turn
from tests.oracle.mechanics.newton_euler import Motion, simulate
from tests.oracle.mechanics.world import Body, plain_world
from tests.oracle.recorded import session_files as files
from tests.oracle.recorded.benches import make_bench
from tests.oracle.recorded.sessions import make_scene, make_session
from tests.oracle.scenes.robots import about_p, declared_robot, true_body
from tests.oracle.scenes.runs import draw_run
from tests.places import SAMPLES

ROLES = ("identify",) * 5 + ("validate",) * 2
DURATION_S = 8.0
MARKERS_M = {
    "P": (0.0, 0.0, 0.0),
    "left": (-0.17, -0.18, 0.03),
    "front": (0.20, -0.12, 0.05),
    "right": (0.18, 0.17, 0.045),
}
MARKER_NOISE_M = 1e-4
LENGTH_NOISE_M = 3e-4


def main() -> None:
    """Make all measured samples anew; the same seeds give the same files."""
    make_mocap(SAMPLES / "mocap-trc")
    make_two_cables(SAMPLES / "two-cables")
    make_from_oracle(SAMPLES / "three-cables", 31, "three-cable", {})
    make_from_oracle(SAMPLES / "undeclared-drag", 47, "bologna-4", {"translational_drag": 0.06})
    make_benches(SAMPLES / "trifilar")


def make_from_oracle(folder: Path, seed: int, robot: str, effects: dict[str, object]) -> None:
    """A session of full poses as the independent generator writes it."""
    _emptied(folder)
    make_session(
        folder,
        seed,
        robot,
        effects,
        n_runs=len(ROLES),
        duration_s=DURATION_S,
        lengths_std_m=LENGTH_NOISE_M,
    )


def make_benches(folder: Path) -> None:
    """A trifilar bench with an object, by poses and by nothing but a dot on a wall."""
    for seen, seed in (("poses", 5), ("track", 6)):
        _emptied(folder / seen)
        make_bench(folder / seen, seed, wires=3, seen=seen, duration_s=6.0, counts=(2, 2, 2))


def make_mocap(folder: Path) -> None:
    """Four labelled markers in TRC files, one hidden for a moment in each run."""
    _emptied(folder)
    rng = np.random.default_rng(23)
    robot = declared_robot("bologna-4")
    body = true_body("bologna-4", rng)
    scene = make_scene(robot, body, {}, rng)
    target = Target(markers=tuple(Marker(n, np.array(p)) for n, p in MARKERS_M.items()))
    runs = []
    for name, role in zip(_names(), ROLES, strict=True):
        motion = draw_run(scene, rng, DURATION_S, 100.0).motion
        write_trc(folder / "runs" / f"{name}.trc", _recording(motion, target, rng))
        runs.append(_run_lines(name, role, "trc"))
    files.write_robot(folder / "robot.toml", robot)
    write_target(folder / "target.toml", target)
    _write_session(folder, runs, ['target = "target.toml"'])
    _write_truth(folder, body)


def make_two_cables(folder: Path) -> None:
    """A platform on two cables: four free coordinates, full poses."""
    _emptied(folder)
    rng = np.random.default_rng(29)
    robot = two_cable_robot()
    com = np.array([0.004, -0.003, -0.052])
    body = Body(3.1, com, about_p(np.diag([0.0061, 0.0118, 0.0141]), com))
    runs = []
    for count, (name, role) in enumerate(zip(_names(), ROLES, strict=True)):
        place = np.array([-0.45 + 0.15 * count, 0.0, -0.9 - 0.05 * (count % 3)])
        motion, lengths = _two_cable_motion(robot, body, place, rng)
        columns = _noisy(motion, rng)
        files.write_samples(folder / "runs" / f"{name}.csv", files.POSE_HEADER, columns)
        told = lengths + rng.normal(0.0, LENGTH_NOISE_M, len(lengths))
        runs.append(_run_lines(name, role, "csv", told))
    files.write_robot(folder / "robot.toml", robot)
    _write_session(folder, runs, [])
    _write_truth(folder, body)


def two_cable_robot() -> Robot:
    """Two cables over pulleys in a vertical plane, an easily built bench."""
    axes = (np.array([1.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, -1.0]))
    mirrored = (-axes[0], -axes[1], axes[2])
    left = Cable("left", np.array([-1.1, 0.0, 0.5]), 0.03, np.array([-0.2, 0.0, 0.05]), *axes)
    right = Cable("right", np.array([1.1, 0.0, 0.5]), 0.03, np.array([0.2, 0.0, 0.05]), *mirrored)
    nominal = np.array([0.0, 0.0, -0.05])
    platform = Platform(3.0, nominal, about_p(np.diag([0.006, 0.012, 0.014]), nominal))
    free = ("x", "y", "phi", "chi")
    return Robot("bench-2", (left, right), free_coordinates=free, platform=platform)


def _two_cable_motion(
    robot: Robot, body: Body, place: np.ndarray, rng: np.random.Generator
) -> tuple[Motion, np.ndarray]:
    world = plain_world(robot, body)
    level = np.array([1.0, 0.0, 0.0, 0.0])
    world = world._replace(length=lengths_at(world, place, level))
    rest = settle(world, place, level)
    while True:
        way = rng.normal(size=rest.freedom.shape[1])
        p, q = displaced(world, rest, way, 0.06, 0.15)
        if tensions_at_rest(world, p, q).min() > 3.0:
            motion = simulate(world, p, q, DURATION_S)
            if motion.tensions_n.min() > 2.0:
                return motion, world.length


def _noisy(motion: Motion, rng: np.random.Generator) -> np.ndarray:
    points = motion.positions_m + rng.normal(0.0, 1e-4, motion.positions_m.shape)
    seen = motion.quaternions.copy()
    for quaternion, error in zip(seen, rng.normal(0.0, 5e-4, points.shape), strict=True):
        turn(quaternion, error)
    return np.concatenate([motion.times_s[:, None], points, seen], axis=1)


def _recording(motion: Motion, target: Target, rng: np.random.Generator) -> MarkerRecording:
    moved = np.einsum("tij,mj->tmi", motion.rotations, target.marker_positions_m)
    points = moved + motion.positions_m[:, None]
    points += rng.normal(0.0, MARKER_NOISE_M, points.shape)
    start = int(rng.integers(100, 600))
    points[start : start + 4, int(rng.integers(1, 4))] = np.nan
    return MarkerRecording(motion.times_s, target.marker_names, points)


def _names() -> tuple[str, ...]:
    counts = {"identify": 0, "validate": 0}
    names = []
    for role in ROLES:
        counts[role] += 1
        stem = "swing" if role == "identify" else "check"
        names.append(f"{stem}-{counts[role]:02d}")
    return tuple(names)


def _run_lines(name: str, role: str, suffix: str, lengths: np.ndarray | None = None) -> list[str]:
    told = []
    if lengths is not None:
        values = ", ".join(f"{value:.6f}" for value in lengths)
        told = [f"cable_lengths_m = [{values}]", f"cable_lengths_std_m = {LENGTH_NOISE_M}"]
    return [
        "",
        "[[runs]]",
        f'name = "{name}"',
        f'role = "{role}"',
        *told,
        f"window_s = [0.0, {DURATION_S}]",
        f'trajectory = "runs/{name}.{suffix}"',
    ]


def _write_session(folder: Path, runs: list[list[str]], more: list[str]) -> None:
    lines = ['format = "freeswing-session/1"', f'name = "{folder.name}"', 'robot = "robot.toml"']
    lines += [*more, "frame_rate_hz = 100.0", *(line for run in runs for line in run), ""]
    (folder / "session.toml").write_text("\n".join(lines), encoding="utf-8")


def _write_truth(folder: Path, body: Body) -> None:
    truth = {
        "effects": [],
        "mass_kg": body.mass_kg,
        "com_m": body.com_m,
        "specific_inertia_m2": body.specific_inertia_m2,
    }
    files.write_truth(folder / "truth" / "truth.json", truth)


def _emptied(folder: Path) -> None:
    """The folder without the files that are made; what is written by hand stays."""
    for part in ("runs", "truth"):
        shutil.rmtree(folder / part, ignore_errors=True)
        (folder / part).mkdir(parents=True)


if __name__ == "__main__":
    main()
