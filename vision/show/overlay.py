"""Overlay videos: what each camera saw and where the joint pose puts it, drawn over the frames.

Detected corners are drawn in green (tags in the base in blue, round markers as circles), the
outlines that the trajectory projects in red. At the right scale they lie on each other: anything
else is a wrong layout, a late clock or a moved camera, and seen at once.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
from av.container import OutputContainer
from numpy.typing import NDArray

from freeswing.calib.board.recordings import Image, read_frames
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.rotation import matrix_from_angles
from freeswing.cdpr.system.drafts import draft_of
from freeswing.vision.look.follow import STATUS_NAMES
from freeswing.vision.look.pieces import Piece
from freeswing.vision.look.single_pose import lagrange
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.tracked_runs import TrackedCamera, TrackedRun

Array = NDArray[np.float64]

WIDTH_PX = 1200  # smaller images are enlarged by a whole number towards it
_GREEN, _BLUE, _RED, _WHITE = (80, 220, 80), (255, 160, 60), (60, 60, 255), (255, 255, 255)
_FRACTION_BITS = 4


def write_overlay(path: Path, run: TrackedRun, seen: TrackedCamera) -> None:
    """Writes one camera's recording of a run with the drawings, H.264 in `path`."""
    width, height = seen.camera.size_px
    zoom = max(1, round(WIDTH_PX / width))
    with draft_of(path) as draft, av.open(draft.name, "w", format="mp4") as container:
        stream = _stream(container, (width * zoom, height * zoom), _rate(seen))
        for picture in overlaid(run, seen, zoom):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="bgr24")))
        container.mux(stream.encode())


def overlaid(run: TrackedRun, seen: TrackedCamera, zoom: int = 1) -> Iterator[Image]:
    """The frames with their drawings, (h zoom, w zoom, 3) BGR."""
    frames = read_frames(seen.recording)
    for (number, _, image), (piece, row) in zip(frames, seen.frames(), strict=False):
        picture = np.repeat(np.repeat(image, zoom, axis=0), zoom, axis=1)
        picture = np.repeat(picture[:, :, None], 3, axis=2)
        outlines = projected_outlines(run.watch, run.trajectory, seen, float(piece.stamps_s[row]))
        for outline in outlines:
            _polygon(picture, outline, zoom, _RED)
        for thing, corners in sighted(piece, row, seen):
            if len(corners) == 1:
                _circle(picture, corners[0], zoom, _GREEN)
            else:
                platform = thing < run.watch.first_base
                _polygon(picture, corners, zoom, _GREEN if platform else _BLUE)
        stamp, status = piece.stamps_s[row], STATUS_NAMES[int(piece.status[row])]
        _write(picture, f"{seen.camera.name}  frame {number}  {stamp:.3f} s  {status}")
        yield picture


def sighted(piece: Piece, row: int, seen: TrackedCamera) -> list[tuple[int, Array]]:
    """Things seen in a frame, by index in the `Watch`, with corners or centre in px, (k, 2)."""
    found = []
    for o in np.flatnonzero(piece.frame_of == row):
        # A marker's later places are empty: its covariance says how many there are.
        count = 4 if piece.covariances[o, 2, 2] > 0.0 else 1
        rays = piece.rays[o].reshape(4, 2)[:count]
        pixels = seen.camera.project(np.column_stack([rays, np.ones(count)]))
        found.append((int(piece.things[o]), pixels))
    return found


def projected_outlines(
    watch: Watch, trajectory: Trajectory, seen: TrackedCamera, stamp_s: float
) -> list[Array]:
    """Outlines of the platform's tags in px by the trajectory, (4, 2) each; markers (1, 2).

    Each corner is put at the time at which its own row was read.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, sec. 6.1.
    """
    camera = seen.camera
    if not trajectory.is_pose or not np.isfinite(stamp_s):
        return []
    marks = watch.marker_positions_m[:, None]
    things = [*watch.tag_corners_m, *marks]
    rows = np.full(len(things), (camera.size_px[1] - 1) / 2)
    outlines: list[Array] = []
    for _ in range(2):
        times = stamp_s + camera.clock_offset_s + camera.line_time_s * rows
        outlines = []
        for k, (points, time_s) in enumerate(zip(things, times, strict=True)):
            pose = _pose_at(trajectory, float(time_s))
            if pose is None:
                continue
            places = camera.to_camera(points @ pose[0].T + pose[1])
            facing = len(points) == 1 or _faces(places)
            if facing and camera.sees(places).all():
                outlines.append(camera.project(places))
                rows[k] = outlines[-1][:, 1].mean()
    return outlines


def _pose_at(trajectory: Trajectory, time_s: float) -> tuple[Array, Array] | None:
    """Rotation and position between two known samples, None elsewhere."""
    times = trajectory.times_s
    right = int(np.clip(np.searchsorted(times, time_s), 1, len(times) - 1))
    step = times[right] - times[right - 1]
    if not times[0] - 0.5 * step <= time_s <= times[-1] + 0.5 * step:
        return None
    first = max(0, min(right - 2, len(times) - 4))
    part = trajectory.take(np.arange(first, min(first + 4, len(times))))
    if not part.is_known.all():
        return None
    values = lagrange(part.times_s, time_s) @ part.values
    return matrix_from_angles(values[3:]), values[:3]


def _faces(corners: Array) -> bool:
    normal = np.cross(corners[1] - corners[0], corners[0] - corners[3])
    return float(normal @ corners.mean(axis=0)) < 0.0


def _fixed(pixels: Array, zoom: int) -> NDArray[np.int32]:
    """Pixels of the enlarged picture in OpenCV's fixed-point numbers; pixel centres are kept."""
    return np.round(((pixels + 0.5) * zoom - 0.5) * 2**_FRACTION_BITS).astype(np.int32)


def _polygon(picture: Image, corners: Array, zoom: int, colour: tuple[int, int, int]) -> None:
    points = [_fixed(corners, zoom)]
    cv2.polylines(picture, points, True, colour, 1, cv2.LINE_AA, _FRACTION_BITS)


def _circle(picture: Image, centre: Array, zoom: int, colour: tuple[int, int, int]) -> None:
    x, y = (int(v) for v in _fixed(centre, zoom))
    cv2.circle(picture, (x, y), 6 << _FRACTION_BITS, colour, 1, cv2.LINE_AA, _FRACTION_BITS)


def _write(picture: Image, text: str) -> None:
    font = cv2.FONT_HERSHEY_SIMPLEX
    (width, height), below = cv2.getTextSize(text, font, 0.7, 1)
    cv2.rectangle(picture, (0, 0), (width + 20, height + below + 16), (0, 0, 0), -1)
    cv2.putText(picture, text, (10, height + 8), font, 0.7, _WHITE, 1, cv2.LINE_AA)


def _stream(container: OutputContainer, size_px: tuple[int, int], rate: Fraction) -> av.VideoStream:
    stream = container.add_stream("libx264", rate=rate)
    if not isinstance(stream, av.VideoStream):
        raise TypeError("libx264 is no video codec here")
    stream.width, stream.height = (value - value % 2 for value in size_px)
    stream.pix_fmt = "yuv420p"
    stream.options = {"crf": "20", "preset": "veryfast"}
    return stream


def _rate(seen: TrackedCamera) -> Fraction:
    stamps = [float(piece.stamps_s[row]) for piece, row in seen.frames()]
    steps = np.diff([stamp for stamp in stamps if np.isfinite(stamp)])
    step = float(np.median(steps)) if len(steps) else 0.04
    return Fraction(1.0 / step).limit_denominator(1000) if step > 0.0 else Fraction(25)
