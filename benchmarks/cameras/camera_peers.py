"""Calibrates a rig with one peer, inside that peer's own Python; called by camera_rig.py.

Usage: python camera_peers.py {opencv,aniposelib,caliscope} corners.npz result.json
"""

import json
import sys
import time

import cv2
import numpy as np


def lenses(data):
    """Each camera alone with OpenCV, the start that OpenCV's and Caliscope's rigs ask for."""
    found = []
    size = tuple(int(v) for v in data["size"])
    for pixels in data["pixels"]:
        seen = [np.isfinite(view[:, 0]) for view in pixels]
        views = [k for k, mask in enumerate(seen) if mask.sum() >= 8]
        object_points = [data["points"][seen[k]].astype(np.float32) for k in views]
        image_points = [pixels[k][seen[k]].astype(np.float32) for k in views]
        flags = cv2.CALIB_FIX_K3
        _, K, d, _, _ = cv2.calibrateCamera(
            object_points, image_points, size, None, None, flags=flags
        )
        found.append((K, np.ravel(d)[:5]))
    return found


def opencv(data):
    """cv2.calibrateMultiview on all views."""
    size = tuple(int(v) for v in data["size"])
    n_cameras, n_views = data["pixels"].shape[:2]
    points = data["points"].astype(np.float32)
    start = lenses(data)
    masks = np.isfinite(data["pixels"][..., 0]).all(axis=2)  # it takes whole boards only
    frames = [k for k in range(n_views) if masks[:, k].sum() >= 1]
    object_points = [points for _ in frames]
    images = [[data["pixels"][c, k].astype(np.float32) for k in frames] for c in range(n_cameras)]
    images = [[np.where(np.isfinite(v), v, -1.0).astype(np.float32) for v in row] for row in images]
    result = cv2.calibrateMultiview(
        object_points,
        images,
        [size] * n_cameras,
        masks[:, frames].astype(np.uint8),
        np.zeros(n_cameras, np.uint8),
        [K for K, _ in start],
        [d for _, d in start],
        [np.zeros((3, 1)) for _ in start],
        [np.zeros((3, 1)) for _ in start],
        flagsForIntrinsics=np.full(n_cameras, cv2.CALIB_FIX_K3, np.int32),
        flags=cv2.CALIB_USE_INTRINSIC_GUESS,
    )
    _, matrices, distortions, turns, shifts = result[:5]
    return [
        (
            K,
            np.ravel(d),
            np.ravel(r) if np.size(r) == 3 else np.ravel(cv2.Rodrigues(r)[0]),
            np.ravel(t),
        )
        for K, d, r, t in zip(matrices, distortions, turns, shifts)  # noqa: B905
    ]


def aniposelib(data):
    """CameraGroup.calibrate_rows, as its documentation shows."""
    from aniposelib.boards import CharucoBoard
    from aniposelib.cameras import Camera, CameraGroup

    columns, rows, square, marker = data["board"]
    board = CharucoBoard(int(columns), int(rows), square, marker, marker_bits=5, dict_size=100)
    size = [int(v) for v in data["size"]]
    count = len(data["pixels"])
    cameras = [Camera(name=f"cam{k}", size=size, extra_dist=False) for k in range(count)]
    group = CameraGroup(cameras)
    all_rows = []
    for pixels in data["pixels"]:
        own = []
        for k, view in enumerate(pixels):
            ids = np.flatnonzero(np.isfinite(view[:, 0]))
            if len(ids) < 8:
                continue
            corners = view[ids][:, None, :].astype(np.float32)
            filled = view[:, None, :].astype(np.float64)
            row = {"framenum": (0, k), "corners": corners, "ids": ids[:, None], "filled": filled}
            own.append(row)
        all_rows.append(own)
    group.calibrate_rows(all_rows, board, verbose=False)
    return [
        (
            c.get_camera_matrix(),
            np.ravel(c.get_distortions()),
            c.get_rotation(),
            c.get_translation(),
        )
        for c in group.cameras
    ]


def caliscope(data):
    """Intrinsics with OpenCV, then CaptureVolume.bootstrap and optimize with intrinsics."""
    import pandas as pd
    from caliscope.api import CameraArray, CameraData, CaptureVolume, ImagePoints

    rows = []
    for c, pixels in enumerate(data["pixels"]):
        for k, view in enumerate(pixels):
            for corner in np.flatnonzero(np.isfinite(view[:, 0])):
                rows.append((k, c, float(k), 0, corner, *view[corner], *data["points"][corner]))
    columns = [
        "sync_index",
        "cam_id",
        "frame_time",
        "object_id",
        "keypoint_id",
        "img_loc_x",
        "img_loc_y",
    ]
    columns += ["obj_loc_x", "obj_loc_y", "obj_loc_z"]
    points = ImagePoints(pd.DataFrame(rows, columns=columns))
    size = tuple(int(v) for v in data["size"])
    start = time.process_time()
    cameras = {
        k: CameraData(cam_id=k, size=size, matrix=K, distortions=np.pad(d, (0, 5 - len(d))))
        for k, (K, d) in enumerate(lenses(data))
    }
    volume = CaptureVolume.bootstrap(points, CameraArray(cameras)).optimize(refine_intrinsics=True)
    caliscope.seconds = time.process_time() - start
    found = volume.camera_array.cameras
    return [
        (
            found[k].matrix,
            found[k].distortions,
            np.ravel(cv2.Rodrigues(found[k].rotation)[0]),
            found[k].translation,
        )
        for k in sorted(found)
    ]


def main():
    """Calibrate and write the cameras and the seconds that it took."""
    name, source, target = sys.argv[1:4]
    cv2.setNumThreads(1)
    data = dict(np.load(source))
    peer = {"opencv": opencv, "aniposelib": aniposelib, "caliscope": caliscope}[name]
    seconds = np.inf
    for _ in range(1 if name == "aniposelib" else 3):
        start = time.process_time()
        cameras = peer(data)
        seconds = min(seconds, getattr(peer, "seconds", time.process_time() - start))
    document = {
        "seconds": seconds,
        "cameras": [[np.asarray(part, float).ravel().tolist() for part in c] for c in cameras],
    }
    with open(target, "w") as file:  # noqa: PTH123
        json.dump(document, file)


if __name__ == "__main__":
    main()
