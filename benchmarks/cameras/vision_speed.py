"""Speed and corner accuracy on the same frames: tracking beside full-frame peers.

1280 x 1024 frames with six moving tags of 40 to 200 px, blur 0.7, noise 3. Peers search the whole
image: cv2.aruco with SUBPIX, and pyapriltags (whose corners are put back by half a pixel). The
decode-only rate of the same frames as video is the limit of any tracker.

    python benchmarks/cameras/vision_speed.py [--frames 60]
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from freeswing.calib.board.recordings import Recording, read_frames
from freeswing.calib.camera.camera import Camera
from freeswing.calib.tags.tag_patterns import cut_dictionary, tag_dictionary
from freeswing.cdpr.measured.target import Tag, Target
from freeswing.vision.look.follow import Follower
from freeswing.vision.look.video import write_video
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.render.render_scene import Look, Renderer
from tests.vision.scenes import facing, look_at, scene_of, swing

SIZE_PX = (1280, 1024)
FOCAL_PX = 1300.0
SIDES_PX = (40, 60, 80, 110, 150, 200)


def tags() -> tuple[Tag, ...]:
    """Six tags side by side, each of the size that gives its side in pixels at 2 m."""
    places = ((-0.62, 0.45), (-0.3, 0.42), (0.05, 0.4), (0.45, 0.35), (-0.35, -0.2), (0.3, -0.3))
    return tuple(
        Tag("tag36h11", k, side * 2.0 / FOCAL_PX, facing((x, 0.0, z), 0.2 - 0.1 * k))
        for k, (side, (x, z)) in enumerate(zip(SIDES_PX, places, strict=True))
    )


def slow_swing(times_s):
    """A swing of some centimetres, so that all tags stay in view."""
    return swing(times_s, amplitude_m=0.05, turn_rad=0.1)


def true_corners(camera: Camera, target: Target, time_s: float) -> np.ndarray:
    """Pixels of all corners, (6, 4, 2)."""
    positions, rotations = slow_swing(np.array([time_s]))
    corners = np.array([tag.corners_platform_m for tag in target.tags])
    base = corners @ rotations[0].T + positions[0]
    return camera.project(camera.to_camera(base))


def timed(function, images, times):
    """Corners by frame and the frames per second of processor time (one thread each)."""
    function(images[0], times[0] - 0.01)
    start = time.process_time()
    found = [function(image, t) for image, t in zip(images, times, strict=True)]
    return found, len(images) / (time.process_time() - start)


def cv2_subpix(*, cut: bool):
    """Full-frame cv2.aruco with corner refinement; the dictionary whole or cut to the ids."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    dictionary = cut_dictionary("tag36h11", tuple(range(6))) if cut else tag_dictionary("tag36h11")
    detector = cv2.aruco.ArucoDetector(dictionary, parameters)

    def detect(image, _):
        corners, ids, _ = detector.detectMarkers(image)
        return (
            {} if ids is None else {int(i): c[0] for i, c in zip(ids.ravel(), corners, strict=True)}
        )

    return detect


def apriltags(decimate: float):
    """Pyapriltags at the given decimation; corners come anticlockwise from the bottom left."""
    import pyapriltags

    detector = pyapriltags.Detector("tag36h11", nthreads=1, quad_decimate=decimate)

    def detect(image, _):
        return {d.tag_id: d.corners - 0.5 for d in detector.detect(image) if d.tag_id < 6}

    return detect


def ours(camera: Camera, target: Target):
    """The follower, from the second frame on by prediction."""
    follower = Follower(camera, Watch.of(target))

    def detect(image, time_s):
        view = follower.look(image, time_s)
        return {
            s.thing: camera.project(np.column_stack([s.rays.reshape(4, 2), np.ones(4)]))
            for s in view.sightings
        }

    return detect


def accuracy(found, truth) -> tuple[float, float, float]:
    """Share of tags found, rms and largest mean error per axis in px, order of corners apart."""
    errors = []
    for frame, corners in zip(found, truth, strict=True):
        for k, measured in frame.items():
            away = np.linalg.norm(np.asarray(measured)[:, None] - corners[k][None], axis=2)
            errors.append(np.asarray(measured) - corners[k][np.argmin(away, axis=1)])
    error = np.array(errors)
    share = len(errors) / (6 * len(found))
    return (
        share,
        float(np.sqrt((error**2).mean())),
        float(np.abs(error.reshape(-1, 2).mean(0)).max()),
    )


def decode_rate(path: Path) -> float:
    """Frames a second of reading the video and nothing else."""
    recording = Recording("camera", path)
    start = time.process_time()
    count = sum(1 for _ in read_frames(recording))
    return count / (time.process_time() - start)


def main() -> None:
    """Renders, times and prints."""
    parser = argparse.ArgumentParser(description="Speed and accuracy beside peers.")
    parser.add_argument("--frames", type=int, default=60)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    lens = [FOCAL_PX, FOCAL_PX, 639.5, 511.5, -0.1, 0.03, 0.0005, -0.0005]
    camera = Camera(
        "camera", SIZE_PX, "OPENCV", np.array(lens), look_at((0, -2.0, 0.05), (0, 0, 0))
    )
    target = Target(tags())
    times = np.arange(options.frames) / 100.0
    scene = scene_of(target.tags, motion=slow_swing)
    images = list(Renderer(camera, scene, Look(noise=3.0)).frames(times))
    truth = [true_corners(camera, target, t) for t in times]
    rows = []
    peers = (
        ("tracking", ours(camera, target)),
        ("cv2.aruco SUBPIX", cv2_subpix(cut=False)),
        ("the same, cut dictionary", cv2_subpix(cut=True)),
        ("pyapriltags, decimate 1", apriltags(1.0)),
        ("pyapriltags, decimate 2", apriltags(2.0)),
    )
    for name, function in peers:
        found, rate = timed(function, images, times)
        share, rms, bias = accuracy(found, truth)
        rows.append({"name": name, "hz": rate, "found": share, "rms_px": rms, "bias_px": bias})
        print(
            f"{name:26s} {rate:7.1f} frames/s, found {share:.3f}, rms {rms:.4f} px an axis, "
            f"bias {bias:.4f}"
        )
    with tempfile.TemporaryDirectory() as folder:
        for codec, suffix in (("ffv1", ".mkv"), ("magicyuv", ".avi")):
            path = Path(folder) / f"camera{suffix}"
            write_video(path, iter(images), times, codec=codec)
            rate = decode_rate(path)
            both = 1.0 / (1.0 / rate + 1.0 / rows[0]["hz"])
            rows.append({"name": f"decode {codec}", "hz": rate, "share": both / rate})
            print(
                f"decode only, {codec:13s} {rate:7.1f} frames/s; decode and track in one process "
                f"{both:.1f}, {100 * both / rate:.0f} % of it"
            )
    for row in rows[1:5]:
        print(f"tracking is {rows[0]['hz'] / row['hz']:.1f} times as fast as {row['name']}")
    print(json.dumps(rows))


if __name__ == "__main__":
    main()
