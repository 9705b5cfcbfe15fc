"""A rendered four-camera rig calibrated here, by OpenCV, by aniposelib and by Caliscope.

All get the crossings that OpenCV's ChArUco detector finds; this project runs once on those and
once on its own corners from the same images. Point error: rms over 500 points in the volume, their
true pixels triangulated with the calibrated cameras, after the best rigid fit (peers have frames of
their own). Seconds are from corners to cameras, one thread, the best of three
(aniposelib: one).

Usage: python benchmarks/camera_rig.py [--aniposelib PYTHON] [--caliscope PYTHON] [--views 30]
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import cv2  # noqa: E402, RUF100
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from calib.board_detection import BoardDetector  # noqa: E402
from calib.boards import Board  # noqa: E402
from calib.camera import Camera  # noqa: E402
from calib.exchange.lens import lens  # noqa: E402
from calib.rig import solve_rig, start_cameras  # noqa: E402
from calib.tag_patterns import tag_dictionary  # noqa: E402
from calib.triangulation import triangulate  # noqa: E402
from calib.truth_checks import rigidly_fitted  # noqa: E402
from calib.views import make_views  # noqa: E402
from cdpr.rotation import exp_rotation, transform  # noqa: E402
from tests.calib import rigs  # noqa: E402
from vision.patterns import charuco_patch  # noqa: E402
from vision.simulate import Look, Renderer, Scene, still  # noqa: E402

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
    tags = np.full((len(cameras), len(boards), len(ours.board.points_m), 3), np.nan)
    tags[..., 2] = 1.0
    seconds = {"opencv": 0.0, "freeswing": 0.0}
    for c, camera in enumerate(cameras):
        for k, T in enumerate(boards):
            scene = Scene((patch.moved(T @ FLIP, "base"),), still())
            image = Renderer(camera, scene, Look(), k).frame(0.0)
            start = time.perf_counter()
            corners, ids, _, _ = crossing.detectBoard(image)
            seconds["opencv"] += time.perf_counter() - start
            if ids is not None and len(ids) >= 8:
                crossings[c, k, np.ravel(ids)] = np.reshape(corners, (-1, 2))
            start = time.perf_counter()
            found = ours.detect(image)
            seconds["freeswing"] += time.perf_counter() - start
            if found is not None:
                tags[c, k] = found
    return crossings, tags, seconds


def ours(pixels, points, size, std=None):
    """Cameras and seconds of this project."""
    rows = [
        (c, k)
        for c, k in np.ndindex(*pixels.shape[:2])
        if np.isfinite(pixels[c, k, :, 0]).sum() >= 8
    ]
    camera, moment = (list(column) for column in zip(*rows, strict=True))
    stack = pixels[camera, moment]
    noise = None if std is None else std[camera, moment]
    names = tuple(f"cam{k}" for k in range(len(pixels)))
    count, best = len(names), np.inf
    for _ in range(REPEATS):
        start = time.perf_counter()
        views = make_views(camera, moment, stack, std_px=noise)
        starts = start_cameras(names, (size,) * count, ("OPENCV",) * count, points, views)
        rig = solve_rig(points, starts)
        best = min(best, time.perf_counter() - start)
    return rig.cameras, best


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
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
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
    results = {}
    board = Board("charuco", COLUMNS, ROWS, SQUARE_M, MARKER_M, FAMILY)
    for name, run in (
        (
            "freeswing, its own corners",
            lambda: ours(tags[..., :2], board.points_m, size, tags[..., 2]),
        ),
        ("freeswing, OpenCV's corners", lambda: ours(crossings, grid, size)),
        ("OpenCV calibrateMultiview", lambda: peer("opencv", sys.executable, data, size)),
        ("aniposelib", lambda: peer("aniposelib", options.aniposelib, data, size)),
        ("Caliscope", lambda: peer("caliscope", options.caliscope, data, size)),
    ):
        if name in ("aniposelib", "Caliscope") and getattr(options, name.lower()) is None:
            print(f"{name}: skipped, no --{name.lower()} PYTHON")
            continue
        found, seconds = run()
        if found is None:
            print(f"{name}: failed: {seconds}")
            continue
        results[name] = {"point_error_mm": point_error_mm(found, cameras), "seconds": seconds}
    print(f"{'':30s} {'points mm':>10s} {'seconds':>8s}")
    for name, row in results.items():
        print(f"{name:30s} {row['point_error_mm']:10.4f} {row['seconds']:8.2f}")
    print(json.dumps({"results": results, "detection_seconds": detection, "views": options.views}))


if __name__ == "__main__":
    main()
