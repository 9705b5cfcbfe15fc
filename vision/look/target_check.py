"""The target against a few frames: tags that cannot sit where target.toml has them.

All tags that one image shows are placed together; where that fails by pixels the target is wrong,
and the usual mistakes are tried: ids exchanged, a wrong size, the tags' axes turned, millimetres
for metres, the tags' poses inverted. What then fits is named; exchanged ids are put right. Pictures
that show no tag are looked at in a mirror, as some webcams give theirs.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, islice, permutations, product

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.board.recordings import Image, Recording, read_frames
from freeswing.calib.camera.camera import Camera
from freeswing.calib.tags.corners import lens_rays
from freeswing.cdpr.files.documents import DataError
from freeswing.vision.look.detect import TagFinder, detect_tags
from freeswing.vision.look.single_pose import start_pose
from freeswing.vision.look.watched_target import Watch

Array = NDArray[np.float64]

_EVERY = 20
_FRAMES = 5
_LEAST_FRAMES = 2  # one image may hold a misread tag
WRONG_SHARE = 0.05
"""Corners are found to a hundredth of a pixel; a target measured with a ruler is off by 1 % of a
tag's side. One that is off by more than this is not the one in the picture."""
_FITS_SHARE = 0.4
"""A mistake is named where undoing it leaves less than this share of the miss."""
_SIZES = np.geomspace(0.4, 2.5, 184)
_SAME_SIZE = 0.03  # rulers and printers are good to one or two per cent


@dataclass(frozen=True, slots=True)
class _Seen:
    """Platform tags in one image: index in the watch (n,), rays (n, 4, 2), mean side in rays."""

    tags: NDArray[np.int64]
    rays: Array
    side: float


def examined_watch(
    watch: Watch, recordings: Sequence[tuple[Camera, Recording]]
) -> tuple[Watch, list[str]]:
    """The watch, exchanged ids put right, and what there is to say about it.

    Args:
        watch: what target.toml says.
        recordings: cameras and their recordings of one run.

    Raises:
        DataError: when the tags cannot sit as target.toml has them, with the mistake that fits.
    """
    seen = []
    for camera, recording in recordings:
        own = list(_looked(watch, camera, recording))
        if not own:
            _refuse_mirrored(watch, camera, recording)
        seen += own
    if len(watch.tags) < 2:
        return watch, []
    if len(seen) < _LEAST_FRAMES:
        return watch, []
    return _mended(watch, seen)


def _mended(watch: Watch, seen: Sequence[_Seen]) -> tuple[Watch, list[str]]:
    """The watch with exchanged ids put right, and what is said of it; other mistakes are refused.

    What is left once two ids are exchanged may be another mistake, which is told beside it.
    """
    said: list[str] = []
    while (miss := _miss(watch.tag_corners_m, seen)) >= WRONG_SHARE:
        found = [
            (_miss(corners, seen), text, pair) for corners, text, pair in _mistakes(watch, seen)
        ]
        best = min(found, key=lambda trial: trial[0])
        told = (
            f"the platform's tags miss their places in target.toml by {100 * miss:.0f} % of a side"
        )
        if best[0] > max(_FITS_SHARE * miss, 0.5 * WRONG_SHARE):
            why = (
                f"{told}, and none of the usual mistakes (ids exchanged, size, axes, unit, "
                "inverted poses) explains it: measure the tags' places again"
            )
            raise DataError("; then ".join([*said, why]))
        told = f"{told}: {best[1]} (then {100 * best[0]:.1f} %)"
        if best[2] is None:
            raise DataError(f"{'; then '.join([*said, told])}. Correct target.toml")
        order = np.arange(len(watch.tags))
        order[list(best[2])] = order[list(best[2][::-1])]
        said.append(f"{told}; taken so, correct target.toml")
        watch = replace(watch, tag_corners_m=watch.tag_corners_m[order])
    return watch, said


def _looked(watch: Watch, camera: Camera, recording: Recording) -> Iterator[_Seen]:
    """Images of a recording that show two platform tags or more."""
    if len(watch.tags) < 2:
        return
    finder = TagFinder.of(watch.tags)
    directions = lens_rays(camera)
    for image in _some(camera, recording):
        fits = detect_tags(image, camera, directions, watch.tags, finder)
        if len(fits) < 2:
            continue
        rays = np.array([fit.rays for fit in fits.values()])
        tags = np.array([watch.tags.index(key) for key in fits])
        sides = np.linalg.norm(rays - np.roll(rays, 1, axis=1), axis=2)
        yield _Seen(tags, rays, float(sides.mean()))


