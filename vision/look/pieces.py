"""What the cameras saw, kept on disk in pieces: a killed run goes on after its last whole piece.

A piece holds the sightings of some hundred frames of one camera's recording, and the tracker's
state after them. Its name carries a hash of all inputs, so that a piece of other inputs is never
taken for it; it appears whole or not at all.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.board.recordings import Recording
from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.system.arrays import save_arrays, whole_arrays
from freeswing.vision.look.follow import Follower, FrameView, Look
from freeswing.vision.look.single_pose import Pose
from freeswing.vision.look.watched_target import Watch

Array = NDArray[np.float64]

FRAMES_A_PIECE = 400
# 400 frames of a hundred tags are 27 MB; a larger piece, or a packed one, is none of ours.
MOST_PIECE_BYTES = 256 * 2**20
_VERSION = b"freeswing-sightings/4"


@dataclass(frozen=True, slots=True)
class Piece:
    """Sightings of consecutive frames; frames lead, then sightings in order of frames.

    Attributes:
        numbers: frame numbers, (n_f,).
        stamps_s: the camera's own stamps, (n_f,).
        status: index in `follow.STATUS_NAMES`, (n_f,).
        poses: R_camera_platform and position of the camera alone, NaN where unknown, (n_f, 12).
        frame_of: row of each sighting's frame, (n_o,).
        things: index in the `Watch`, -1 for an unlabelled marker, (n_o,).
        rays: (n_o, 8).
        covariances: (n_o, 8, 8).
        rows_px: image rows of the corners, (n_o, 4).
        quality: blur in px and pixel noise, (n_o, 2).
    """

    numbers: NDArray[np.int64]
    stamps_s: Array
    status: NDArray[np.int64]
    poses: Array
    frame_of: NDArray[np.int64]
    things: NDArray[np.int64]
    rays: Array
    covariances: Array
    rows_px: Array
    quality: Array

    @staticmethod
    def of(numbers: Sequence[int], stamps_s: Sequence[float], views: Sequence[FrameView]) -> Piece:
        """From what a follower said of each frame."""
        sightings = [(row, s) for row, view in enumerate(views) for s in view.sightings]
        n = len(sightings)
        poses = np.full((len(views), 12), np.nan)
        for row, view in enumerate(views):
            if view.pose is not None:
                poses[row, :9], poses[row, 9:] = view.pose[0].ravel(), view.pose[1]
        return Piece(
            np.array(numbers, dtype=np.int64),
            np.array(stamps_s, dtype=np.float64),
            np.array([view.status for view in views], dtype=np.int64),
            poses,
            np.array([row for row, _ in sightings], dtype=np.int64),
            np.array([s.thing for _, s in sightings], dtype=np.int64),
            np.array([s.rays for _, s in sightings]).reshape(n, 8),
            np.array([s.covariance for _, s in sightings]).reshape(n, 8, 8),
            np.array([s.rows_px for _, s in sightings]).reshape(n, 4),
            np.array([(s.blur_px, s.noise) for _, s in sightings]).reshape(n, 2),
        )


def input_hash(camera: Camera, watch: Watch, recording: Recording, stamps: bytes) -> str:
    """Hash of everything that decides a camera's sightings; the video by its size and time."""
    digest = hashlib.sha256(_VERSION)
    files = recording.images or (recording.path,)
    for path in files:
        status = path.stat()
        digest.update(f"{path.name} {status.st_size} {status.st_mtime_ns};".encode())
    digest.update(f"{camera.name} {camera.size_px} {camera.model}".encode())
    for array in (
        camera.params,
        camera.T_camera_base,
        watch.tag_corners_m,
        watch.base_corners_m,
        watch.marker_positions_m,
        watch.marker_diameters_m,
    ):
        digest.update(np.ascontiguousarray(array).tobytes())
    digest.update(stamps)
    digest.update(repr((watch.tags, watch.base_tags, watch.markers)).encode())
    return digest.hexdigest()[:16]


