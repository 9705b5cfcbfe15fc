"""Markers of recordings that exist: their names, their places on the body, what to do with each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.files.trajectory_files import read_recording
from freeswing.cdpr.measured.marker_recording import MarkerRecording
from freeswing.cdpr.robot import Array

FEWEST = 3
VALIDATE_EVERY = 3  # every third recording is kept apart: a check on two runs at six recordings
_ROUNDS = 5


@dataclass(frozen=True, slots=True)
class Recorded:
    """What a set of recordings holds.

    Attributes:
        files: in the order of their names.
        names: of the markers that all files have.
        positions_m: of each in the platform frame, (n, 3).
        rate_hz: samples a second.
        spread_m: how far the markers' distances are from rigid, rms.
    """

    files: tuple[Path, ...]
    names: tuple[str, ...]
    positions_m: Array
    rate_hz: float
    spread_m: float


def look_over(files: Sequence[Path]) -> Recorded:
    """Read recordings of one body.

    The platform frame is put at the first marker, with the base's axes as the body hangs in the
    middle of the first recording: so attachments can be measured from that marker with a tape.

    Raises:
        InputError: a file that is no recording of markers.
        DataError: fewer than three markers that all files hold, or that are never seen together.
    """
    ordered = tuple(sorted(files, key=lambda path: path.name))
    recordings = [read_recording(path) for path in ordered]
    first = recordings[0]
    names = tuple(
        name for name in first.names if all(r.column(name) is not None for r in recordings)
    )
    if len(names) < FEWEST:
        raise DataError(
            f"{first.source}: {len(names)} markers that all recordings hold, at least {FEWEST} are "
            f"needed for a pose: {', '.join(names) or 'none'}"
        )
    seen = first.select(names).positions_m
    whole = seen[np.isfinite(seen).all(axis=(1, 2))]
    if not len(whole):
        raise DataError(f"{first.source}: its {len(names)} markers are never seen together")
    shape, spread = _shape(whole)
    return Recorded(ordered, names, shape - shape[0], _rate_hz(first), spread)


def role(index: int, count: int) -> str:
    """Every third recording checks, the others identify; fewer than three all identify."""
    return "validate" if count >= VALIDATE_EVERY and index % VALIDATE_EVERY == 2 else "identify"


def _rate_hz(recording: MarkerRecording) -> float:
    return round(1.0 / float(np.median(np.diff(recording.times_s))), 3)


def _shape(positions_m: Array) -> tuple[Array, float]:
    """Mean shape of a rigid body as it hangs on average, (n, 3), and what is left, rms.

    Source: generalised Procrustes analysis with rotations alone (Gower 1975).
    """
    centred = positions_m - positions_m.mean(axis=1, keepdims=True)
    shape = centred[len(centred) // 2]
    turns = _turns(centred, shape)
    for _ in range(_ROUNDS):
        turns = _turns(centred, shape)
        shape = np.einsum("tij,tnj->ni", turns, centred) / len(centred)
    left = np.einsum("tij,tnj->tni", turns, centred) - shape
    back = _nearest_rotation(turns.sum(axis=0).T)  # to the axes in which it hangs on average
    return shape @ back.T, float(np.sqrt(np.mean(left**2)))


def _turns(centred: Array, shape: Array) -> Array:
    """The rotation of each sample onto the shape, (n_t, 3, 3)."""
    return np.stack([_nearest_rotation(shape.T @ one) for one in centred])


def _nearest_rotation(matrix: Array) -> Array:
    """Of a 3 x 3 matrix (Kabsch 1976)."""
    left, _, right = np.linalg.svd(matrix)
    sign = np.sign(np.linalg.det(left @ right))
    return np.asarray(left @ np.diag([1.0, 1.0, sign]) @ right, dtype=np.float64)
