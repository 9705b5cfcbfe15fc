"""Tags that look larger than they are, to every side alike.

Squeezed pictures, blooming and sharpening move the edges of a tag outwards by some thousandths of a
pixel whatever its size. A tag then seems nearer and turned, all poses alike, and no scatter tells
of it; tags of several sizes and distances do. One number a camera is found from the residuals of
all frames, with the poses eliminated, and taken off the corners; what is left of it is an error
that all poses share.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.frozen import freeze
from freeswing.vision.fuse.blocks import blocks
from freeswing.vision.fuse.corner_noise import ALIKE, SURE_SIGMAS, outwards, whitened
from freeswing.vision.fuse.fuse_cameras import Fit
from freeswing.vision.fuse.linearised_block import linearised
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.rejected_sightings import agreeing
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.look.watched_target import Watch

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

USUAL_PX = 0.005
"""What squeezing makes tags grow by, a standard deviation: H.264 at crf 18 does by 0.003 px."""


@dataclass(frozen=True, slots=True)
class Growth:
    """By how much tags look larger to each side.

    Attributes:
        px: in each camera, (n_c,).
        covariance: of `px`, (n_c, n_c).
        slopes: change of each pose by a pixel of it, position and small rotation, zero where no
            pose is known, (n, 6, n_c).
    """

    px: Array
    covariance: Array
    slopes: Array

    def __post_init__(self) -> None:
        freeze(self, "px", "covariance", "slopes")

    @property
    def is_real(self) -> bool:
        """Whether it stands out of its deviation in a camera, and is what squeezing can do."""
        deviations = np.sqrt(np.diag(self.covariance))
        return bool((np.abs(self.px) > SURE_SIGMAS * deviations).any() and not self.is_too_large)

    @property
    def is_too_large(self) -> bool:
        """Whether it is so large that something else must be wrong, as the tags' stated size."""
        return bool((np.abs(self.px) > SURE_SIGMAS * USUAL_PX).any())

    def causes(self) -> Array:
        """What is left of it in each pose, one column a cause of one deviation, (n, 6, n_c).

        Sightings err alike, as in `vision.fuse.corner_noise`: its variance counts `ALIKE` times.

        Source:
            JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, eq. (13).
        """
        sizes, axes = np.linalg.eigh(ALIKE * self.covariance)
        return self.slopes @ (axes * np.sqrt(sizes.clip(0.0)))


def growth_of(poses: Poses, fit: Fit, views: Sequence[CameraViews], watch: Watch) -> Growth:
    """How much larger a run's tags look, from what their corners miss the poses by.

    Args:
        poses: of the run.
        fit: how its sightings agree with them.
        views: its cameras.
        watch: what was looked for.

    Source:
        Foerstner, Wrobel 2016, Photogrammetric Computer Vision, sec. 4.6 and 15.3.5: systematic
        errors as additional parameters with a prior, the poses eliminated.
    """
    cameras = len(views)
    normal, right = np.eye(cameras) / USUAL_PX**2, np.zeros(cameras)
    slopes = np.zeros((len(poses.times_s), 6, cameras))
    focal = np.array([view.camera.focal_px.mean() for view in views])
    for block in blocks(views, watch, poses.times_s, poses):
        count = len(block.starts) - 1
        span = slice(block.first, block.first + count)
        instant = np.repeat(np.arange(count), np.diff(block.starts))
        linear, white = linearised(block, views, poses), whitened(block, fit.noise, views)
        miss = np.einsum("oij,oj->oi", white, linear.residuals)
        tags = (block.counts == 4) & poses.known[span][instant]
        tags &= agreeing((miss**2).mean(axis=1))
        if not tags.any():
            continue
        instant, camera = instant[tags], block.camera_of[tags]
        white, miss = white[tags], miss[tags]
        by_pose = white @ linear.jacobians[tags]
        by_growth = np.zeros((len(camera), 8, cameras))
        moved = outwards(block.rays[tags]) / focal[camera][:, None]
        by_growth[np.arange(len(camera)), :, camera] = np.einsum("oij,oj->oi", white, moved)
        own, cross, pull = (
            np.zeros((count, 6, 6)),
            np.zeros((count, 6, cameras)),
            np.zeros((count, 6)),
        )
        turned = np.swapaxes(by_pose, 1, 2)
        np.add.at(own, instant, turned @ by_pose)
        np.add.at(cross, instant, turned @ by_growth)
        np.add.at(pull, instant, np.einsum("opi,oi->op", turned, miss))
        slopes[span] = np.linalg.pinv(own, hermitian=True) @ cross
        normal += np.einsum("oic,oid->cd", by_growth, by_growth, optimize=True)
        normal -= np.einsum("npc,npd->cd", cross, slopes[span], optimize=True)
        right += np.einsum("oic,oi->c", by_growth, miss) - np.einsum(
            "npc,np->c", slopes[span], pull
        )
    covariance = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    return Growth(covariance @ right, covariance, slopes)