def _some(camera: Camera, recording: Recording) -> Iterator[Image]:
    """Some images of a recording; none of another size than the camera's, which is said later."""
    for _, _, image in islice(read_frames(recording), 0, _EVERY * _FRAMES, _EVERY):
        if (image.shape[1], image.shape[0]) == camera.size_px:
            yield image


def _refuse_mirrored(watch: Watch, camera: Camera, recording: Recording) -> None:
    """Passes a recording that shows its tags as they are, or none in a mirror either.

    Raises:
        DataError: where a mirror alone shows them.
    """
    keys = (*watch.tags, *watch.base_tags)
    if not keys:
        return
    finder, directions = TagFinder.of(keys), lens_rays(camera)

    def shown(image: Image) -> int:
        return len(detect_tags(image, camera, directions, keys, finder))

    images = list(_some(camera, recording))
    if any(map(shown, images)):
        return
    if any(shown(np.ascontiguousarray(image[:, ::-1])) for image in images):
        raise DataError(
            f"{recording.path}: shows its tags in a mirror alone: the picture is flipped, as some "
            "webcams show their user. Switch that off, or flip the video, and calibrate the camera "
            "from pictures that are not flipped either"
        )


def _miss(corners_m: Array, seen: Sequence[_Seen]) -> float:
    """Median over the images of the corners' rms miss, as a share of a tag's side."""
    misses = []
    for frame in seen:
        points = corners_m[frame.tags]
        pose = start_pose(points, frame.rays.reshape(-1, 8))
        if pose is None:
            misses.append(1.0)
            continue
        placed = points @ pose[0].T + pose[1]
        off = placed[..., :2] / placed[..., 2:] - frame.rays
        misses.append(min(float(np.sqrt((off**2).sum(axis=2).mean())) / frame.side, 1.0))
    return float(np.median(misses))


Mistake = tuple[Array, str, tuple[int, int] | None]
"""Corners without the mistake, its name, and the tags to exchange where that is it."""


def _mistakes(watch: Watch, seen: Sequence[_Seen]) -> Iterator[Mistake]:
    """The target with each usual mistake undone."""
    corners = watch.tag_corners_m
    centres = corners.mean(axis=1, keepdims=True)
    arms = corners - centres
    visible = np.unique(np.concatenate([frame.tags for frame in seen]))
    for i, k in combinations(visible.tolist(), 2):
        order = np.arange(len(corners))
        order[[i, k]] = order[[k, i]]
        one, other = watch.name(i), watch.name(k)
        yield corners[order], f"with {one} and {other} exchanged they fit", (i, k)
    sizes = [(_miss(centres + s * arms, seen), s) for s in _SIZES]
    size = min(sizes)[1]
    if abs(size - 1.0) > _SAME_SIZE:
        text = f"with size_m {size:.2f} times as large they fit"
        yield centres + size * arms, text, None
    for factor, text in ((1e-3, "with positions in millimetres, not metres, they fit"),
                         (1e3, "with positions 1000 times as large they fit")):  # fmt: skip
        yield factor * centres + arms, text, None
    yield from _other_axes(corners, centres)


def _other_axes(corners: Array, centres: Array) -> Iterator[Mistake]:
    """Tags whose axes are meant otherwise, or whose poses are given the other way round."""
    right = corners[:, 1] - corners[:, 0]
    up = corners[:, 0] - corners[:, 3]
    size = np.linalg.norm(right, axis=1)
    x, y = right / size[:, None], up / size[:, None]
    turns = np.stack([x, y, np.cross(x, y)], axis=2)
    unit = 0.5 * np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])
    own = unit * size[:, None, None]
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            turn = np.zeros((3, 3))
            turn[range(3), order] = signs
            if np.linalg.det(turn) < 0.0 or np.allclose(turn, np.eye(3)):
                continue
            axes = ", ".join(_axis_name(turn[:, k]) for k in range(3))
            text = (
                "with the tags' axes turned they fit (x right, y up, z out of the face are here "
                f"along target.toml's {axes})"
            )
            yield own @ np.swapaxes(turns @ turn, 1, 2) + centres, text, None
    inverse = np.swapaxes(turns, 1, 2)
    moved = -np.einsum("nij,nj->ni", inverse, centres[:, 0])
    text = "with q_platform_tag and t_platform_tag_m inverted they fit: these map tag to platform"
    yield own @ np.swapaxes(inverse, 1, 2) + moved[:, None], text, None


def _axis_name(axis: Array) -> str:
    place = int(np.argmax(np.abs(axis)))
    return ("-" if axis[place] < 0.0 else "") + "xyz"[place]
