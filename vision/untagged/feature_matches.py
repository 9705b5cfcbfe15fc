"""COLMAP's features of an image, and which of two images' features are the same.

Source:
    Lowe 2004, Distinctive image features from scale-invariant keypoints.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.exchange.colmap import HALF_PIXEL

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# Lowe's: nearest over second nearest; above 0.8 more matches are wrong than are lost below.
RATIO = 0.8
# Of unit descriptors: the same patch from 25 degrees aside is nearer than this.
MOST_ANGLE_COS = 0.75
FEATURES = 4000


@dataclass(frozen=True, slots=True)
class Features:
    """Features of one image.

    Attributes:
        pixels: (n, 2).
        sizes_px: standard deviation of each blob, (n,).
        descriptors: unit length, (n, 128).
    """

    pixels: Array
    sizes_px: Array
    descriptors: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.pixels)

    def select(self, keep: NDArray[Any]) -> Features:
        """Those picked by a mask or an index array."""
        return Features(self.pixels[keep], self.sizes_px[keep], self.descriptors[keep])


@dataclass(slots=True)
class FeatureFinder:
    """COLMAP's detector; keep it, it takes memory of its own."""

    _detector: Any = field(init=False, repr=False)

    def __post_init__(self) -> None:
        import pycolmap

        pycolmap.logging.minloglevel = 2
        options = pycolmap.FeatureExtractionOptions()
        options.sift.max_num_features = FEATURES
        options.sift.first_octave = 0
        options.sift.max_num_orientations = 1  # one point is one number in the map
        options.num_threads = 1
        self._detector = pycolmap.FeatureExtractor.create(options, pycolmap.Device.cpu)

    def look(self, image: NDArray[np.uint8], left: int = 0, top: int = 0) -> Features:
        """Features of an image (h, w) that is cut out of a larger one at (left, top)."""
        import pycolmap

        bitmap = pycolmap.Bitmap.from_array(np.ascontiguousarray(image))
        points, told = self._detector.extract(bitmap)
        if len(points) == 0:
            return Features(np.zeros((0, 2)), np.zeros(0), np.zeros((0, 128), np.float32))
        pixels = np.array([(p.x, p.y) for p in points], dtype=np.float64) - HALF_PIXEL
        sizes = np.array([p.compute_scale() for p in points], dtype=np.float64)
        raw = np.asarray(told.data).astype(np.float32)
        raw /= np.maximum(np.linalg.norm(raw, axis=1, keepdims=True), 1e-9)
        return Features(pixels + np.array([left, top]), sizes, raw)


def matched(first: NDArray[np.float32], second: NDArray[np.float32]) -> tuple[Ints, Ints]:
    """Places in both of the descriptors that are each other's nearest, and clearly so.

    Args:
        first: (n, 128).
        second: (m, 128).
    """
    none = np.zeros(0, dtype=np.int64)
    if len(first) < 2 or len(second) < 2:
        return none, none
    likeness = first @ second.T
    best = likeness.argmax(axis=1)
    back = likeness.argmax(axis=0)
    rows = np.arange(len(first))
    top = likeness[rows, best]
    likeness[rows, best] = -1.0
    distance = np.sqrt(np.maximum(2.0 - 2.0 * top, 0.0))
    next_distance = np.sqrt(np.maximum(2.0 - 2.0 * likeness.max(axis=1), 1e-12))
    keep = (back[best] == rows) & (top > MOST_ANGLE_COS) & (distance < RATIO * next_distance)
    return rows[keep], best[keep]
