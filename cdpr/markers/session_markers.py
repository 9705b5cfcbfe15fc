"""All marker recordings of a session together: each examined, one layout, then the poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.problems import DataError, InputError
from freeswing.cdpr.markers.common_frame import common_frame
from freeswing.cdpr.markers.contradicting_samples import stand_outs
from freeswing.cdpr.markers.distances import pairs_of, typical_distances
from freeswing.cdpr.markers.exchanged_labels import renamed
from freeswing.cdpr.markers.layout_of_session import SessionLayout, session_layout
from freeswing.cdpr.markers.layouts_aligned import Alignment, align
from freeswing.cdpr.markers.marker_jumps import Jump, Mended, mended
from freeswing.cdpr.markers.marker_units import unit_between
from freeswing.cdpr.markers.slow_residuals import slow_share
from freeswing.cdpr.markers.spoiling_markers import Rigidity, marker_weights, rigidity
from freeswing.cdpr.markers.undecided_marker import refuse_undecided
from freeswing.cdpr.measured.marker_recording import MarkerRecording
from freeswing.cdpr.measured.pose_errors import PoseErrors
from freeswing.cdpr.measured.rigid_fit import fit_rigid, pose_covariances
from freeswing.cdpr.measured.slow_errors import SlowErrors
from freeswing.cdpr.measured.target import Target
from freeswing.cdpr.measured.trajectory import Trajectory

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

FEWEST_SAMPLES = 8  # a mean layout and each marker's deviation to a quarter of itself


@dataclass(frozen=True, slots=True)
class Examined:
    """One recording looked at by itself; its layout is in a frame of its own.

    Attributes:
        recording: the target's markers, in its order, gross faults put right or left out.
        faults: what was put right or left out; frames count within the window.
        order: columns that were taken for the target's markers where all labels are exchanged.
        rigidity: what the markers are worth within the window.
        stand_outs: kept markers that contradict the others for some samples, which have no pose.
    """

    recording: MarkerRecording
    faults: Mended
    order: tuple[int, ...] | None
    rigidity: Rigidity
    stand_outs: tuple[Jump, ...] = ()


@dataclass(frozen=True, slots=True)
class RunMarkers:
    """One recording with its poses.

    Attributes:
        examined: what was found in it.
        layout_change_m: its markers' places minus the session's layout, platform frame, (n_m, 3).
        trajectory: the poses, with covariances and slow errors.
        errors: what target.toml leaves open of the frame of all runs, in this one's poses; None
            where the layout could not be laid on it.
    """

    examined: Examined
    layout_change_m: Array
    trajectory: Trajectory
    errors: PoseErrors | None = None


def examine(
    recording: MarkerRecording, target: Target, window_s: tuple[float, float] | None = None
) -> Examined:
    """Look one recording over.

    Args:
        recording: as it was read.
        target: only markers that a pose can rest on; see `usable_target`.
        window_s: the free motion, None: the whole recording counts.

    Raises:
        InputError: where the file and the target do not have the same unit.
        DataError: where no sample of the window shows three markers.
    """
    nominal = target.marker_positions_m
    chosen = recording.select(target.marker_names)
    points = np.array(chosen.positions_m)
    _check_unit(recording.source, nominal, points)
    order = renamed(nominal, points)
    if order is not None:
        points = points[:, list(order)]
    faults = mended(points)
    inside = _inside(recording.times_s, window_s)
    enough = np.isfinite(faults.positions_m[inside]).all(axis=2).sum(axis=1) >= 3
    if enough.sum() < FEWEST_SAMPLES:
        most = int(np.isfinite(points[inside]).all(axis=2).sum(axis=1).max(initial=0))
        raise DataError(
            f"{recording.source}: no sample shows three markers that are not on a line (at most "
            f"{most} at once); name the markers as in the target file, or add markers"
        )
    positions = np.array(faults.positions_m)
    found = rigidity(nominal, positions[inside])
    within = np.flatnonzero(inside)
    doubtful = tuple(replace(one, frames=within[one.frames]) for one in stand_outs(found))
    if doubtful:
        positions[np.concatenate([one.frames for one in doubtful])] = np.nan
        found = rigidity(nominal, positions[inside])
    clean = replace(chosen, positions_m=positions)
    return Examined(clean, faults.within(inside), order, found, doubtful)


def common_layout(target: Target, runs: Sequence[Examined]) -> SessionLayout:
    """The one layout of the session; see `cdpr.markers.layout_of_session.session_layout`.

    Raises:
        DataError: where which marker is off cannot be told, and the answer matters.
    """
    layouts = [_without_left_out(run.rigidity) for run in runs]
    noise = float(np.median([run.rigidity.kept_m for run in runs]))
    samples = min(len(run.recording.times_s) for run in runs)
    found = session_layout(target.marker_positions_m, layouts, noise / np.sqrt(samples))
    if found.from_target is not None:
        refuse_undecided(target, found.from_target)
    return found


def place(examined: Examined, layout: SessionLayout) -> RunMarkers:
    """The poses of a run, by the session's layout with the run's own small changes.

    Raises:
        DataError: where fewer than three of the run's markers are in the layout.
    """
    recording, found = examined.recording, examined.rigidity
    use = np.ones(len(recording.names))
    use[list(found.left_out)] = 0.0
    onto = align(found.layout_m, layout.layout_m, layout.run_std_m, use)
    if onto is None:
        raise DataError(f"{recording.source}: fewer than three of its markers can be used")
    own = np.where(np.isfinite(onto.points_m), onto.points_m, 0.0)
    weights = marker_weights(found.std_m, found.left_out)
    seen = np.isfinite(recording.positions_m).all(axis=2)
    R, t, covariances = _poses(own, recording.positions_m, weights * seen)
    share, correlation_s = slow_share(found.residuals_m[:, weights > 0.0], recording.step_s)
    usual = pose_covariances(own, np.eye(3)[None], weights[None])[0]
    slow = SlowErrors(_frame_covariance(onto), share * usual, correlation_s)
    provenance = (
        f"{recording.source}: rigid fit of {int((weights > 0.0).sum())} markers, "
        f"noise {1e3 * found.kept_m:.3g} mm"
    )
    known = covariances if found.kept_m > 0.0 else None
    trajectory = Trajectory.from_poses(recording.times_s, t, R, known, provenance, slow)
    told = layout.from_target
    common = None if told is None else common_frame(_frame_covariance(told), trajectory)
    return RunMarkers(examined, onto.change_m, trajectory, common)


def _poses(layout: Array, points: Array, weights: Array) -> tuple[Array, Array, Array]:
    R, t = fit_rigid(layout, points, weights)
    return R, t, pose_covariances(layout, R, weights)


def fit_session(
    target: Target,
    recordings: Sequence[MarkerRecording],
    windows_s: Sequence[tuple[float, float] | None] | None = None,
) -> tuple[SessionLayout, tuple[RunMarkers, ...]]:
    """Examine, lay out and place all recordings at once; see the three functions above."""
    windows = windows_s or [None] * len(recordings)
    runs = [examine(rec, target, window) for rec, window in zip(recordings, windows, strict=True)]
    layout = common_layout(target, runs)
    return layout, tuple(place(run, layout) for run in runs)


def _without_left_out(found: Rigidity) -> Array:
    layout = found.layout_m.copy()
    layout[list(found.left_out)] = np.nan
    return layout


def _inside(times_s: Array, window_s: tuple[float, float] | None) -> Mask:
    if window_s is None:
        return np.ones(len(times_s), dtype=bool)
    inside = (times_s >= window_s[0] - 1e-6) & (times_s <= window_s[1] + 1e-6)
    # A window beyond the samples is named by whoever cuts it; here all samples count then.
    return inside if inside.any() else np.ones(len(times_s), dtype=bool)


def _check_unit(source: str, nominal: Array, points: Array) -> None:
    pairs = pairs_of(len(nominal))
    found = unit_between(nominal, typical_distances(points, pairs))
    if found is None:
        return
    factor, target_is_wrong = found
    if target_is_wrong:
        raise InputError(
            f"target.toml: position_m: its markers are {1.0 / factor:g} times as far apart as in "
            f"{source}; position_m is in metres"
        )
    raise InputError(
        f"{source}: its markers are {factor:g} times as far apart as in target.toml: the unit that "
        "the file states is not that of its numbers; export it again or correct its header"
    )


def _frame_covariance(onto: Alignment) -> Array:
    """Of the constant error of the run's frame, wider where which marker moved is open."""
    if onto.rival_m == 0.0:
        return onto.covariance
    points = np.where(np.isfinite(onto.points_m), onto.points_m, 0.0)
    reach = np.array([np.linalg.norm(np.cross(np.eye(3), p), 2) for p in points]).max()
    shift = np.linalg.eigvalsh(onto.covariance[:3, :3])[-1]
    moved = shift + reach**2 * np.linalg.eigvalsh(onto.covariance[3:, 3:])[-1]
    return onto.covariance * max(1.0, (0.5 * onto.rival_m) ** 2 / moved)
