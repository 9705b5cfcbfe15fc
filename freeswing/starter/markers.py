"""Recordings that exist: their markers, places on the body, free motions, what to do with each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.files.trajectory_files import (
    holds_markers,
    read_recording,
    read_trajectory,
)
from freeswing.cdpr.markers.from_recording import trajectory_from_markers
from freeswing.cdpr.measured.target import Marker, Target
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import Array
from freeswing.cdpr.rotation import nearest_rotation
from freeswing.ident.signals.free_motions import free_motions
from freeswing.session.new_recordings import VALIDATE_EVERY
from freeswing.session.session_file import as_run_name

FEWEST = 3
_ROUNDS = 5


@dataclass(frozen=True, slots=True)
class FoundRun:
    """A swing of a recording.

    Attributes:
        name: of the run.
        file: that holds it.
        window_s: of the free motion; None: the recording holds one, which the program finds.
    """

    name: str
    file: Path
    window_s: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Recorded:
    """What a set of recordings holds.

    Attributes:
        files: in the order of their names.
        runs: the swings in them.
        names: of the markers that all files have; empty where the files hold poses.
        positions_m: of each in the platform frame, (n, 3).
        rate_hz: samples a second.
        spread_m: how far the markers' distances are from rigid, rms.
        low_m: least x, y, z at which the reference point was seen, (3,).
        high_m: the greatest.
    """

    files: tuple[Path, ...]
    runs: tuple[FoundRun, ...]
    names: tuple[str, ...]
    positions_m: Array
    rate_hz: float
    spread_m: float
    low_m: Array
    high_m: Array


def look_over(files: Sequence[Path]) -> Recorded:
    """Read recordings of one body: all of markers, or all of poses.

    With markers the platform frame is put at the first marker, with the base's axes as the body
    hangs in the middle of the first recording: so attachments can be measured from that marker
    with a tape. A recording with several free swings becomes several runs.

    Raises:
        InputError: a file that is no recording of markers or poses.
        DataError: fewer than three markers that all files hold, or that are never seen together.
    """
    ordered = tuple(sorted(files, key=lambda path: path.name))
    if not any(holds_markers(path) for path in ordered):
        return _poses(ordered)
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
    places = shape - shape[0]
    target = Target(markers=tuple(Marker(n, p) for n, p in zip(names, places, strict=True)))
    motions = [trajectory_from_markers(one.select(names), None, target) for one in recordings]
    extent = _extent([motion.values[:, :3] for motion in motions])
    rate = _rate_hz(first.times_s)
    return Recorded(ordered, _runs(ordered, motions), names, places, rate, spread, *extent)


def role(index: int, count: int) -> str:
    """Every third recording checks, the others identify; fewer than three all identify."""
    return "validate" if count >= VALIDATE_EVERY and index % VALIDATE_EVERY == 2 else "identify"


def _poses(files: tuple[Path, ...]) -> Recorded:
    """Recordings whose program had already found the platform's pose."""
    motions = [read_trajectory(path) for path in files]
    places = [motion.values[:, :3] for motion in motions]
    runs, rate = _runs(files, motions), _rate_hz(motions[0].times_s)
    return Recorded(files, runs, (), np.zeros((0, 3)), rate, 0.0, *_extent(places))


def _runs(files: Sequence[Path], motions: Sequence[Trajectory]) -> tuple[FoundRun, ...]:
    """A run a file, or a run a swing where a file holds several."""
    found: list[FoundRun] = []
    for file, motion in zip(files, motions, strict=True):
        windows = free_motions(motion)
        parts = [(file.stem, None)]
        if len(windows) > 1:
            parts = [(f"{file.stem}-{k:02d}", w) for k, w in enumerate(windows, start=1)]
        for stem, window in parts:
            name = as_run_name(stem, [one.name for one in found])
            found.append(FoundRun(name, file, window))
    return tuple(found)


def _extent(places: Sequence[Array]) -> tuple[Array, Array]:
    """Least and greatest coordinates over all recordings."""
    joined = np.concatenate(places)
    return np.nanmin(joined, axis=0), np.nanmax(joined, axis=0)


def _rate_hz(times_s: Array) -> float:
    return round(1.0 / float(np.median(np.diff(times_s))), 3)


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
    back = nearest_rotation(turns.sum(axis=0).T)  # to the axes in which it hangs on average
    return shape @ back.T, float(np.sqrt(np.mean(left**2)))


def _turns(centred: Array, shape: Array) -> Array:
    """The rotation of each sample onto the shape, (n_t, 3, 3)."""
    return np.stack([nearest_rotation(shape.T @ one) for one in centred])
