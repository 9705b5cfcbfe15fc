"""What corners err by beyond the pixels' noise, in parts that the sightings' residuals tell apart.

Lenses, calibrations and squeezed pictures put corners off one by one. Squeezing does more: it draws
slightly tilted edges towards the rows and columns of the picture, so that a tag looks turned and
sheared by a share of its own tilt. That is no scatter. It follows the platform's pose, all tags and
frames alike, and what is identified from the poses with it. So

    C = C_pixels + floor^2 I + turned^2 T,    T = x by y and y by x over each tag

with sizes from the residuals of each camera, the poses' share of these taken out; what turns tags
has `ALIKE` times its variance, for as many sightings err alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.vision.fuse.pose_kernels import Linear
from freeswing.vision.fuse.run_views import Block, CameraViews
from freeswing.vision.look.single_pose import whitening

LEAST_FLOOR_PX = 0.002  # no lens is known better

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

START_FLOOR_PX = 0.15
ALIKE = 16.0
"""Sightings that are turned alike: two or three tags over the quarter of a swing."""
SURE_SIGMAS = 4.0  # of the variance that turns tags, else there is none: one in 30,000 by chance
PARTS = 3
_SIGHTINGS_A_BLOCK = 600  # tell the parts' sizes to a few per cent
_SWEEPS = 200
# Of the sum of squares of a sighting's eight or two numbers: median, and what 1 in 1000 exceeds.
_USUAL = {4: (7.34, 26.1), 1: (1.39, 13.8)}


@dataclass(frozen=True, slots=True)
class Noise:
    """What the cameras' corners err by beyond the pixels' noise, (n_c,) each.

    Attributes:
        floor_px: each corner on its own.
        turned_px: corners of a tag along x by their y, and along y by their x.
    """

    floor_px: Array
    turned_px: Array

    @staticmethod
    def plain(floor_px: Array) -> Noise:
        """Each corner's own alone, (n_c,)."""
        return Noise(floor_px, np.zeros(len(floor_px)))

    @staticmethod
    def unknown(cameras: int) -> Noise:
        """Before anything was seen: enough that nothing good is left out."""
        return Noise.plain(np.full(cameras, START_FLOOR_PX))

    def at_most(self, floor_px: float) -> Noise:
        """With no larger floor."""
        return Noise(np.minimum(self.floor_px, floor_px), self.turned_px)


class _Corners(NamedTuple):
    """Of some sightings: camera, points, rays, pixels' covariances, and focal length, (n, ...)."""

    camera_of: NDArray[np.int64]
    counts: NDArray[np.int64]
    rays: Array
    covariances: Array
    focal_px: Array

    def only(self, chosen: NDArray[np.int64]) -> _Corners:
        return _Corners(
            self.camera_of[chosen],
            self.counts[chosen],
            self.rays[chosen],
            self.covariances[chosen],
            self.focal_px[chosen],
        )


class _Chosen(NamedTuple):
    """Sightings of a block about its poses: instants (n,), residuals (n, 8), slopes (n, 8, 6)."""

    corners: _Corners
    instants: NDArray[np.int64]
    residuals: Array
    jacobians: Array
    poses: Array


class _Seen(NamedTuple):
    """Of a camera's sightings: scores, points (n,), squares (n, 3), shares (n, 3, n_c, 3)."""

    scores: Array
    counts: NDArray[np.int64]
    squares: Array
    shares: Array

    def only(self, mine: Mask) -> _Seen:
        return _Seen(self.scores[mine], self.counts[mine], self.squares[mine], self.shares[mine])


def whitened(block: Block, noise: Noise, views: Sequence[CameraViews]) -> Array:
    """Whitening of each sighting by its covariance (rays), (n_o, 8, 8).

    Source:
        Golub, Van Loan 2013, Matrix Computations, sec. 4.2: the Cholesky factor.
    """
    return _whitened(_corners(block, views), noise)


def _corners(block: Block, views: Sequence[CameraViews]) -> _Corners:
    focal = np.array([view.camera.focal_px.mean() for view in views])[block.camera_of]
    return _Corners(block.camera_of, block.counts, block.rays, block.covariances, focal)


def _whitened(corners: _Corners, noise: Noise) -> Array:
    there = np.arange(8) < 2 * corners.counts[:, None]
    both = there[:, :, None] & there[:, None, :]
    whole = np.where(both, corners.covariances, 0.0)
    floors = (noise.floor_px[corners.camera_of] / corners.focal_px) ** 2
    whole[:, np.arange(8), np.arange(8)] += np.where(there, floors[:, None], 1.0)
    if noise.turned_px.any():
        sizes = ALIKE * noise.turned_px[corners.camera_of] ** 2
        whole += sizes[:, None, None] * _turned(corners)
    return whitening(whole)


