"""What a feature has wrong for good in one camera, and what that does to all poses.

The middle of a blob that is seen aslant is not that of the same spot seen from the front: a feature
errs alike in frame after frame. Points are then placed wrongly, most of all towards the cameras,
and wherever the platform is seen from another side all its poses are off in step. How large such
errors are is told by how the cameras' mean residuals of each point contradict each other.

Source:
    Schmid, Mohr, Bauckhage 2000, Evaluation of Interest Point Detectors, sec. 4: features move with
    the viewpoint; JCGM 100:2008, eq. (13): propagation.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.vision.fuse.blocks import blocks
from freeswing.vision.fuse.calibration_share import frame_causes
from freeswing.vision.fuse.linearised_block import linearised
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.look.watched_target import Watch

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# A mean over fewer frames is the scatter of each, not what lasts.
LEAST_FRAMES = 10


@dataclass(frozen=True, slots=True)
class Placed:
    """Sightings by one camera from known poses.

    Attributes:
        camera: its place among the cameras.
        which: numbers of the points, (m,).
        off: measured minus predicted rays, (m, 2).
        slope: of the prediction by the point's place in the platform, (m, 2, 3).
    """

    camera: int
    which: Ints
    off: Array
    slope: Array


@dataclass(frozen=True, slots=True)
class FeatureBias:
    """Lasting errors of features.

    Attributes:
        names: of the cameras, n_c.
        size: deviation of such an error in each direction, rays.
        pull: how a point moves by the error of its feature in a camera, m a ray, (n_c, n, 3, 2).
    """

    names: tuple[str, ...]
    size: float
    pull: Array

    def causes(
        self, poses: Poses, views: Sequence[CameraViews], watch: Watch, chosen: Ints
    ) -> Array:
        """What one deviation of each error does to the chosen poses, (n, 6, 2 n_c n_points)."""
        n_c, n = self.pull.shape[:2]
        found = np.zeros((len(chosen), 6, n_c, n, 2))
        own = [self.names.index(view.camera.name) for view in views]
        row = 0
        for block in blocks(views, watch, poses.times_s, poses):
            last = block.first + len(block.starts) - 1
            mine = chosen[(chosen >= block.first) & (chosen < last)]
            linear = linearised(block, views, poses)
            for k in mine:
                first, end = (int(s) for s in block.starts[k - block.first : k - block.first + 2])
                span = slice(first, end)
                jacobian = linear.jacobians[span, :2]
                good = np.isfinite(jacobian).all(axis=(1, 2)) & (jacobian != 0.0).any(axis=(1, 2))
                jacobian = jacobian[good]
                which = block.things[span][good] - watch.first_marker
                camera = np.array(own)[block.camera_of[span][good]]
                normal = np.einsum("oia,oib->ab", jacobian, jacobian)
                gain = np.linalg.pinv(normal, hermitian=True) @ np.swapaxes(jacobian, 1, 2)
                found[row] = self._of_one(gain, jacobian, poses.rotations[k], which, camera)
                row += 1
        return self.size * found.reshape(len(chosen), 6, -1)

    def _of_one(
        self, gain: Array, jacobian: Array, rotation: Array, which: Ints, camera: Ints
    ) -> Array:
        """One instant: errors move the pose by themselves, and by the points, (6, n_c, n, 2)."""
        moved = np.zeros((*self.pull.shape[:2], 6, 2))
        np.add.at(moved, (camera, which), gain)
        by_point = np.zeros((self.pull.shape[1], 6, 3))
        np.add.at(by_point, which, gain @ jacobian[:, :, :3] @ rotation)
        return np.moveaxis(moved, 2, 0) - np.einsum("nab,cnbi->acni", by_point, self.pull)


def feature_bias(sightings: Iterable[Placed], names: Sequence[str], n_points: int) -> FeatureBias:
    """Lasting errors from how cameras' mean residuals contradict each other.

    Args:
        sightings: of all runs, with the points and poses that fit them.
        names: of the cameras.
        n_points: on the platform.

    Source:
        Kay 1993, Fundamentals of Statistical Signal Processing: Estimation Theory, sec. 4.5: linear
        least squares; a sum of squared residuals over its degrees of freedom.
    """
    shape = (len(names), n_points)
    count, off, slope = np.zeros(shape), np.zeros((*shape, 2)), np.zeros((*shape, 2, 3))
    for one in sightings:
        np.add.at(count[one.camera], one.which, 1.0)
        np.add.at(off[one.camera], one.which, one.off)
        np.add.at(slope[one.camera], one.which, one.slope)
    count[count < LEAST_FRAMES] = 0.0
    count[:, (count > 0.0).sum(axis=0) < 2] = 0.0
    often = np.maximum(count, 1.0)
    mean, by_place = off / often[..., None], slope / often[..., None, None]
    there = count > 0.0
    normal = np.einsum("cn,cnia,cnib->nab", count, by_place, by_place)
    pull = np.linalg.pinv(normal, hermitian=True) @ np.einsum("cn,cnia->cnai", count, by_place)
    freedom = 2.0 * there.sum() - 3.0 * there.any(axis=0).sum()
    square = float(np.sum(mean[there] ** 2)) / max(float(freedom), 1.0)
    return FeatureBias(tuple(names), float(np.sqrt(square)), pull)


@dataclass(frozen=True, slots=True)
class PlatformErrors:
    """What all poses of an untagged platform have wrong together.

    Attributes:
        frame: covariance of the platform's frame in itself, (6, 6).
        bias: of its features.
    """

    frame: Array
    bias: FeatureBias

    def __call__(
        self, poses: Poses, views: Sequence[CameraViews], watch: Watch, chosen: Ints
    ) -> Array:
        """Causes at the chosen poses, (n, 6, m)."""
        own = self.bias.causes(poses, views, watch, chosen)
        return np.concatenate([frame_causes(poses, self.frame)[chosen], own], axis=2)
