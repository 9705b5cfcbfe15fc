"""What the cameras saw of a moving board and of fixed points, before any calibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from freeswing.calib.camera.lens_models import Array


@dataclass(frozen=True, slots=True)
class Views:
    """Sightings of one rigid board; a view is one camera at one moment.

    A moment is an instant at which frames count as simultaneous, a piece a stretch of moments along
    which the board's motion is one polynomial: a single moment for a board at rest.

    Attributes:
        camera: index of the camera, (n,).
        moment: index of the moment, (n,).
        piece: index of the piece of the board's motion, (n,).
        pixels: corners, NaN where unseen, (n, n_points, 2).
        lag_s: the view's own stamp minus the middle of its piece, NaN before a board at rest while
            others move, (n,).
        whitening: lower triangles F with F'F the inverse covariance of a group of corners that
            were found together (a tag's four), over that of the rig's typical corner,
            (n, n_groups, 2 c, 2 c).
        label: how a person finds the view: recording and frame, (n,) text.
    """

    camera: np.ndarray
    moment: np.ndarray
    piece: np.ndarray
    pixels: Array
    lag_s: Array
    whitening: Array
    label: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.camera)

    @property
    def seen(self) -> np.ndarray:
        """Which corners were seen, bool (n, n_points)."""
        return np.isfinite(self.pixels[..., 0])

    @property
    def group_size(self) -> int:
        """Corners to a group."""
        return self.whitening.shape[-1] // 2

    def select(self, keep: np.ndarray) -> Views:
        """The views picked by a mask or an index array."""
        index = np.arange(len(self))[keep]
        return Views(
            self.camera[index],
            self.moment[index],
            self.piece[index],
            self.pixels[index],
            self.lag_s[index],
            self.whitening[index],
            tuple(self.label[i] for i in index),
        )

    def compacted(self) -> tuple[Views, np.ndarray]:
        """The same views, moments and pieces renumbered from 0; and the old numbers of pieces."""
        _, moment = np.unique(self.moment, return_inverse=True)
        pieces, piece = np.unique(self.piece, return_inverse=True)
        return replace(self, moment=moment, piece=piece), pieces

    def whitened(self, residuals: Array) -> Array:
        """Residuals (n, n_points, 2) in units of the typical corner's, (n, n_groups, 2 c)."""
        grouped = residuals.reshape(*self.whitening.shape[:-1])
        return (self.whitening @ grouped[..., None])[..., 0]


def joined_views(parts: Sequence[Views]) -> Views:
    """The views of all parts, one after the other; moments and pieces keep their numbers."""
    return Views(
        np.concatenate([part.camera for part in parts]),
        np.concatenate([part.moment for part in parts]),
        np.concatenate([part.piece for part in parts]),
        np.concatenate([part.pixels for part in parts]),
        np.concatenate([part.lag_s for part in parts]),
        np.concatenate([part.whitening for part in parts]),
        tuple(label for part in parts for label in part.label),
    )


def make_views(
    camera: object,
    moment: object,
    pixels: object,
    lag_s: Array | None = None,
    label: tuple[str, ...] | None = None,
    covariance_px2: Array | None = None,
) -> Views:
    """Views of a board at rest at every moment; order is camera, then moment.

    Args:
        camera: (n,).
        moment: (n,).
        pixels: (n, n_points, 2).
        lag_s: stamp minus the moment's time, zero when None, (n,).
        label: (n,) text.
        covariance_px2: what the detector says of the noise of corners that were found together,
            (n, n_groups, 2 c, 2 c), of which only ratios count; all corners alike when None.
    """
    cameras, moments = np.asarray(camera, dtype=int), np.asarray(moment, dtype=int)
    points = np.array(pixels, dtype=np.float64)
    order = np.lexsort((moments, cameras))
    lag = np.zeros(len(cameras)) if lag_s is None else np.asarray(lag_s, dtype=np.float64)
    names = label or tuple(f"camera {c} moment {m}" for c, m in zip(cameras, moments, strict=True))
    if covariance_px2 is None:
        whitening = np.broadcast_to(np.eye(2), (*points.shape[:2], 2, 2))
    else:
        whitening = _whitening(points, np.asarray(covariance_px2, dtype=np.float64))
    return Views(
        cameras[order],
        moments[order],
        moments[order],
        points[order],
        lag[order],
        np.ascontiguousarray(whitening[order]),
        tuple(names[i] for i in order),
    )


def _whitening(pixels: Array, covariance_px2: Array) -> Array:
    """Whitening of each group relative to the typical corner; blanks `pixels` unseen."""
    size = covariance_px2.shape[-1]
    shape = covariance_px2.shape[:2]
    known = np.asarray(np.isfinite(covariance_px2).all(axis=(2, 3)))
    known = known & np.isfinite(pixels).reshape(*shape, size).all(axis=2)
    pixels[~np.repeat(known, size // 2, axis=1)] = np.nan
    safe = np.where(known[..., None, None], covariance_px2, np.eye(size))
    variance = np.trace(safe, axis1=2, axis2=3) / size
    typical = float(np.median(variance[known])) if known.any() else 1.0
    root = np.linalg.cholesky(safe / typical)
    return np.asarray(np.linalg.inv(root), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class FixedPoints:
    """Surveyed points fixed to the base (tag corners) and where the still cameras see them.

    Attributes:
        names: such as `tag36h11:100 TL`, (n,).
        points_base_m: survey, (n, 3).
        std_m: standard deviation of the survey, each axis, (n,).
        camera: camera of each sighting, (m,).
        point: point of each sighting, (m,).
        pixels: sightings, averaged over a recording, (m, 2).
        std_scale: noise of each relative to one board corner, (m,).
    """

    names: tuple[str, ...]
    points_base_m: Array
    std_m: Array
    camera: np.ndarray
    point: np.ndarray
    pixels: Array
    std_scale: Array

    def select(self, keep: np.ndarray) -> FixedPoints:
        """The same survey with the sightings picked by a mask."""
        return FixedPoints(
            self.names,
            self.points_base_m,
            self.std_m,
            self.camera[keep],
            self.point[keep],
            self.pixels[keep],
            self.std_scale[keep],
        )
