"""One camera's recording of a platform without tags: its points found in each frame."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from itertools import chain, islice
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from freeswing.calib.board.recordings import Recording, read_frames
from freeswing.calib.camera.camera import Camera
from freeswing.calib.footage.copied_frames import with_copies
from freeswing.calib.footage.frame_times import frame_times, needed
from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.rotation import exp_rotation, transform
from freeswing.vision.look.follow import (
    NOTHING,
    REPEATED,
    UNSTAMPED,
    USED,
    FrameView,
    Sighting,
)
from freeswing.vision.look.pieces import (
    FRAMES_A_PIECE,
    Piece,
    input_hash,
    is_whole,
    load_piece,
    piece_path,
    save_piece,
)
from freeswing.vision.look.single_pose import Pose
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.untagged.aligned_patches import Aligned, Patches, SmoothImage, align_seen
from freeswing.vision.untagged.feature_matches import FeatureFinder, Features, matched

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Image = NDArray[np.uint8]

# A frame with fewer matches that agree on a pose tells nothing that could be trusted.
LEAST_MATCHES = 12
# Between a match and the pose of the others: beyond it is another patch.
INLIER_PX = 3.0
_MARGIN_PX = 60
_ROUNDS = 400


@dataclass(slots=True)
class PointMatcher:
    """Finds the platform's points in one camera's frames, taken in order."""

    camera: Camera
    watch: Watch
    numbers: Ints
    at_rest: Features
    patches: Patches
    past: list[tuple[float, Pose]] = field(default_factory=list)
    base_rays: dict[int, Array] = field(default_factory=dict)
    before: dict[int, tuple[float, float, float, float]] = field(default_factory=dict)
    misses: int = 0
    count: int = 0
    _finder: FeatureFinder = field(default_factory=FeatureFinder)
    _box: tuple[int, int, int, int] | None = None

    def look(self, image: Image) -> FrameView:
        """The points in a frame: those that one pose explains."""
        left, top, right, bottom = self._box or (0, 0, image.shape[1], image.shape[0])
        features = self._finder.look(image[top:bottom, left:right], left, top)
        view = self._view(features, SmoothImage.of(image[top:bottom, left:right], left, top))
        if view.status != USED and self._box is not None:
            self._box = None
            view = self._view(self._finder.look(image), SmoothImage.of(image))
        return view

    def forget(self) -> None:
        """As before the first frame, so that a piece does not depend on the one before."""
        self._box = None

    def _view(self, features: Features, image: SmoothImage) -> FrameView:
        own, seen = matched(self.at_rest.descriptors, features.descriptors)
        pixels = features.pixels[seen]
        rays = self.camera.normalise(pixels)
        fine = np.isfinite(rays[:, 0])
        own, seen, rays = own[fine], seen[fine], rays[fine]
        points = self.watch.marker_positions_m
        solved = agreed_pose(points[self.numbers[own]], rays, self.camera)
        if solved is None:
            return FrameView(NOTHING, (), None)
        pose, inside = solved
        self._box = self._around(features.pixels[seen[inside]])
        which, found = align_seen(self.patches, image, self.camera, transform(*pose), points)
        if len(which) < LEAST_MATCHES:
            return FrameView(NOTHING, (), None)
        things = self.watch.first_marker + which
        return FrameView(USED, sightings_of(things, found, self.camera), pose)

    def _around(self, pixels: Array) -> tuple[int, int, int, int]:
        width, height = self.camera.size_px
        low = np.maximum(np.floor(pixels.min(axis=0)).astype(int) - _MARGIN_PX, 0)
        high = np.ceil(pixels.max(axis=0)).astype(int) + _MARGIN_PX
        return int(low[0]), int(low[1]), int(min(high[0], width)), int(min(high[1], height))


def sightings_of(things: Ints, found: Aligned, camera: Camera) -> tuple[Sighting, ...]:
    """What of the `Watch` is where, as rays with covariance."""
    rays, covariances = np.zeros((len(things), 8)), np.zeros((len(things), 8, 8))
    rays[:, :2] = camera.normalise(found.pixels)
    ahead = np.concatenate([rays[:, :2], np.ones((len(rays), 1))], axis=1)
    back = np.linalg.inv(camera.project_jacobian(ahead)[1][:, :, :2])
    covariances[:, :2, :2] = found.std_px[:, None, None] ** 2 * back @ np.swapaxes(back, 1, 2)
    return tuple(
        Sighting(int(thing), ray, covariance, np.full(4, pixel[1]), 0.0, float(std))
        for thing, ray, covariance, pixel, std in zip(
            things, rays, covariances, found.pixels, found.std_px, strict=True
        )
    )


def agreed_pose(points_m: Array, rays: Array, camera: Camera) -> tuple[Pose, Ints] | None:
    """The pose that most matches agree on, and which; None where too few do.

    Args:
        points_m: platform frame, (n, 3).
        rays: x/z, y/z, (n, 2).
        camera: whose focal length gives pixels.
    """
    if len(points_m) < LEAST_MATCHES:
        return None
    cv2.setRNGSeed(0)
    good, turn, shift, inside = cv2.solvePnPRansac(
        np.ascontiguousarray(points_m),
        np.ascontiguousarray(rays[:, None]),
        np.eye(3),
        None,
        iterationsCount=_ROUNDS,
        reprojectionError=INLIER_PX / float(camera.focal_px.mean()),
        confidence=0.9999,
        flags=cv2.SOLVEPNP_SQPNP,
    )
    if not good or inside is None or len(inside) < LEAST_MATCHES:
        return None
    rotation = np.asarray(exp_rotation(np.ravel(turn)))
    return (rotation, np.ravel(shift).astype(np.float64)), np.ravel(inside).astype(np.int64)


def collect_points(
    folder: Path,
    camera: Camera,
    watch: Watch,
    at_rest: tuple[Ints, Features],
    patches: Patches,
    recording: Recording,
    frame_rate_hz: float | None,
) -> list[Path]:
    """The pieces of a recording, as `vision.look.sightings` makes those of tags.

    Args:
        folder: where pieces are kept.
        camera: its lens.
        watch: the platform's points.
        at_rest: points that this camera sees at rest, and their features there.
        patches: of all points.
        recording: the frames.
        frame_rate_hz: serves where the recording has no stamps.

    Raises:
        InputError: frames of another size than the camera, or without stamps.
    """
    stamps = needed(frame_times(recording, frame_rate_hz), recording)
    digest = hashlib.sha256(repr((stamps.rate_hz, stamps.stamps)).encode())
    for array in (at_rest[1].descriptors, patches.greys, patches.tangents):
        digest.update(np.ascontiguousarray(array).tobytes())
    inputs = input_hash(camera, watch, recording, b"untagged" + digest.digest())
    paths: list[Path] = []
    while is_whole(path := piece_path(folder, camera.name, inputs, len(paths))):
        paths.append(path)
    if paths and len(load_piece(paths[-1]).numbers) < FRAMES_A_PIECE:
        return paths
    matcher = PointMatcher(camera, watch, *at_rest, patches)
    frames = islice(with_copies(read_frames(recording)), len(paths) * FRAMES_A_PIECE, None)
    while (first := next(frames, None)) is not None:
        matcher.forget()
        numbers, times, views = [], [], []
        for (number, label, image), is_copy in chain((first,), islice(frames, FRAMES_A_PIECE - 1)):
            if image.shape != camera.size_px[::-1]:
                raise InputError(
                    f"{label}: {image.shape[1]} x {image.shape[0]} pixels, but cameras.toml has "
                    f"{camera.size_px[0]} x {camera.size_px[1]} for {camera.name}: calibrate at "
                    "the size that is recorded"
                )
            time_s = stamps.at(number)
            if not np.isfinite(time_s):
                view = FrameView(UNSTAMPED, (), None)
            else:
                view = FrameView(REPEATED, (), None) if is_copy else matcher.look(image)
            numbers.append(number)
            times.append(time_s)
            views.append(view)
        path = piece_path(folder, camera.name, inputs, len(paths))
        save_piece(path, Piece.of(numbers, times, views), matcher)
        paths.append(path)
    return paths