def _turned(corners: _Corners) -> Array:
    """Covariances of tags that are turned by one pixel, (n, 8, 8)."""
    size = (corners.counts == 4) / corners.focal_px
    turns = turns_of(corners.rays) * size[:, None, None]
    return turns @ np.swapaxes(turns, 1, 2)


def _parts(corners: _Corners) -> Array:
    """Covariances of the parts of unit size, zero beyond a sighting's numbers, (3, n_o, 8, 8)."""
    there = (np.arange(8) < 2 * corners.counts[:, None]).astype(float)
    both = there[:, :, None] * there[:, None, :]
    return np.stack(
        [
            corners.covariances * both,
            np.eye(8) * both / corners.focal_px[:, None, None] ** 2,
            _turned(corners),
        ]
    )


def turns_of(rays: Array) -> Array:
    """Corners (n_o, 8) moved along x by their y, along y by their x, rms one, (n_o, 8, 2).

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, sec. 2.4: an affine
        change's turn and shear.
    """
    arms = rays.reshape(-1, 4, 2) - rays.reshape(-1, 4, 2).mean(axis=1, keepdims=True)
    size = np.sqrt(np.maximum((arms**2).mean(axis=1), 1e-300))
    turns = np.zeros((len(rays), 4, 2, 2))
    turns[:, :, 0, 0] = arms[:, :, 1] / size[:, None, 1]
    turns[:, :, 1, 1] = arms[:, :, 0] / size[:, None, 0]
    return turns.reshape(-1, 8, 2)


def outwards(rays: Array) -> Array:
    """Corners of tags (n_o, 8) when each edge moves outwards by one, less where they are.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, sec. 2.2: corners as
        meets of lines.
    """
    corners = rays.reshape(-1, 4, 2)
    along = np.roll(corners, -1, axis=1) - corners  # the edge that leaves each corner
    area = np.sum(corners[..., 0] * np.roll(corners[..., 1], -1, axis=1), axis=1)
    area -= np.sum(corners[..., 1] * np.roll(corners[..., 0], -1, axis=1), axis=1)
    normals = np.stack([along[..., 1], -along[..., 0]], axis=2) * np.sign(area)[:, None, None]
    normals /= np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), 1e-300)
    before = np.roll(normals, 1, axis=1)
    meet = 1.0 + np.sum(before * normals, axis=2, keepdims=True)
    return ((before + normals) / np.maximum(meet, 1e-3)).reshape(-1, 8)


