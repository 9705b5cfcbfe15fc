"""A rendered four-camera rig calibrated here, by OpenCV, by aniposelib and by Caliscope.

All get the crossings that OpenCV's ChArUco detector finds; this project runs once on those and
once on its own corners from the same images. Point error: rms over 500 points in the volume, their
true pixels triangulated with the calibrated cameras, after the best rigid fit (peers have frames of
their own). Seconds of the processor from corners to cameras, lenses included, one thread, the best
of three (aniposelib: one). OpenCV's calibrateMultiview takes whole boards only; the last column
says how many of the corners found each one used.

Usage: python benchmarks/cameras/camera_rig.py [--aniposelib PYTHON] [--caliscope PYTHON]
    [--views 30]
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import cv2  # noqa: E402, RUF100
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from freeswing.calib.board.board_corners import BoardDetector  # noqa: E402
from freeswing.calib.board.declared_board import Board  # noqa: E402
from freeswing.calib.camera.camera import Camera  # noqa: E402
from freeswing.calib.exchange.matrix_and_distortion import lens  # noqa: E402
from freeswing.calib.rig.solve_rig import solve_rig, start_cameras  # noqa: E402
from freeswing.calib.rig.triangulation import triangulate  # noqa: E402
from freeswing.calib.rig.views import make_views  # noqa: E402
from freeswing.calib.tags.tag_bend import straightened  # noqa: E402
from freeswing.calib.tags.tag_patterns import tag_dictionary  # noqa: E402
from freeswing.calib.verdict.halves_and_lengths import rigidly_fitted  # noqa: E402
from freeswing.cdpr.rotation import exp_rotation, transform  # noqa: E402
from freeswing.vision.render.patterns import charuco_patch  # noqa: E402
from freeswing.vision.render.render_scene import Look, Renderer, Scene, still  # noqa: E402
from tests.calib import rigs  # noqa: E402

COLUMNS, ROWS, SQUARE_M, MARKER_M, FAMILY = 9, 6, 0.07, 0.0525, "DICT_5X5_100"
REPEATS = 3
FLIP = np.diag([1.0, -1.0, -1.0, 1.0])


def film(cameras, boards):
    """Corners by OpenCV and by this project from the same images, (n_cameras, n_views, n, 2)."""
    patch = charuco_patch((COLUMNS, ROWS), SQUARE_M, MARKER_M, FAMILY)
    size = (COLUMNS, ROWS)
    theirs = cv2.aruco.CharucoBoard(size, SQUARE_M, MARKER_M, tag_dictionary(FAMILY))
    crossing = cv2.aruco.CharucoDetector(theirs)
    ours = BoardDetector(Board("charuco", COLUMNS, ROWS, SQUARE_M, MARKER_M, FAMILY))
    crossings = np.full((len(cameras), len(boards), (COLUMNS - 1) * (ROWS - 1), 2), np.nan)
    blank = ours.nothing()
    tags = [[blank for _ in boards] for _ in cameras]
    seconds = {"opencv": 0.0, "freeswing": 0.0}
    for c, camera in enumerate(cameras):
        for k, T in enumerate(boards):
            scene = Scene((patch.moved(T @ FLIP, "base"),), still())
            image = Renderer(camera, scene, Look(), k).frame(0.0)
            start = time.perf_counter()
            corners, ids, _, _ = crossing.detectBoard(image)
            seconds["opencv"] += time.perf_counter() - start
            if ids is not None and len(ids) >= 8:
                crossings[c, k, np.ravel(ids).astype(int)] = np.reshape(corners, (-1, 2))
            start = time.perf_counter()
            found = ours.detect(image)
            seconds["freeswing"] += time.perf_counter() - start
            if found is not None:
                tags[c][k] = found
    pixels = np.array([[found.pixels for found in row] for row in tags])
    covariance = np.array([[found.covariance_px2 for found in row] for row in tags])
    return crossings, (pixels, covariance), seconds


def ours(pixels, points, size, covariance=None, board=None):
    """Cameras and seconds of this project."""
    rows = [
        (c, k)
        for c, k in np.ndindex(*pixels.shape[:2])
        if np.isfinite(pixels[c, k, :, 0]).sum() >= 8
    ]
    camera, moment = (list(column) for column in zip(*rows, strict=True))
    stack = pixels[camera, moment]
    noise = None if covariance is None else covariance[camera, moment]
    names = tuple(f"cam{k}" for k in range(len(pixels)))
    count, best, cameras = len(names), np.inf, ()

    for _ in range(REPEATS):
        start = time.process_time()
        views = make_views(camera, moment, stack, covariance_px2=noise)
        starts = start_cameras(names, (size,) * count, ("OPENCV",) * count, points, views)
        if board is None:
            rig = solve_rig(points, starts)
        else:
            flat = partial(straightened, board=board, border_cells=[1] * count)
            rig = solve_rig(points, starts, straighten=flat)
        best, cameras = min(best, time.process_time() - start), rig.cameras
    return cameras, best


def peer(name, python, data, size):
    """Cameras and seconds of a peer, run by its own Python."""
    script = Path(__file__).with_name("camera_peers.py")
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "corners.npz", Path(folder) / "result.json"
        np.savez(source, **data)
        done = subprocess.run(
            [python, str(script), name, str(source), str(target)],
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            return None, done.stderr.strip().splitlines()[-1:]
        document = json.loads(target.read_text())
    cameras = []
    for index, (K, d, turn, shift) in enumerate(document["cameras"]):
        K = np.reshape(K, (3, 3))
        model, params = lens(K[[0, 1], [0, 1]], K[:2, 2], np.array(d), fisheye=False)
        pose = transform(exp_rotation(np.array(turn)), np.array(shift))
        cameras.append(Camera(f"cam{index}", size, model, params, pose))
    return tuple(cameras), document["seconds"]


def point_error_mm(found, cameras):
    """Rms distance over the volume after the best rigid fit, mm."""
    points = np.random.default_rng(0).uniform(-0.4, 0.4, (500, 3))
    pixels = np.stack([camera.project(camera.to_camera(points)) for camera in cameras])
    again = triangulate(found, pixels)
    good = np.isfinite(again[:, 0])
    if good.sum() < 0.5 * len(points):
        return float("inf")
    error = again[good] - rigidly_fitted(points[good], again[good])
    return 1e3 * float(np.sqrt(np.mean(np.sum(error**2, axis=1))))


def main() -> None:
    """Print a table and JSON."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--aniposelib", metavar="PYTHON", help="Python that has aniposelib")
    parser.add_argument("--caliscope", metavar="PYTHON", help="Python that has caliscope")
    parser.add_argument("--views", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    cameras = rigs.rig(4, options.seed)
    boards = rigs.poses(cameras, options.views, options.seed + 5)
    crossings, tags, detection = film(cameras, boards)
    grid = rigs.board(COLUMNS - 1, ROWS - 1, SQUARE_M)
    size = cameras[0].size_px
    data = {"pixels": crossings, "points": grid, "size": np.array(size)}
    data["board"] = np.array([COLUMNS, ROWS, SQUARE_M, MARKER_M])
    board = Board("charuco", COLUMNS, ROWS, SQUARE_M, MARKER_M, FAMILY)
    whole = np.all(np.isfinite(crossings), axis=(2, 3))
    full = np.where(whole[..., None, None], crossings, np.nan)
    runs = (
        ("freeswing, its own corners", tags[0], None),
        ("freeswing", crossings, None),
        ("freeswing, whole boards", full, None),
        ("OpenCV calibrateMultiview", full, sys.executable),
        ("aniposelib", crossings, options.aniposelib),
        ("Caliscope", crossings, options.caliscope),
    )
    results = {}
    for name, pixels, python in runs:
        if name == "freeswing, its own corners":
            found, seconds = ours(pixels, board.points_m, size, tags[1], board)
        elif name.startswith("freeswing"):
            found, seconds = ours(pixels, grid, size)
        elif python is None:
            print(f"{name}: skipped, no --{name.lower()} PYTHON")
            continue
        else:
            found, seconds = peer(name.split()[0].lower(), python, data, size)
        if found is None:
            print(f"{name}: failed: {seconds}")
            continue
        corners = int(np.isfinite(pixels[..., 0]).sum())
        error = point_error_mm(found, cameras)
        results[name] = {"point_error_mm": error, "seconds": seconds, "corners": corners}
    print(f"{'':30s} {'points mm':>10s} {'cpu s':>8s} {'corners':>8s}")
    for name, row in results.items():
        print(f"{name:30s} {row['point_error_mm']:10.4f} {row['seconds']:8.3f} {row['corners']:8d}")
    print(json.dumps({"results": results, "detection_seconds": detection, "views": options.views}))


if __name__ == "__main__":
    main()
