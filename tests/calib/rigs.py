"""Seeded rigs, boards and sightings with known truth."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.rig.reprojection import Scene, camera_slices
from freeswing.calib.rig.solve_rig import Rig
from freeswing.calib.rig.views import Views, make_views
from freeswing.cdpr.rotation import exp_rotation, invert, log_rotation, transform

LENS = np.array([1100.0, 1105, 640, 510, -0.1, 0.05, 5e-4, -3e-4])


def rig(count: int = 4, seed: int = 0, arc_rad: float = 1.4) -> tuple[Camera, ...]:
    """Cameras 2.5 m from the origin, all looking at it."""
    rng = np.random.default_rng(seed)
    cameras = []
    for index in range(count):
        angle = arc_rad * index / max(count - 1, 1)
        place = np.array([2.5 * np.cos(angle), 2.5 * np.sin(angle), 0.3 + 0.2 * (index % 2)])
        z = -place / np.linalg.norm(place)
        x = np.cross(z, [0.0, 0.0, 1.0])
        x /= np.linalg.norm(x)
        turn = np.stack([x, np.cross(z, x), z])
        lens = LENS * (1.0 + 0.01 * rng.normal(size=LENS.size))
        pose = transform(turn, -turn @ place)
        cameras.append(Camera(f"cam{index}", (1280, 1024), "OPENCV", lens, pose))
    return tuple(cameras)


def board(columns: int = 8, rows: int = 5, square_m: float = 0.08) -> np.ndarray:
    """A plain lattice of corners about the origin, (n, 3)."""
    grid = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), -1).reshape(-1, 2) * square_m
    return np.column_stack([grid - grid.mean(axis=0), np.zeros(len(grid))])


def facing(cameras: tuple[Camera, ...]) -> np.ndarray:
    """Board rotation that shows its face to the cameras' middle, (3, 3)."""
    mean = np.mean([camera.position_base_m for camera in cameras], axis=0)
    z = -mean / np.linalg.norm(mean)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def poses(cameras: tuple[Camera, ...], count: int, seed: int = 1, tilt: float = 0.6) -> np.ndarray:
    """Board poses all over the volume, (count, 4, 4)."""
    rng = np.random.default_rng(seed)
    turns = facing(cameras) @ exp_rotation(rng.uniform(-tilt, tilt, (count, 3)))
    return transform(turns, rng.uniform(-0.45, 0.45, (count, 3)))


def observe(
    cameras: tuple[Camera, ...], boards: np.ndarray, points: np.ndarray, sigma: float, seed: int = 2
) -> Views:
    """What the cameras see of the board, with noise."""
    rng = np.random.default_rng(seed)
    rows: list[tuple[int, int, np.ndarray]] = []
    for index, camera in enumerate(cameras):
        for moment, T in enumerate(boards):
            seen = camera.to_camera(points @ T[:3, :3].T + T[:3, 3])
            pixels = camera.project(seen) + sigma * rng.normal(size=(len(points), 2))
            pixels[~camera.sees(seen)] = np.nan
            if np.isfinite(pixels[:, 0]).sum() >= 8:
                rows.append((index, moment, pixels))
    return make_views([r[0] for r in rows], [r[1] for r in rows], np.array([r[2] for r in rows]))


def hand_motion(cameras: tuple[Camera, ...], seed: int) -> Callable[[np.ndarray], tuple]:
    """A board waved about by hand: times (...) -> positions (..., 3), rotations (..., 3, 3)."""
    rng = np.random.default_rng(seed)
    speed, phase = 2 * np.pi * rng.uniform(0.2, 1.0, (6, 4)), rng.uniform(0, 2 * np.pi, (6, 4))
    share = rng.uniform(0.3, 1.0, (6, 4))
    share *= np.array([0.35] * 3 + [0.75] * 3)[:, None] / share.sum(axis=1, keepdims=True)
    face = facing(cameras)

    def motion(times_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        angle = speed * np.asarray(times_s, dtype=float)[..., None, None] + phase
        values = (np.sin(angle) * share).sum(axis=-1)
        return values[..., :3], face @ exp_rotation(values[..., 3:])

    return motion


def film_points(
    camera: Camera, motion: Callable[[np.ndarray], tuple], stamps_s: np.ndarray, points: np.ndarray
) -> np.ndarray:
    """Pixels of moving points, each row at its own time, NaN outside, (n_stamps, n_points, 2)."""
    pixels = np.full((len(stamps_s), len(points), 2), 0.5 * camera.size_px[1])
    for _ in range(6):
        rows = pixels[..., 1] * camera.line_time_s
        places, turns = motion(stamps_s[:, None] + camera.clock_offset_s + rows)
        seen = camera.to_camera(np.einsum("npij,pj->npi", turns, points) + places)
        pixels = camera.project(seen)
    pixels[~camera.sees(seen)] = np.nan
    return pixels


def errors(scene: Scene, cameras: tuple[Camera, ...], reference: int | None) -> np.ndarray:
    """True minus estimated unknowns of all cameras, in the order of `calib.rig.reprojection`."""
    T_rig_base = np.eye(4) if reference is None else invert(cameras[reference].T_camera_base)
    parts = []
    for found, true in zip(scene.cameras, cameras, strict=True):
        T = true.T_camera_base @ T_rig_base
        parts += [
            true.params - found.params,
            T[:3, 3] - found.T_camera_base[:3, 3],
            log_rotation(T[:3, :3] @ found.T_camera_base[:3, :3].T),
            [true.clock_offset_s - found.clock_offset_s, true.line_time_s - found.line_time_s],
        ]
    return np.concatenate(parts)


def error_square(rig: Rig, cameras: tuple[Camera, ...]) -> tuple[float, int]:
    """Normalised error squared of the cameras' free unknowns, and their number."""
    free = rig.problem.free[: camera_slices(cameras)[-1].stop]
    error = errors(rig.adjustment.scene, cameras, rig.reference)[free]
    covariance = rig.adjustment.covariance[: len(free), : len(free)][np.ix_(free, free)]
    return float(error @ np.linalg.solve(covariance, error)), int(free.sum())


def error_square_in_base(rig: Rig, cameras: tuple[Camera, ...]) -> tuple[float, int]:
    """The same for a rig that surveyed points hold in the base frame."""
    free = rig.problem.free[: camera_slices(cameras)[-1].stop]
    error = errors(rig.adjustment.scene, cameras, None)[free]
    covariance = rig.adjustment.covariance[: len(free), : len(free)][np.ix_(free, free)]
    return float(error @ np.linalg.solve(covariance, error)), int(free.sum())
