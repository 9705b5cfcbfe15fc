"""Images of the laboratory at rest: one of each camera of the rig, many of one carried through."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from freeswing.calib.board.recordings import (
    VIDEO_SUFFIXES,
    Image,
    Recording,
    find_recordings,
    read_frames,
)
from freeswing.cdpr.files.documents import InputError

MOST_WALK = 80  # images of a walk: pairs grow with the square, 80 take minutes
_FRAMES_AT_REST = 9  # averaged: noise falls to a third
LEAST_IMAGES = 3  # of a walk, and of a map: two give a point no third sighting to test it
_AT_REST_GREY = 12.0  # mean of a whole image: noise makes 5


@dataclass(frozen=True, slots=True)
class Still:
    """One image.

    Attributes:
        name: the camera of the rig, or the file or frame of the walk.
        image: grey, (h, w).
        walk: whether the camera that is carried took it: all of those have one lens.
    """

    name: str
    image: Image
    walk: bool = False

    @property
    def file(self) -> str:
        """Its file below the folder that COLMAP works in."""
        return f"{'walk' if self.walk else 'rig'}/{self.name}.png"


def rig_stills(folder: Path) -> tuple[Still, ...]:
    """One image of every camera: the mean of the first frames of its recording.

    Raises:
        InputError: unreadable recordings, or something moves in a camera's frames.
    """
    stills = []
    for recording in find_recordings(folder):
        frames = [f for _, _, f in itertools.islice(read_frames(recording), _FRAMES_AT_REST)]
        if not frames:
            raise InputError(f"{recording.path}: holds no frame")
        stack = np.array(frames, dtype=np.float32)
        moved = float(np.abs(stack[-1] - stack[0]).mean())
        if moved > _AT_REST_GREY:
            raise InputError(
                f"{recording.path}: its frames differ by {moved:.0f} grey levels in the mean, at "
                f"rest they do by at most {_AT_REST_GREY:.0f}: film the laboratory with the camera "
                "mounted and nothing moving"
            )
        stills.append(Still(recording.name, np.asarray(np.rint(stack.mean(axis=0)), np.uint8)))
    return tuple(stills)


def walk_stills(path: Path) -> tuple[Still, ...]:
    """Images of the camera that is carried: a folder of stills, or the sharpest of a video.

    Raises:
        InputError: absent, unreadable, too few, or images of several sizes.
    """
    recording = _walk(path)
    found: list[Still] = []
    for _, label, image in _shares(recording):
        name = Path(label).stem if recording.images else label.rpartition(" ")[2].zfill(6)
        found.append(Still(name, image, walk=True))
    if len(found) < LEAST_IMAGES:
        raise InputError(
            f"{path}: {len(found)} images, need {LEAST_IMAGES}: walk with the camera to where it "
            "sees what each camera of the rig sees, and take 20 to 60 stills on the way"
        )
    return tuple(found)


def _walk(path: Path) -> Recording:
    if path.is_file() and path.suffix.lower() in VIDEO_SUFFIXES:
        return Recording(path.stem, path)
    if not path.is_dir():
        raise InputError(f"{path}: no such folder of stills, and no video")
    same = [one for one in find_recordings(path.parent) if one.path == path]
    if not same:
        raise InputError(f"{path}: holds no image (.png, .jpg); put the walk's stills there")
    return same[0]


def _shares(recording: Recording) -> list[tuple[int, str, Image]]:
    """All frames, each with the number of the share of the walk that it stands for."""
    from freeswing.calib.footage.container_times import presentation_of

    shown = None if recording.images else presentation_of(recording.path)
    count = len(recording.images) if shown is None else len(shown.ticks)
    if recording.images and count <= MOST_WALK:
        return [(k, label, f) for k, (_, label, f) in enumerate(read_frames(recording))]
    step = max(1, count // MOST_WALK)
    wanted: list[tuple[int, str, Image]] = []
    for k, (_, label, image) in enumerate(read_frames(recording)):
        share = k // step
        if wanted and wanted[-1][0] == share:
            if _sharp(image) > _sharp(wanted[-1][2]):
                wanted[-1] = (share, label, image)
        elif share < MOST_WALK:
            wanted.append((share, label, image))
    return wanted


def _sharp(image: Image) -> float:
    """How sharp an image is: mean square of the differences of neighbours."""
    return float(np.mean(np.diff(image.astype(np.float32), axis=1) ** 2))
