"""Corrects the rig for one run: decides which effects are real, and with what they are put right.

Clocks are found only against each other: their common part is set so that most cameras keep the
clock they were calibrated with. A change below its threshold, or below six standard deviations,
is not made.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.rotation import log_rotation
from freeswing.vision.fuse.corner_noise import LEAST_FLOOR_PX
from freeswing.vision.fuse.fuse_cameras import Fit, fuse
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.run_views import CameraViews, instants_of
from freeswing.vision.fuse.tag_growth import growth_of
from freeswing.vision.look.marker_names import label_markers
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.rig.clock_rates import Rates, at_one_rate, clock_rates, refuse_far_apart
from freeswing.vision.rig.gross_faults import (
    moved_too_far,
    refuse_contradicting,
    refuse_disagreement,
    refuse_gross,
)
from freeswing.vision.rig.lag_accepted import Missed, aligned, later
from freeswing.vision.rig.lost.recounted import recounted
from freeswing.vision.rig.moved_cameras import moved_cameras, repose_by_base_tags
from freeswing.vision.rig.real_effects import LEAST_CLOCK_S, LEAST_LINE_S, is_real
from freeswing.vision.rig.rig_kernels import CLOCK, LINE, PER_CAMERA, POSE
from freeswing.vision.rig.rig_step import Finding, RigStep, frame_squares_px2, iterated, rig_step
from freeswing.vision.rig.shared_jitter import widened_by_stamps
from freeswing.vision.rig.stamp_jitter import lateness, stamp_jitter_s, widened_step
from freeswing.vision.rig.standing_still import nothing_asked, stands_still
from freeswing.vision.rig.untied_cameras import untied_shifts

Array = NDArray[np.float64]

_LEAST_KNOWN = 20  # poses: two dozen numbers of a rig do not follow from fewer


@dataclass(frozen=True, slots=True)
class Corrected:
    """A run's poses with the rig as it really was.

    Attributes:
        views: cameras, corrected.
        poses: the platform.
        before: agreement with the cameras as calibrated.
        after: agreement with the corrected ones.
        findings: the effects found.
        remarks: what else was found, in words.
        doubt: how far the poses would go where cameras that no base tag holds disagree beyond
            their noise, and by what is left of how much larger tags look: position and small
            rotation, a column a cause, (n, 6, m).
    """

    views: tuple[CameraViews, ...]
    poses: Poses
    before: Fit
    after: Fit
    findings: tuple[Finding, ...]
    remarks: tuple[str, ...] = ()
    doubt: Array | None = None


def correct_rig(
    views: Sequence[CameraViews],
    watch: Watch,
    survey_std_m: float,
    *,
    look: bool = True,
    rated: bool = False,
) -> Corrected:
    """Poses of a run, with the effects of the cameras found and removed.

    Args:
        views: cameras as calibrated, with their sightings.
        watch: what was looked for.
        survey_std_m: of the base tags' corners.
        look: False leaves the cameras as calibrated.
        rated: whether clocks were brought to one rate already.

    Raises:
        DataError: when a camera is not where it can have got by a knock, clocks run at other rates
            than clocks do, or the cameras do not agree after all corrections.
    """
    started, lost, counted = None, [], []
    if look:
        views, lost, counted = recounted(views, by_tags=bool(watch.tags))
    calibrated = tuple(views)
    if look and watch.tags and len(views):
        started = aligned(
            _standing(views, watch, survey_std_m),
            _reference(views),
            lambda a, b: _missed([a, b], watch, survey_std_m),
        )
        views = tuple(later(view, lag) for view, lag in zip(views, started.lags_s, strict=True))
        refuse_gross(views, watch, started.pairs)
    instants = instants_of(views)
    start = None
    if watch.markers and not watch.named and len(instants):
        views, start = label_markers(views, watch, instants)
    poses, before = fuse(views, watch, instants, start=start)
    if not look or int(poses.known.sum()) < _LEAST_KNOWN:
        return Corrected(tuple(views), poses, before, before, tuple(lost), tuple(counted))
    lags = np.zeros(len(views)) if started is None else started.lags_s
    remarks = (*counted, *(() if started is None else started.remarks))
    moved = moved_cameras(views, watch)
    current = list(views)
    for index in moved:
        current[index] = views[index].believed(
            repose_by_base_tags(views[index], watch, survey_std_m)
        )
    if not moved and stands_still(poses):
        found = nothing_asked(len(views))
    else:
        found = _estimate(current, watch, instants, moved, survey_std_m, poses, lags != 0.0)
    clocks, lines, last, jitter, rates = found
    if rates.real.any() and not rated:
        refuse_far_apart(views, rates)
        offsets = np.array([view.camera.clock_offset_s for view in current])
        even, runs, said = at_one_rate(calibrated, offsets, rates)
        again = correct_rig(even, watch, survey_std_m, rated=True)
        remarks = tuple(dict.fromkeys((*counted, *said, *again.remarks)))  # counted twice alike
        findings = (*lost, *runs, *again.findings)
        return replace(again, before=before, findings=findings, remarks=remarks)
    clocks = clocks + lags
    remarks += _motion_sentences(views, poses, jitter)
    if not (moved or clocks.any() or lines.any()):
        _refuse_contradicting(views, before, jitter)
        views, poses, after, doubt, said = _settled(views, watch, poses, before, survey_std_m)
        poses, along = widened_by_stamps(poses, after, views, watch, jitter)
        remarks = (*remarks, *said, *along)
        return Corrected(views, poses, before, after, tuple(lost), remarks, doubt)
    final = [
        _decided(view, own, clock, line)
        for view, own, clock, line in zip(current, calibrated, clocks, lines, strict=True)
    ]
    _refuse_far(calibrated, final)
    poses, after = fuse(final, watch, instants_of(final), start=_restarted(final, watch, start))
    _refuse_contradicting(final, after, jitter)
    settled, poses, after, doubt, said = _settled(final, watch, poses, after, survey_std_m)
    findings = (*lost, *_findings(calibrated, settled, moved, clocks, lines, last))
    poses, along = widened_by_stamps(poses, after, settled, watch, jitter)
    return Corrected(settled, poses, before, after, findings, (*remarks, *said, *along), doubt)


def _refuse_contradicting(views: Sequence[CameraViews], fit: Fit, jitter_s: Array) -> None:
    """Passes cameras that contradict each other nowhere on end, but by stamps that jitter."""
    refuse_disagreement(views, fit)
    if len(views) > 1 and not jitter_s.any():
        refuse_contradicting(views, fit)


def _standing(
    views: Sequence[CameraViews], watch: Watch, survey_std_m: float
) -> tuple[CameraViews, ...]:
    """Cameras as base tags have them after a knock, which needs no clock; others as calibrated."""
    standing = list(views)
    for index in moved_cameras(views, watch):
        camera = repose_by_base_tags(views[index], watch, survey_std_m)
        if not moved_too_far(views[index].camera, camera):
            standing[index] = views[index].believed(camera)
    return tuple(standing)


def _motion_sentences(
    views: Sequence[CameraViews], poses: Poses, jitter_s: Array
) -> tuple[str, ...]:
    """Why what is seen at different times does not fit together, in words."""
    spectrum = None if poses.course is None or len(views) < 2 else poses.course.spectrum
    hz = None if spectrum is None else spectrum.too_fast_hz
    fast: tuple[str, ...] = ()
    if spectrum is not None and hz is not None:
        rate = 1.0 / spectrum.step_s
        fast = (
            f"the platform swings at {hz:.1f} Hz, or at {rate - hz:.1f} Hz: {rate:.1f} frames a "
            "second do not tell which. What cameras see between each other's frames counts less; "
            "record faster, or let cameras take their frames at the same time",
        )
    return fast + tuple(
        f"{view.camera.name}: its stamps jitter by {1e3 * own:.2f} ms (standard deviation), which "
        "the deviations of poses, clocks and line times count"
        for view, own in zip(views, jitter_s, strict=True)
        if own
    )


def _settled(
    views: Sequence[CameraViews], watch: Watch, poses: Poses, fit: Fit, survey_std_m: float
) -> tuple[tuple[CameraViews, ...], Poses, Fit, Array | None, tuple[str, ...]]:
    """Cameras, poses and agreement without the growth of tags, what is in doubt, and remarks.

    Raises:
        DataError: where the cameras do not agree.
    """
    refuse_disagreement(views, fit)
    growth, said, causes = growth_of(poses, fit, views, watch), [], []
    if growth.is_real:
        views = [view.grown(float(px)) for view, px in zip(views, growth.px, strict=True)]
        poses, fit = fuse(views, watch, poses.times_s, start=poses)
        causes.append(growth.causes())
    if growth.is_real or growth.is_too_large:
        said += [
            _growth_sentence(view.camera.name, px, growth.is_real)
            for view, px in zip(views, growth.px, strict=True)
            if abs(px) > LEAST_FLOOR_PX
        ]
    doubt, untied = untied_shifts(views, watch, poses, fit, survey_std_m)
    if doubt is not None:
        causes.insert(0, doubt[:, :, None])  # runs have it or not: the growth's stay in place
    whole = np.concatenate(causes, axis=2) if causes else None
    return tuple(views), poses, fit, whole, (*said, *untied)


def _growth_sentence(camera: str, px: float, removed: bool) -> str:
    size = f"{camera}: tags look {abs(px):.4f} px {'larger' if px > 0.0 else 'smaller'}"
    if removed:
        return f"{size} to each side, as squeezed pictures make them: taken off"
    return (
        f"{size} to each side than target.toml says, more than squeezed pictures make them: "
        "left as it is; check size_m"
    )


def _missed(views: Sequence[CameraViews], watch: Watch, survey_std_m: float) -> Missed:
    """What the last camera misses, clocks and line times free."""
    instants, current = instants_of(views), list(views)
    poses, fit = fuse(current, watch, instants, passes=2, rough=True, plain=True)
    if int(poses.known.sum()) < _LEAST_KNOWN:
        return Missed(float("inf"), {})
    free = np.zeros((len(views), PER_CAMERA), dtype=bool)
    free[:, LINE] = True
    free[:, CLOCK] = np.arange(len(views)) != _reference(current)
    total = np.zeros_like(free, dtype=float)
    try:
        iterated(current, watch, poses, fit, free, total, survey_std_m, told=False, plain=True)
        poses, fit = fuse(current, watch, instants, start=poses, passes=2, rough=True, plain=True)
    except np.linalg.LinAlgError:  # the rig ran away: no motion has such poses, no start is there
        return Missed(float("inf"), {})
    squares = frame_squares_px2(current, watch, poses)
    clocks = [view.camera.clock_offset_s for view in current]
    return Missed(float(fit.floor_px[-1]), squares, clocks[-1] - clocks[0])


def _refuse_far(views: Sequence[CameraViews], final: Sequence[CameraViews]) -> None:
    """Passes cameras that were corrected by no more than a knock.

    Raises:
        DataError: for one that was not.
    """
    for view, now in zip(views, final, strict=True):
        if moved_too_far(view.camera, now.camera):
            raise DataError(
                f"camera {view.camera.name}: its base tags put it elsewhere than a knock could: "
                "calibrate again"
            )


def _estimate(
    current: list[CameraViews],
    watch: Watch,
    instants: Array,
    moved: dict[int, float],
    survey_std_m: float,
    poses: Poses,
    searched: NDArray[np.bool_],
) -> tuple[Array, Array, RigStep, Array, Rates]:
    """Changes of clock and line time that are real, (n_c,) each; moved cameras in place.

    With the last step, and the jitter and rates of the cameras' stamps. Clocks of cameras whose
    start was `searched`, (n_c,), have nothing that they would rather keep.
    """
    n_c = len(current)
    clock_free = np.arange(n_c) != _reference(current)
    free = np.zeros((n_c, PER_CAMERA), dtype=bool)
    free[list(moved), POSE:] = True
    free[:, CLOCK] = clock_free
    total = np.zeros((n_c, PER_CAMERA))
    poses, fit = fuse(current, watch, instants, start=poses if not moved else None, rough=True)
    step = iterated(current, watch, poses, fit, free, total, survey_std_m)
    with_lines = free.copy()
    with_lines[:, LINE] = True
    poses, fit = fuse(current, watch, instants, start=poses, passes=2, rough=True)
    late = lateness(current, watch, poses, fit)
    jitter = stamp_jitter_s(late)
    # Lines that are not in the views yet put stretches and tags apart: equations alone decide.
    trial = rig_step(current, watch, poses, fit, with_lines, survey_std_m, told=False)
    trial = widened_step(trial, current, jitter)
    lines = trial.changes[:, LINE]
    real = is_real(lines, trial.deviations[:, LINE], LEAST_LINE_S)
    real &= np.abs(lines) < _longest_lines(current)
    if real.any():
        free[:, LINE] = real
        step = iterated(current, watch, poses, fit, free, total, survey_std_m)
        poses, fit = fuse(current, watch, instants, start=poses, passes=2, rough=True)
        late = lateness(current, watch, poses, fit)  # a rolling shutter also makes frames late
    rates = clock_rates(late, poses, fit)
    step = widened_step(step, current, jitter)
    clocks = total[:, CLOCK] - (np.median(total[:, CLOCK]) if n_c > 2 else 0.0)
    deviation = np.where(clock_free, step.deviations[:, CLOCK], step.deviations[:, CLOCK].max())
    sure = is_real(clocks, deviation, LEAST_CLOCK_S) | searched
    if real.any():  # when the middle of a picture was taken is told by both together
        sure[:] = True
    return np.where(sure, clocks, 0.0), np.where(real, total[:, LINE], 0.0), step, jitter, rates


def _longest_lines(views: Sequence[CameraViews]) -> Array:
    """No image takes longer to read than the time to the next one, (n_c,) in s a row."""
    steps = [np.diff(v.stamps_s[np.isfinite(v.stamps_s)]) for v in views]
    return np.array(
        [
            float(np.median(step)) / v.camera.size_px[1] if len(step) else 0.0
            for step, v in zip(steps, views, strict=True)
        ]
    )


def _restarted(views: Sequence[CameraViews], watch: Watch, start: Poses | None) -> Poses | None:
    """Rough poses at the instants of the corrected clocks, where markers alone gave them."""
    return None if start is None else label_markers(views, watch, instants_of(views))[1]


def _reference(views: Sequence[CameraViews]) -> int:
    return int(np.argmax([len(v.numbers) for v in views]))


def _decided(view: CameraViews, calibrated: CameraViews, clock: float, line: float) -> CameraViews:
    """The pose that was found, with clock and line time changed only as decided."""
    camera = replace(
        view.camera,
        clock_offset_s=calibrated.camera.clock_offset_s + float(clock),
        line_time_s=calibrated.camera.line_time_s + float(line),
    )
    return view.believed(camera)


def _findings(
    views: Sequence[CameraViews],
    final: Sequence[CameraViews],
    moved: dict[int, float],
    clocks: Array,
    lines: Array,
    step: RigStep,
) -> tuple[Finding, ...]:
    findings: list[Finding] = []
    deviations = step.deviations
    clock_std = np.where(deviations[:, CLOCK] > 0.0, deviations[:, CLOCK], deviations.max(0)[CLOCK])
    for index, (view, now) in enumerate(zip(views, final, strict=True)):
        name = view.camera.name
        if clocks[index]:
            numbers = (("offset_s", float(clocks[index]), float(clock_std[index])),)
            findings.append(Finding("clock_offset", name, numbers))
        if lines[index]:
            numbers = (("line_time_s", float(lines[index]), float(deviations[index, LINE])),)
            findings.append(Finding("rolling_shutter", name, numbers))
        if index in moved:
            old, new = view.camera.T_camera_base, now.camera.T_camera_base
            turn = log_rotation(new[:3, :3] @ old[:3, :3].T)
            shift = now.camera.position_base_m - view.camera.position_base_m
            std = deviations[index]
            angle = float(np.linalg.norm(turn))
            along = turn / max(angle, 1e-12)
            angle_std = float(np.sqrt((along**2) @ (std[POSE + 3 :] ** 2)))
            names = ("rotation_x_rad", "rotation_y_rad", "rotation_z_rad")
            places = ("shift_x_m", "shift_y_m", "shift_z_m")
            findings.append(
                Finding(
                    "camera_moved",
                    name,
                    (
                        ("rotation_rad", angle, angle_std),
                        *_triples(names, turn, std[POSE + 3 :]),
                        *_triples(places, shift, std[POSE : POSE + 3]),
                    ),
                )
            )
    return tuple(findings)


def _triples(
    names: tuple[str, ...], values: Array, deviations: Array
) -> list[tuple[str, float, float]]:
    return [(n, float(v), float(s)) for n, v, s in zip(names, values, deviations, strict=True)]
