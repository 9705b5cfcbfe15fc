"""Where the tags really sit on the platform: measured against target.toml, and refined on request.

Each tag may shift and turn a little; the platform's poses are eliminated (Schur complement), and
what all tags do together is none of theirs: the smallest change that explains the sightings is
taken, which leaves the platform frame where the tags have it on average.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.vision.fuse.blocks import blocks
from freeswing.vision.fuse.corner_noise import Noise, whitened
from freeswing.vision.fuse.fuse_cameras import Fit
from freeswing.vision.fuse.linearised_block import linearised
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.run_views import Block, CameraViews
from freeswing.vision.look.watched_target import Watch

Array = NDArray[np.float64]

_INSTANTS_A_BLOCK = 60
_REJECT = 400.0  # mean square: 20 deviations; a tag some millimetres off its place still counts


@dataclass(frozen=True, slots=True)
class LayoutSums:
    """Normal matrix (6 n, 6 n), right side (6 n,) of tags' shifts, turns; which are seen (n,)."""

    normal: Array
    right: Array
    seen: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class LayoutChange:
    """Corners as the recordings have them, (n, 4, 3), with each tag's change and its std in m."""

    corners_m: Array
    change_m: Array
    std_m: Array

    def against(self, stated_m: Array) -> LayoutChange:
        """The same with changes from where a file has the tags, (n, 4, 3)."""
        off = self.corners_m - stated_m
        return replace(self, change_m=np.sqrt((off**2).sum(axis=2).mean(axis=1)))


def layout_sums(poses: Poses, fit: Fit, views: Sequence[CameraViews], watch: Watch) -> LayoutSums:
    """What one run says about the layout."""
    size = 6 * len(watch.tags)
    normal, right = np.zeros((size, size)), np.zeros(size)
    seen = np.zeros(len(watch.tags), dtype=bool)
    for block in blocks(views, watch, poses.times_s, poses):
        _add_block(block, poses, views, watch, fit.noise, normal, right)
        seen |= np.isin(np.arange(len(seen)), block.things)
    return LayoutSums(normal, right, seen)


def layout_change(sums: Sequence[LayoutSums], watch: Watch) -> LayoutChange:
    """The layout that all runs together ask for; tags never seen keep their place."""
    n = len(watch.tags)
    normal = np.sum([s.normal for s in sums], axis=0)
    right = np.sum([s.right for s in sums], axis=0)
    seen = np.repeat(np.diag(normal).reshape(n, 6)[:, 0] > 1e-200, 6)
    inverse = np.zeros_like(normal)
    if seen.any():
        part = normal[np.ix_(seen, seen)]
        lever = np.tile([1.0, 1.0, 1.0, 0.05, 0.05, 0.05], int(seen.sum()) // 6)
        balanced = part * np.outer(lever, lever)
        top = np.linalg.norm(balanced, 2)
        inner = np.linalg.pinv(balanced / top, rcond=1e-9, hermitian=True) / top
        inverse[np.ix_(seen, seen)] = inner * np.outer(lever, lever)
    step = (inverse @ right).reshape(n, 6)
    variance = np.diag(inverse).reshape(n, 6)[:, :3].sum(axis=1)
    centres = watch.tag_corners_m.mean(axis=1, keepdims=True)
    arms = watch.tag_corners_m - centres
    moves = step[:, None, :3] + np.cross(step[:, None, 3:], arms)
    change = np.sqrt((moves**2).sum(axis=2).mean(axis=1))
    return LayoutChange(watch.tag_corners_m + moves, change, np.sqrt(variance))


def never_seen(sums: Sequence[LayoutSums], watch: Watch) -> list[str]:
    """Names of the tags that no run shows, wherever it has them."""
    seen = np.any([one.seen for one in sums], axis=0)
    return [watch.name(int(k)) for k in np.flatnonzero(~seen)]


def with_layout(watch: Watch, corners_m: Array) -> Watch:
    """The same things to look for with the tags elsewhere on the platform."""
    return replace(watch, tag_corners_m=corners_m)


def _add_block(
    block: Block,
    poses: Poses,
    views: Sequence[CameraViews],
    watch: Watch,
    noise: Noise,
    normal: Array,
    right: Array,
) -> None:
    count = len(block.starts) - 1
    span = slice(block.first, block.first + count)
    linear = linearised(block, views, poses)
    residuals, jacobians = linear.residuals, linear.jacobians
    white = whitened(block, noise, views)
    chosen = np.flatnonzero(poses.known[span])
    arms = watch.tag_corners_m - watch.tag_corners_m.mean(axis=1, keepdims=True)
    for k in chosen[:: max(1, len(chosen) // _INSTANTS_A_BLOCK)]:
        mine = np.arange(int(block.starts[k]), int(block.starts[k + 1]))
        mine = mine[(block.things[mine] >= 0) & (block.things[mine] < len(watch.tags))]
        things = block.things[mine]
        if len(np.unique(things)) < 2:
            continue
        rotation = poses.rotations[span][k]
        by_point = (jacobians[mine, :, :3] @ rotation).reshape(len(mine), 4, 2, 3)
        turn = np.cross(arms[things][:, :, None, :], by_point)
        tag = np.concatenate([by_point, turn], axis=3).reshape(len(mine), 8, 6)
        pose = white[mine] @ jacobians[mine]
        tag = white[mine] @ tag
        miss = np.einsum("oij,oj->oi", white[mine], residuals[mine])
        good = (miss**2).mean(axis=1) < _REJECT
        own = np.einsum("oia,oib->ab", pose[good], pose[good])
        cross = np.zeros((6, normal.shape[0]))
        for o in np.flatnonzero(good):
            at = slice(6 * things[o], 6 * things[o] + 6)
            normal[at, at] += tag[o].T @ tag[o]
            right[at] += tag[o].T @ miss[o]
            cross[:, at] += pose[o].T @ tag[o]
        if not good.any():
            continue
        solved = np.linalg.pinv(own, hermitian=True) @ cross
        normal -= cross.T @ solved
        right -= solved.T @ np.einsum("oia,oi->a", pose[good], miss[good])
