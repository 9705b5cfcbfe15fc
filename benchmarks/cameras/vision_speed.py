"""Speed and corner accuracy on the same frames: tracking beside full-frame peers.

1280 x 1024 frames with six moving tags of 40 to 200 px, blur 0.7, noise 3. Peers search the whole
image: cv2.aruco with SUBPIX, and pyapriltags (whose corners are put back by half a pixel). All take
turns, the least time of several rounds counts. Then the same frames as video: decoding alone, by
one thread and by as many as the decoder likes, beside decoding and tracking. A decoder that fills
both cores leaves none idle: tracking's share of all processor time is then what is lost. On other
than two quiet cores the wall's figures say little.

    python benchmarks/cameras/vision_speed.py [--frames 60] [--rounds 3]
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import av
import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from freeswing.calib.board.recordings import Recording, read_frames
from freeswing.calib.camera.camera import Camera
from freeswing.calib.tags.tag_patterns import cut_dictionary, tag_dictionary
from freeswing.cdpr.measured.target import Tag, Target
from freeswing.vision.look.follow import Follower
from freeswing.vision.look.sightings import collect_sightings
from freeswing.vision.look.video import write_video
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.render.render_scene import Look, Renderer
from tests.vision.scenes import facing, look_at, scene_of, swing

SIZE_PX = (1280, 1024)
FOCAL_PX = 1300.0
SIDES_PX = (40, 60, 80, 110, 150, 200)
CLOCKS = ("wall", "cpu")
DETECTORS: dict = {}  # of pyapriltags: making one anew faults its memory


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


def timed(look, images, times):
    """Corners by frame and seconds of processor time a frame, from a fresh `look` (one thread)."""
    function = look()
    for image, t in zip(images[:4], times, strict=False):
        function(image, t)  # what is found the first time, and compiled
    start = time.process_time()
    found = [function(image, t) for image, t in zip(images[4:], times[4:], strict=True)]
    return found, (time.process_time() - start) / len(found)


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


def by_side(found, truth):
    """Side in px, rms per axis and largest mean error of a corner, px, of each tag."""
    for k, side in enumerate(SIDES_PX):
        pairs = [(f[k], c[k]) for f, c in zip(found, truth, strict=True) if k in f]
        error = np.array([measured - corners for measured, corners in pairs])
        yield side, float(np.sqrt((error**2).mean())), float(np.abs(error.mean(axis=0)).max())


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


def decoded_by_one_thread(path: Path) -> None:
    """Decodes a video without the decoder's own threads."""
    with av.open(str(path)) as container:
        container.streams.video[0].thread_type = "NONE"
        for frame in container.decode(video=0):
            frame.to_ndarray(format="gray")


def pipeline(camera: Camera, target: Target, images, codec: str, suffix: str, rounds: int) -> dict:
    """Seconds a frame, wall and processor, of decoding alone and of decoding with tracking.

    Tracking is what `freeswing track` does with one recording: a thread decodes and looks for
    copies, another follows the tags, pieces of sightings are written.
    """
    best = {f"{name}_{kind}": np.inf for name in ("one", "decode", "both") for kind in CLOCKS}

    def clock(name: str, function) -> None:
        wall, cpu = time.perf_counter(), time.process_time()
        function()
        took_s = (time.perf_counter() - wall, time.process_time() - cpu)
        for kind, took in zip(CLOCKS, took_s, strict=True):
            best[f"{name}_{kind}"] = min(best[f"{name}_{kind}"], took / len(images))

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"camera{suffix}"
        times = np.arange(len(images)) / 100.0
        write_video(path, iter(images), times, codec=codec)
        recording = Recording("camera", path)
        for k in range(rounds):
            pieces = Path(folder) / f"pieces-{k}"
            pieces.mkdir()
            clock("one", lambda: decoded_by_one_thread(path))
            clock("decode", lambda: sum(1 for _ in read_frames(recording)))
            clock(
                "both",
                lambda: collect_sightings(pieces, camera, Watch.of(target), recording, 100.0),  # noqa: B023
            )
    return {"name": codec, **best}


def scenery() -> tuple[Camera, Target]:
    """The camera and what it looks at."""
    lens = [FOCAL_PX, FOCAL_PX, 639.5, 511.5, -0.1, 0.03, 0.0005, -0.0005]
    eye = look_at((0, -2.0, 0.05), (0, 0, 0))
    return Camera("camera", SIZE_PX, "OPENCV", np.array(lens), eye), Target(tags())


def main() -> None:
    """Renders, times and prints."""
    parser = argparse.ArgumentParser(description="Speed and accuracy beside peers.")
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--rounds", type=int, default=3, help="of each, in turn; the least counts")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    camera, target = scenery()
    times = np.arange(options.frames) / 100.0
    scene = scene_of(target.tags, motion=slow_swing)
    images = list(Renderer(camera, scene, Look(noise=3.0)).frames(times))
    truth = [true_corners(camera, target, t) for t in times]
    peers = {
        "tracking": lambda: ours(camera, target),
        "cv2.aruco SUBPIX": lambda: cv2_subpix(cut=False),
        "the same, cut dictionary": lambda: cv2_subpix(cut=True),
        "pyapriltags, decimate 1": lambda: DETECTORS[1.0],
        "pyapriltags, decimate 2": lambda: DETECTORS[2.0],
    }
    DETECTORS.update({decimate: apriltags(decimate) for decimate in (1.0, 2.0)})
    took, seen = dict.fromkeys(peers, np.inf), {}
    for _ in range(options.rounds):
        for name, look in peers.items():
            seen[name], seconds = timed(look, images, times)
            took[name] = min(took[name], seconds)
    rows = []
    for name, found in seen.items():
        share, rms, bias = accuracy(found, truth[4:])
        rows.append({"name": name, "ms": 1e3 * took[name], "found": share, "rms_px": rms})
        print(
            f"{name:26s} {1e3 * took[name]:7.2f} ms of processor a frame, found {share:.3f}, rms "
            f"{rms:.4f} px an axis, bias {bias:.4f}; tracking is "
            f"{took[name] / took['tracking']:.1f} times as fast"
        )
    for side, rms, chi in by_side(seen["tracking"], truth[4:]):
        print(f"tracking, tag of {side:3d} px: rms {rms:.4f} px an axis, worst mean {chi:.4f}")
    there_and_back = (images + images[-2:0:-1]) * 3
    for codec, suffix in (("ffv1", ".mkv"), ("magicyuv", ".avi")):
        row = pipeline(camera, target, there_and_back, codec, suffix, options.rounds)
        rows.append(row)
        print(
            f"{codec}: decoding alone {1e3 * row['decode_cpu']:.2f} ms of processor a frame, "
            f"with tracking {1e3 * row['both_cpu']:.2f} ({row['decode_cpu'] / row['both_cpu']:.2f} "
            f"of the rate on one core); by the wall {1e3 * row['decode_wall']:.2f} and "
            f"{1e3 * row['both_wall']:.2f} ms ({row['decode_wall'] / row['both_wall']:.2f} of the "
            f"decoder's rate with all its threads, {row['one_wall'] / row['both_wall']:.2f} of its "
            f"rate with one, {1e3 * row['one_wall']:.2f} ms)"
        )
    print(json.dumps(rows))


if __name__ == "__main__":
    main()