def piece_path(folder: Path, camera: str, inputs: str, index: int) -> Path:
    """Where a piece is kept."""
    return folder / f"{camera}-{inputs}-{index:06d}.npz"


class Remembers(Protocol):
    """A tracker with what it knows of the frames before."""

    past: list[tuple[float, Pose]]
    base_rays: dict[int, Array]
    before: dict[int, Look]
    misses: int
    count: int


def save_piece(path: Path, piece: Piece, follower: Remembers) -> None:
    """Writes a piece and the tracker's state after it."""
    past = follower.past
    members = {name: getattr(piece, name) for name in Piece.__slots__}
    members |= dict(
        past_times=np.array([t for t, _ in past]),
        past_rotations=np.array([r for _, (r, _) in past]).reshape(-1, 3, 3),
        past_positions=np.array([p for _, (_, p) in past]).reshape(-1, 3),
        base_things=np.array(list(follower.base_rays), dtype=np.int64),
        base_rays=np.array(list(follower.base_rays.values())).reshape(-1, 4, 2),
        before_things=np.array(list(follower.before), dtype=np.int64),
        before=np.array(list(follower.before.values())).reshape(-1, 4),
        counters=np.array([follower.misses, follower.count], dtype=np.int64),
    )
    save_arrays(path, members)


def is_whole(path: Path) -> bool:
    """Whether a piece is there and what `save_piece` writes; one that is not is made again."""
    data = whole_arrays(path, MOST_PIECE_BYTES)
    try:
        return data is not None and _is_consistent(data)
    except (KeyError, TypeError):  # a member is missing, or no array of numbers in a row
        return False


def _is_consistent(data: Mapping[str, NDArray[Any]]) -> bool:
    """Whether all members are there, of shapes that belong together, and finite where known."""
    frames, seen = len(data["numbers"]), len(data["frame_of"])
    past, base, before = (
        len(data[name]) for name in ("past_times", "base_things", "before_things")
    )
    shapes = {
        "numbers": (frames,),
        "stamps_s": (frames,),
        "status": (frames,),
        "poses": (frames, 12),
        "frame_of": (seen,),
        "things": (seen,),
        "rays": (seen, 8),
        "covariances": (seen, 8, 8),
        "rows_px": (seen, 4),
        "quality": (seen, 2),
        "past_times": (past,),
        "past_rotations": (past, 3, 3),
        "past_positions": (past, 3),
        "base_things": (base,),
        "base_rays": (base, 4, 2),
        "before_things": (before,),
        "before": (before, 4),
        "counters": (2,),
    }
    known = ("stamps_s", "past_times", "past_rotations", "past_positions")
    return (
        all(data[name].shape == shape for name, shape in shapes.items())
        and all(data[name].dtype.kind in "iuf" for name in shapes)
        and all(np.isfinite(data[name]).all() for name in known)
        and bool(((data["frame_of"] >= 0) & (data["frame_of"] < max(frames, 1))).all())
    )


def load_piece(path: Path) -> Piece:
    """A piece as it was saved."""
    with np.load(path, allow_pickle=False) as data:
        return Piece(**{name: data[name] for name in Piece.__slots__})


def restore(follower: Follower, path: Path) -> None:
    """Puts a follower into the state that it had after the piece."""
    with np.load(path, allow_pickle=False) as data:
        follower.past = [
            (float(t), (r, p))
            for t, r, p in zip(
                data["past_times"], data["past_rotations"], data["past_positions"], strict=True
            )
        ]
        follower.base_rays = dict(
            zip(map(int, data["base_things"]), data["base_rays"], strict=True)
        )
        follower.before = {
            int(thing): (float(row[0]), float(row[1]), float(row[2]), float(row[3]))
            for thing, row in zip(data["before_things"], data["before"], strict=True)
        }
        follower.misses, follower.count = (int(v) for v in data["counters"])