class NoiseSums:
    """What a pass over the sightings says of the noise's parts.

    Source:
        Foerstner, Wrobel 2016, Photogrammetric Computer Vision, sec. 4.2.4: components of
        variance from residuals, with what the unknowns absorb.
    """

    def __init__(self, noise: Noise) -> None:
        self.noise = noise
        self._chosen: list[_Chosen] = []

    def add(
        self,
        block: Block,
        views: Sequence[CameraViews],
        good: Mask,
        linear: Linear,
        covariances: Array,
    ) -> None:
        """Takes a block's sightings in.

        Args:
            block: the sightings.
            views: the cameras.
            good: which agree with the poses, (n_o,).
            linear: these about the poses.
            covariances: of the poses, (n_k, 6, 6).
        """
        instant = np.repeat(np.arange(len(block.starts) - 1), np.diff(block.starts))
        step = max(1, int(good.sum()) // _SIGHTINGS_A_BLOCK)
        chosen = np.flatnonzero(good & (instant % step == 0))
        if len(chosen):
            corners = _corners(block, views).only(chosen)
            there = np.arange(8) < 2 * corners.counts[:, None]
            residuals = np.where(there, linear.residuals[chosen], 0.0)
            jacobians = np.where(there[:, :, None], linear.jacobians[chosen], 0.0)
            poses = np.where(np.isfinite(covariances), covariances, 0.0)
            self._chosen.append(_Chosen(corners, instant[chosen], residuals, jacobians, poses))

    def _seen(self, chosen: _Chosen) -> _Seen:
        """What a block's sightings say."""
        corners, instant, miss, jacobians, poses = chosen
        cameras, count = len(self.noise.floor_px), len(poses)
        white = _whitened(corners, self.noise)
        precise = np.swapaxes(white, 1, 2) @ white
        parts = _parts(corners)
        pulled = np.einsum("nij,nj->ni", precise, miss)
        by_pose = precise @ jacobians
        own = np.swapaxes(by_pose, 1, 2) @ parts @ by_pose
        whole = np.zeros((cameras, count, PARTS, 6, 6))
        np.add.at(whole, (corners.camera_of, instant), np.swapaxes(own, 0, 1))
        absorbed = (poses[:, None] @ whole @ poses[:, None])[:, instant]
        weighed = precise @ parts
        moved = weighed @ by_pose @ poses[instant]
        shares = np.einsum("pnab,cnqba->npcq", own, absorbed)
        alone = np.einsum("pnij,qnji->npq", weighed, weighed)
        alone -= 2.0 * np.einsum("pnia,qnij,nja->npq", moved, parts, by_pose)
        shares[np.arange(len(instant)), :, corners.camera_of] += alone
        squares = np.einsum("ni,pnij,nj->np", pulled, parts, pulled)
        return _Seen(np.einsum("ni,ni->n", miss, pulled), corners.counts, squares, shares)

    def turned_px(self) -> Array:
        """What turns tags in each camera, zero where that is not sure, (n_c,)."""
        seen = [(one.corners.camera_of, self._seen(one)) for one in self._chosen]
        cameras = len(self.noise.floor_px)
        shares = np.zeros((cameras, PARTS, cameras, PARTS))
        squares, usual = np.zeros((cameras, PARTS)), np.zeros(cameras)
        for index in range(cameras):
            mine = [one.only(camera_of == index) for camera_of, one in seen]
            if any(len(one.scores) for one in mine):
                shares[index], squares[index], usual[index] = _kept_sums(mine)
        squares -= shares[:, :, :, 0].sum(axis=2)  # the pixels' own, as the fits know it
        size = (PARTS - 1) * cameras
        matrix = shares[:, 1:, :, 1:].reshape(size, size)
        sizes = least_sizes(matrix, squares[:, 1:].ravel()).reshape(cameras, PARTS - 1)[:, 1]
        # of sizes by chance, where the weights' own noise is so many times what there is
        spread = np.sqrt(2.0 * np.diag(np.linalg.pinv(matrix, 1e-12)).clip(0.0))[1 :: PARTS - 1]
        return np.where(surely_turned(sizes, spread * usual), np.sqrt(sizes), 0.0)


def alike(turned_px: Array) -> Array:
    """The largest for all cameras: poses follow one that is turned, whose own residuals hide it.

    Source:
        Huber, Ronchetti 2009, Robust Statistics, ch. 1: of several claims the least sure.
    """
    return np.full(len(turned_px), turned_px.max(initial=0.0))


def surely_turned(variances: Array, deviations: Array) -> Mask:
    """Which variances stand out of their own deviations.

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 2.3: deviations of a
        Gaussian.
    """
    return variances > SURE_SIGMAS * deviations


def _kept_sums(blocks: list[_Seen]) -> tuple[Array, Array, float]:
    """Shares and squares of a camera's sightings, those far from the usual left out.

    With how large these are beside what the weights expect.
    """
    scores, counts, squares, shares = map(np.concatenate, zip(*blocks, strict=True))
    usual = np.array([_USUAL[int(count)] for count in counts]).reshape(-1, 2)
    relative = scores / usual[:, 0]
    middle = float(np.median(relative))
    kept = relative <= middle * usual[:, 1] / usual[:, 0]
    return shares[kept].sum(axis=0), squares[kept].sum(axis=0), middle


def least_sizes(shares: Array, squares: Array) -> Array:
    """Solves shares @ sizes = squares as nearly as sizes that are not negative can, (n,).

    Source:
        Cottle, Pang, Stone 2009, The Linear Complementarity Problem, sec. 5.2: projected
        Gauss-Seidel.
    """
    known = np.diag(shares) > 0.0
    scale = np.sqrt(np.where(known, np.diag(shares), 1.0))
    matrix, right = shares / np.outer(scale, scale), squares / scale
    sizes = np.zeros(len(squares))
    for _ in range(_SWEEPS):
        for k in np.flatnonzero(known):
            sizes[k] = max(0.0, sizes[k] + right[k] - matrix[k] @ sizes)
    return sizes / scale


def floor_px(excess: Array) -> float:
    """The median excess (n,) of sightings' mean squares over the pixels' noise, as a deviation."""
    if not len(excess):
        return LEAST_FLOOR_PX
    # The median of a mean of eight squares lies near 0.92 of its mean.
    return float(np.sqrt(max(np.median(excess) / 0.92, LEAST_FLOOR_PX**2)))
