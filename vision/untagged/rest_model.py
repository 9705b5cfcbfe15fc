"""The platform as points with descriptors, from the calibrated cameras' frames of it at rest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.camera import Camera
from freeswing.calib.rig.triangulation import triangulate
from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.measured.target import Untagged
from freeswing.vision.untagged.aligned_patches import Patches
from freeswing.vision.untagged.feature_matches import FeatureFinder, Features, matched
from freeswing.vision.untagged.named_points import named_frame
from freeswing.vision.untagged.rest_patches import SeenAtRest, patches_at_rest

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Image = NDArray[np.uint8]

# Grey levels between a frame at rest and one of a swing: noise makes 5, another print 20 and more.
CHANGED_GREY = 12.0
# Share of a swing's frames that differ where the platform hangs at rest; where it only passes by,
# few do.
CHANGED_SHARE = 0.4
# A point whose cameras disagree by more is a wrong match.
WORST_PX = 2.0
# Six numbers of a pose from points of two numbers each; 30 leave a tenth of a point's noise.
LEAST_POINTS = 30
_SMOOTH_PX = 1.5


@dataclass(frozen=True, slots=True)
class RestModel:
    """Points of the platform.

    Attributes:
        points_m: platform frame, (n, 3).
        T_base_rest: platform to base at rest, by the named points, (4, 4).
        seen: by camera name: points, and their features at rest, in one order.
        patches: of all points.
        at_rest: by camera name, where it sees them at rest.
        frame_covariance: how well the marks give its frame: of position (m) and small rotation in
            the base frame, (6, 6).
    """

    points_m: Array
    T_base_rest: Array
    seen: Mapping[str, tuple[Ints, Features]]
    patches: Patches
    at_rest: Mapping[str, SeenAtRest]
    frame_covariance: Array


def moving_part(rest: Image, frames: Sequence[Image]) -> NDArray[np.bool_]:
    """Where the platform hangs at rest: what differs from most frames of a swing, (h, w).

    Source:
        Gonzalez, Woods 2008, Digital Image Processing, ch. 9: opening and closing of
        differences.
    """
    if not len(frames):
        return np.ones(rest.shape, dtype=bool)
    still = cv2.GaussianBlur(rest.astype(np.float32), (0, 0), _SMOOTH_PX)
    count = np.zeros(rest.shape)
    for frame in frames:
        now = cv2.GaussianBlur(frame.astype(np.float32), (0, 0), _SMOOTH_PX)
        count += np.abs(now - still) > CHANGED_GREY
    mask = (count >= CHANGED_SHARE * len(frames)).astype(np.uint8)
    closed = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((15, 15), np.uint8))
    return np.asarray(cv2.morphologyEx(closed, cv2.MORPH_OPEN, np.ones((5, 5), np.uint8)) > 0)


def rest_model(
    cameras: Sequence[Camera],
    rests: Mapping[str, Image],
    swings: Mapping[str, Sequence[Image]],
    untagged: Untagged,
) -> RestModel:
    """The platform's points in the frame that three named points of target.toml give.

    Args:
        cameras: as calibrated.
        rests: each camera's image of the platform at rest.
        swings: some frames of each in which it moves, to tell it from what stands behind.
        untagged: what target.toml says of it.

    Raises:
        InputError: marks that make no sense.
        DataError: too few common features, or named points that do not fit.
    """
    seen = [camera for camera in cameras if camera.name in rests]
    finder = FeatureFinder()
    found = []
    for camera in seen:
        rest = rests[camera.name]
        features = finder.look(rest)
        mask = moving_part(rest, swings.get(camera.name, ()))
        at = np.rint(features.pixels).astype(int)
        height, width = rest.shape
        inside = mask[np.clip(at[:, 1], 0, height - 1), np.clip(at[:, 0], 0, width - 1)]
        found.append(features.select(inside))
    T_base_rest, covariance = named_frame(seen, untagged)
    pixels, features_of = _tracks(seen, found)
    points = triangulate(seen, pixels)
    error = np.stack([_errors(c, points, p) for c, p in zip(seen, pixels, strict=True)])
    with np.errstate(invalid="ignore"):
        good = np.isfinite(points[:, 0]) & (np.nanmax(error, axis=0) < WORST_PX)
    if good.sum() < LEAST_POINTS:
        counts = ", ".join(f"{c.name} {len(f)}" for c, f in zip(seen, found, strict=True))
        raise DataError(
            f"{untagged.rest}: {int(good.sum())} points of the platform are seen by two cameras, "
            f"need {LEAST_POINTS} (features where it hangs: {counts}): cameras more than 30 "
            "degrees apart see too little alike; add one between, or stick printed texture on it"
        )
    back = np.linalg.inv(T_base_rest)
    inside = points[good] @ back[:3, :3].T + back[:3, 3]
    numbers = np.full(len(points), -1)
    numbers[good] = np.arange(int(good.sum()))
    by_camera = {}
    for camera, own, feature in zip(seen, features_of, found, strict=True):
        rows = np.flatnonzero((own >= 0) & good)
        by_camera[camera.name] = (numbers[rows], feature.select(own[rows]))
    placed, patches, at_rest = patches_at_rest(seen, rests, inside, T_base_rest, by_camera)
    return RestModel(placed, T_base_rest, by_camera, patches, at_rest, covariance)


def _errors(camera: Camera, points: Array, pixels: Array) -> Array:
    return np.linalg.norm(pixels - camera.project(camera.to_camera(points)), axis=-1)


def _tracks(cameras: Sequence[Camera], found: Sequence[Features]) -> tuple[Array, list[Ints]]:
    """Pixels of each point in each camera, (n_c, n, 2), and its feature there (-1: none)."""
    tracks: list[dict[int, int]] = []
    place: dict[tuple[int, int], int] = {}
    for a in range(len(cameras)):
        for b in range(a + 1, len(cameras)):
            pairs = matched(found[a].descriptors, found[b].descriptors)
            for i, j in zip(*(p.tolist() for p in pairs), strict=True):
                known = place.get((a, i), place.get((b, j)))
                if known is None:
                    known = len(tracks)
                    tracks.append({})
                if tracks[known].setdefault(a, i) == i and tracks[known].setdefault(b, j) == j:
                    place[a, i] = place[b, j] = known
    pixels = np.full((len(cameras), len(tracks), 2), np.nan)
    own = [np.full(len(tracks), -1) for _ in cameras]
    for number, track in enumerate(tracks):
        for camera, feature in track.items():
            own[camera][number] = feature
            pixels[camera, number] = found[camera].pixels[feature]
    return pixels, own
