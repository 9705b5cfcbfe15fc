"""The platform's points found to a hundredth of a pixel, by laying patches of it over a frame.

The middle of a blob that is seen aslant is not that of the same spot seen from the front. A patch
cut out at rest, warped as its plane is seen now, lies where the spot lies, from wherever it is
looked at.

Source:
    Baker, Matthews 2004, Lucas-Kanade 20 Years On: A Unifying Framework, sec. 3.2: inverse
    compositional alignment; Sutton, Orteu, Schreier 2009, Image Correlation for Shape, Motion and
    Deformation Measurements, ch. 5: affine subsets, spline interpolation, grey scale normalised.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from freeswing.calib.camera.camera import Camera

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
Image = NDArray[np.uint8]

HALF_PX = 10  # of a patch: 441 pixels tell its middle to 0.01 px
NEIGHBOURS = 10  # whose plane a patch lies on
MOST_STEPS = 12
SETTLED_PX = 0.003  # a third of what a patch tells at the best
FARTHEST_PX = 3.0  # from where it was expected: beyond, another patch looks alike
LEAST_LIKENESS = 0.85  # correlation of a patch with itself, lighting and blur apart
LEAST_FACING = 0.25  # cosine: a plane seen more aslant shows too little


_GRID = np.stack(np.meshgrid(*[np.arange(-HALF_PX, HALF_PX + 1.0)] * 2), axis=-1).reshape(-1, 2)


@dataclass(frozen=True, slots=True)
class Patches:
    """Small planes on the platform, as one camera saw each of them at rest.

    Attributes:
        greys: mean 0 and norm 1, (n, s).
        gain: from differences of greys to a step of the six numbers of the warp, (n, 6, s).
        tangents: platform frame, moves of one pixel to the right and down there, (n, 3, 2) m.
        normals: out of the platform, (n, 3).
    """

    greys: Array
    gain: Array
    tangents: Array
    normals: Array

    def __len__(self) -> int:
        return len(self.greys)

    @staticmethod
    def empty(normals: Array) -> Patches:
        """Places for patches on planes with these normals (n, 3)."""
        n, s = len(normals), len(_GRID)
        return Patches(np.zeros((n, s)), np.zeros((n, 6, s)), np.zeros((n, 3, 2)), normals)

    def select(self, rows: Ints) -> Patches:
        """Those picked by an index array."""
        return Patches(self.greys[rows], self.gain[rows], self.tangents[rows], self.normals[rows])


@dataclass(frozen=True, slots=True)
class Aligned:
    """Where patches lie in a frame.

    Attributes:
        pixels: (n, 2).
        std_px: by what differs of their greys, (n,).
    """

    pixels: Array
    std_px: Array


@dataclass(frozen=True, slots=True)
class SmoothImage:
    """An image between its pixels: a cubic spline."""

    coefficients: Array
    left: int
    top: int

    @staticmethod
    def of(image: Image | Array, left: int = 0, top: int = 0) -> SmoothImage:
        """An image (h, w) that is cut out of a larger one at (left, top)."""
        return SmoothImage(ndimage.spline_filter(image.astype(np.float64), 3), left, top)

    def at(self, pixels: Array) -> Array:
        """Greys (...) at pixels (..., 2) of the whole image."""
        rows, columns = pixels[..., 1] - self.top, pixels[..., 0] - self.left
        return ndimage.map_coordinates(
            self.coefficients, [rows, columns], order=3, mode="nearest", prefilter=False
        )

    def holds(self, pixels: Array) -> Mask:
        """Whether patches around these pixels (n, 2) lie inside, with some room."""
        h, w = self.coefficients.shape
        at = pixels - (self.left, self.top)
        room = HALF_PX + 2.0
        last = np.array([w, h]) - 1.0 - room
        return np.asarray(((at > room) & (at < last)).all(axis=1), dtype=np.bool_)


def cut(image: SmoothImage, pixels: Array) -> tuple[Array, Array]:
    """Greys and gain of patches around pixels (n, 2), see `Patches`.

    Source:
        Baker, Matthews 2004, Lucas-Kanade 20 Years On, eq. (35): steepest descent images of the
        template, here of greys of mean 0 and norm 1.
    """
    at = pixels[:, None] + _GRID
    greys = image.at(at)
    slope = np.stack(
        [image.at(at + step) - image.at(at - step) for step in ((0.5, 0.0), (0.0, 0.5))], axis=-1
    )
    ones = np.ones(len(_GRID))
    basis = np.stack([_GRID[:, 0], _GRID[:, 1], ones], axis=-1)  # of a warp's move at a pixel
    steepest = np.einsum("nsi,sj->nsij", slope, basis).reshape(len(pixels), -1, 6)
    flat, norm = _flat(greys)
    steepest = steepest / norm[:, None, None]
    steepest = steepest - steepest.mean(axis=1, keepdims=True)
    steepest = steepest - flat[..., None] * np.einsum("ns,nsk->nk", flat, steepest)[:, None]
    return flat, np.linalg.pinv(steepest)


def _flat(greys: Array) -> tuple[Array, Array]:
    """Of mean 0 and norm 1, and the norm there was."""
    flat = greys - greys.mean(axis=-1, keepdims=True)
    norm = np.maximum(np.linalg.norm(flat, axis=-1), 1e-9)
    return flat / norm[..., None], norm


def align_seen(
    patches: Patches, image: SmoothImage, camera: Camera, T_camera_platform: Array, points_m: Array
) -> tuple[Ints, Aligned]:
    """Which patches a frame shows, and where.

    Args:
        patches: n of them.
        image: the frame.
        camera: that took it.
        T_camera_platform: the pose to start from, (4, 4).
        points_m: platform frame, (n, 3).

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, ch. 13: planes in two
        views, here to first order about a patch's middle.
    """
    turn, shift = T_camera_platform[:3, :3], T_camera_platform[:3, 3]
    inside = points_m @ turn.T + shift
    sight = -inside / np.linalg.norm(inside, axis=1, keepdims=True)
    facing = np.einsum("ni,ni->n", sight, patches.normals @ turn.T)
    with np.errstate(invalid="ignore"):
        pixels = camera.project(inside)
        rows = np.flatnonzero((facing > LEAST_FACING) & camera.sees(inside) & image.holds(pixels))
    own = patches.select(rows)
    warps = warps_of(camera, T_camera_platform, points_m[rows], own.tangents)
    found, good = align(own, image, warps, pixels[rows])
    return rows[good], Aligned(found.pixels[good], found.std_px[good])


def align(
    patches: Patches, image: SmoothImage, warps: Array, expected: Array
) -> tuple[Aligned, Mask]:
    """Patches laid over a frame, and which settled, near where expected, and alike.

    Args:
        patches: n of them.
        image: the frame.
        warps: expected, patch pixels to frame pixels, (n, 2, 2).
        expected: middles, (n, 2).

    Source:
        Baker, Matthews 2004, Lucas-Kanade 20 Years On, fig. 4: the inverse compositional steps.
    """
    n = len(patches)
    A, b = warps.copy(), expected.copy()
    moved = np.full(n, np.inf)
    alike = np.zeros(n)
    busy = np.arange(n)
    for _ in range(MOST_STEPS):
        if not len(busy):
            break
        at = b[busy, None] + np.einsum("nij,sj->nsi", A[busy], _GRID)
        now, _ = _flat(image.at(at))
        alike[busy] = np.einsum("ns,ns->n", now, patches.greys[busy])
        step = np.einsum("nks,ns->nk", patches.gain[busy], now - patches.greys[busy])
        own, shift = np.eye(2) + step.reshape(-1, 2, 3)[..., :2], step.reshape(-1, 2, 3)[..., 2]
        A[busy] = A[busy] @ np.linalg.inv(own)
        back = np.einsum("nij,nj->ni", A[busy], shift)
        b[busy] -= back
        moved[busy] = np.linalg.norm(back, axis=1)
        near = np.linalg.norm(b[busy] - expected[busy], axis=1) < FARTHEST_PX
        busy = busy[(moved[busy] >= SETTLED_PX) & near]
    near = np.linalg.norm(b - expected, axis=1) < FARTHEST_PX
    good = (moved < SETTLED_PX) & near & (alike > LEAST_LIKENESS)
    # residual of unit vectors: |now - greys|^2 = 2 - 2 alike, over s numbers
    left = np.sqrt(np.maximum(2.0 - 2.0 * alike, 1e-12) / (len(_GRID) - 8))
    spread = np.sqrt((patches.gain[:, [2, 5]] ** 2).sum(axis=(1, 2)) / 2.0)
    return Aligned(b, left * spread), good


def overlap(pixels: Array) -> float:
    """How many patches each patch's pixels are in, in the mean; middles at pixels (n, 2).

    Patches that share pixels share their noise: what all of them tell is known by so much less.

    Source:
        JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, eq. (16): correlated
        quantities; the share of common pixels is their correlation.
    """
    side = 2.0 * HALF_PX + 1.0
    gap = np.abs(pixels[:, None] - pixels[None])
    common = np.maximum(side - gap, 0.0).prod(axis=2) / side**2
    return float(common.sum(axis=1).mean())


def tangents_of(camera: Camera, T_camera_platform: Array, points_m: Array, normals: Array) -> Array:
    """Moves on the planes that are one pixel to the right and down in this camera, (n, 3, 2).

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, ch. 13, to first order.
    """
    flat = _plane(normals)
    return flat @ np.linalg.inv(_slopes(camera, T_camera_platform, points_m) @ flat)


def warps_of(camera: Camera, T_camera_platform: Array, points_m: Array, tangents: Array) -> Array:
    """Patch pixels to this camera's pixels at a pose, (n, 2, 2).

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, ch. 13, to first order.
    """
    return _slopes(camera, T_camera_platform, points_m) @ tangents


def _slopes(camera: Camera, T: Array, points_m: Array) -> Array:
    """Of pixels by the place on the platform, (n, 2, 3)."""
    _, by_point, _ = camera.project_jacobian(points_m @ T[:3, :3].T + T[:3, 3])
    return by_point @ T[:3, :3]


def _plane(normals: Array) -> Array:
    """Two directions across each normal, (n, 3, 2)."""
    aside = np.where(np.abs(normals[:, :1]) < 0.7, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    first = np.cross(normals, aside)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.asarray(np.stack([first, np.cross(normals, first)], axis=-1), dtype=np.float64)


def normals_of(points_m: Array, towards: Array) -> Array:
    """Of planes through each point's neighbours, on the side that `towards` (n, 3) lies, (n, 3).

    Source:
        Hoppe, DeRose, Duchamp, McDonald, Stuetzle 1992, Surface Reconstruction from Unorganized
        Points, sec. 3.1: tangent planes by principal components.
    """
    gap = np.linalg.norm(points_m[:, None] - points_m[None], axis=2)
    near = np.argsort(gap, axis=1)[:, :NEIGHBOURS]
    around = points_m[near] - points_m[near].mean(axis=1, keepdims=True)
    normals = np.linalg.eigh(np.swapaxes(around, 1, 2) @ around)[1][..., 0]
    side = np.sign(np.einsum("ni,ni->n", normals, towards))
    return np.asarray(normals * np.where(side == 0.0, 1.0, side)[:, None], dtype=np.float64)
