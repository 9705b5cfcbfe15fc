"""Boards found so far, kept on disk in pieces: a killed calibration goes on after its last piece.

A piece holds what the detector said of some consecutive frames of one camera, and the detector's
state after them. Its name carries a hash of the recording and the board.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from freeswing.calib.board.board_corners import BoardCorners, BoardDetector, Image
from freeswing.calib.board.declared_board import Board
from freeswing.calib.board.platform_as_board import PlatformDetector, PlatformTags
from freeswing.calib.board.recordings import Recording
from freeswing.cdpr.system.arrays import Arrays, save_arrays, whole_arrays

FRAMES_A_PIECE = 50
# 50 frames of the largest board, 400 tags, are 12 MB.
MOST_PIECE_BYTES = 64 * 2**20
_VERSION = "freeswing-boards/1"


@dataclass(slots=True)
class KeptBoards:
    """A detector that looks at a recording's frames in order, each frame once in its life.

    Attributes:
        detector: looks at frames of which nothing is kept.
        folder: where pieces are kept, None for nowhere.
        recording: the frames' recording.
        n_frames: frames that will be looked at.
    """

    detector: BoardDetector | PlatformDetector
    folder: Path | None
    recording: Recording
    n_frames: int
    _inputs: str = field(init=False, default="", repr=False)
    _looked_at: int = field(init=False, default=0, repr=False)
    _kept: list[BoardCorners | None] | None = field(init=False, default=None, repr=False)
    _new: list[BoardCorners | None] = field(init=False, default_factory=list, repr=False)

    def __post_init__(self) -> None:
        if self.folder is not None:
            self._inputs = _input_hash(self.recording, self.detector.board)

    def look(self, image: Image) -> BoardCorners | None:
        """The board in the next frame, as `BoardDetector.detect` finds it."""
        row = self._looked_at % FRAMES_A_PIECE
        if row == 0:
            self._kept = self._load()
        self._looked_at += 1
        if self._kept is not None:
            return self._kept[row]
        corners = self.detector.detect(image)
        self._new.append(corners)
        if self._looked_at in (self.n_frames, self._first() + FRAMES_A_PIECE):
            self._save()
        return corners

    def _first(self) -> int:
        """Number of the current piece's first frame."""
        return (self._looked_at - 1) // FRAMES_A_PIECE * FRAMES_A_PIECE

    def _path(self, first: int) -> Path | None:
        name = f"{self.recording.name}-{self._inputs}-{first:06d}.npz"
        return None if self.folder is None else self.folder / name

    def _save(self) -> None:
        found = [corners for corners in self._new if corners is not None]
        blank = self.detector.nothing()
        arrays = {
            "seen": np.array([corners is not None for corners in self._new]),
            "pixels": np.stack([blank.pixels, *(c.pixels for c in found)])[1:],
            "covariance_px2": np.stack([blank.covariance_px2, *(c.covariance_px2 for c in found)])[
                1:
            ],
            "state": self.detector.state,
        }
        self._new = []
        if (path := self._path(self._first())) is not None:
            save_arrays(path, arrays)

    def _load(self) -> list[BoardCorners | None] | None:
        """What is kept of the piece that begins here; the detector is put into its state then."""
        path = self._path(self._looked_at)
        arrays = None if path is None else whole_arrays(path, MOST_PIECE_BYTES)
        count = min(FRAMES_A_PIECE, self.n_frames - self._looked_at)
        if arrays is None or not _belongs(arrays, count, self.detector):
            return None
        self.detector.restore(arrays["state"])
        found = zip(arrays["pixels"], arrays["covariance_px2"], strict=True)
        return [BoardCorners(*next(found)) if seen else None for seen in arrays["seen"]]


def _belongs(arrays: Arrays, count: int, detector: BoardDetector | PlatformDetector) -> bool:
    """Whether a piece is of so many frames, of this board, and says what a detector may say."""
    blank = detector.nothing()
    seen = arrays.get("seen", np.zeros(0))
    if seen.shape != (count,) or seen.dtype != np.bool_:
        return False
    like = {"pixels": blank.pixels, "covariance_px2": blank.covariance_px2}
    for name, one in like.items():
        found = arrays.get(name, np.zeros(0))
        if found.shape != (int(seen.sum()), *one.shape) or found.dtype != np.float64:
            return False
        if np.isinf(found).any():
            return False
    state = arrays.get("state", np.zeros(0))
    return state.dtype == np.int64 and detector.knows(state)


def _input_hash(recording: Recording, board: Board | PlatformTags) -> str:
    """Hash of what decides the sightings; recordings by their files' sizes and times."""
    digest = hashlib.sha256(f"{_VERSION} {board}".encode())
    for path in recording.images or (recording.path,):
        status = path.stat()
        digest.update(f"{path.name} {status.st_size} {status.st_mtime_ns};".encode())
    return digest.hexdigest()[:16]
