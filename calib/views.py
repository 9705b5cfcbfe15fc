"""What the cameras saw of a moving board and of fixed points, before any calibration."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from calib.camera_models import Array


@dataclass(frozen=True, slots=True)
class Views:
    """Sightings of one rigid board; a view is one camera at one moment.

    Attributes:
        camera: index of the camera, (n,).
        moment: index of the moment (board pose), (n,).
        pixels: corners, NaN where unseen, (n, n_points, 2).
        velocity_px_s: image velocity of the corners, zero where unknown, (n, n_points, 2).
        lag_s: the view's own stamp minus the moment's time, (n,).
        std_px: what the detector says of each corner's noise; only ratios count, (n, n_points).
        label: how a person finds the view: recording and frame, (n,) text.
    """

    camera: np.ndarray
    moment: np.ndarray
    pixels: Array
    velocity_px_s: Array
    lag_s: Array
    std_px: Array
    label: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.camera)

    @property
    def seen(self) -> np.ndarray:
        """Which corners were seen, bool (n, n_points)."""
        return np.isfinite(self.pixels[..., 0])

    def select(self, keep: np.ndarray) -> Views:
        """The views picked by a mask or an index array."""
        index = np.arange(len(self))[keep]
        return Views(
            self.camera[index],
            self.moment[index],
            self.pixels[index],
            self.velocity_px_s[index],
            self.lag_s[index],
            self.std_px[index],
            tuple(self.label[i] for i in index),
        )

    def compacted(self) -> tuple[Views, np.ndarray]:
        """The same views with moments renumbered from 0 without gaps, and the old numbers."""
        moments, renumbered = np.unique(self.moment, return_inverse=True)
        return (
            replace(self, moment=renumbered),
            moments,
        )


def make_views(
    camera: object,
    moment: object,
    pixels: object,
    velocity_px_s: Array | None = None,
    lag_s: Array | None = None,
    label: tuple[str, ...] | None = None,
    std_px: Array | None = None,
) -> Views:
    """Views with unknown velocities, lags and labels filled in; order is camera, then moment."""
    cameras, moments = np.asarray(camera, dtype=int), np.asarray(moment, dtype=int)
    points = np.asarray(pixels, dtype=np.float64)
    count = len(cameras)
    order = np.lexsort((moments, cameras))
    velocity = np.zeros_like(points) if velocity_px_s is None else velocity_px_s
    lag = np.zeros(count) if lag_s is None else np.asarray(lag_s, dtype=np.float64)
    std = np.ones(points.shape[:2]) if std_px is None else np.asarray(std_px, dtype=np.float64)
    names = label or tuple(f"camera {c} moment {m}" for c, m in zip(cameras, moments, strict=True))
    return Views(
        cameras[order],
        moments[order],
        points[order],
        np.where(np.isfinite(velocity), velocity, 0.0)[order],
        lag[order],
        std[order],
        tuple(names[i] for i in order),
    )


def relative_std(views: Views) -> Array:
    """Noise of each corner relative to its camera's typical (median) corner, (n, n_points)."""
    result = np.ones_like(views.std_px)
    if np.ptp(views.std_px, axis=None) == 0.0:
        return result
    for index in np.unique(views.camera):
        own = views.camera == index
        seen = views.seen[own]
        if seen.any():
            result[own] = views.std_px[own] / np.median(views.std_px[own][seen])
    return np.where(np.isfinite(result), np.clip(result, 0.1, 100.0), 1.0)


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
