"""Markers of motion capture: which lie, which labels are wrong, which runs deserve less trust."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from freeswing.cdpr.markers.session_markers import RunMarkers
from freeswing.cdpr.markers.undecided_marker import open_question
from freeswing.doctor.finding import Finding
from freeswing.session.marker_runs import MarkerRuns

# A target.toml measured by hand is good to this; more is a wrong number or a marker that moved.
TARGET_OFF_M = 2e-3
# Up to here a jump is a marker half hidden for a moment, beyond it another reflection.
LARGE_JUMP_M = 5e-3
# Rigidity of a run against the median of all: its poses weigh nine times less.
LESS_TRUST = 3.0
LAYOUT_CHANGE_M = 2e-3  # markers that nobody touched differ from run to run by tenths of a mm


def marker_findings(markers: MarkerRuns) -> Iterator[Finding]:
    """What stands out in the session's marker recordings, and how rigid each marker is."""
    if markers.layout_failure is not None:
        yield Finding("error", "target", str(markers.layout_failure))
    yield from _layout(markers)
    levels = [run.examined.rigidity.kept_m for run in markers.runs.values()]
    for name, run in markers.runs.items():
        yield from _faults(f"run {name}", run)
        yield from _rigidity(f"run {name}", run, float(np.median(levels)))


def _layout(markers: MarkerRuns) -> Iterator[Finding]:
    layout, target = markers.layout, markers.target
    if layout is None or target is None:
        return
    for name, change, place in zip(
        target.marker_names, layout.change_m, layout.layout_m, strict=True
    ):
        size = float(np.linalg.norm(change))
        if size > TARGET_OFF_M:
            where = ", ".join(f"{value:.5f}" for value in place)
            text = (
                f"marker {name} lies {1e3 * size:.1f} mm from where target.toml has it "
                f"({_mm(change)} mm along x, y, z)"
            )
            remedy = f"its measured place is used; the others fit with position_m = [{where}]"
            yield Finding("warning", "target", text, remedy)
    onto = layout.from_target
    if onto is not None and onto.rival_m > 0.0:
        text = open_question(target, onto)
        remedy = (
            f"the platform frame is uncertain by {1e3 * onto.rival_m:.1f} mm: measure them again"
        )
        yield Finding("warning", "target", text, remedy)
    fits = np.linalg.norm(layout.change_m, axis=1)
    text = (
        f"the markers lie as target.toml says to {1e3 * float(np.nanmedian(fits)):.2f} mm "
        f"(median), and differ from run to run by {1e3 * layout.run_std_m:.3f} mm"
    )
    yield Finding("note", "markers", text)


def _faults(subject: str, run: RunMarkers) -> Iterator[Finding]:
    examined, names = run.examined, run.examined.recording.names
    for note in examined.recording.notes:
        yield Finding("note", subject, note)
    times = examined.recording.times_s
    if examined.order is not None:
        moved = [
            f"{names[k]} is labelled {names[j]}" for k, j in enumerate(examined.order) if k != j
        ]
        text = f"labels are exchanged throughout: {', '.join(moved)}"
        yield Finding("warning", subject, text, "they are taken as target.toml has them")
    for exchange in examined.faults.exchanges:
        labels = " and ".join(names[k] for k in exchange.markers)
        start = times[exchange.frames[0]]
        text = f"labels {labels} are exchanged in {len(exchange.frames)} samples from {start:.2f} s"
        yield Finding("warning", subject, text, "they are put right there")
    for jump in examined.faults.jumps:
        start, size = times[jump.frames[0]], 1e3 * jump.most_m
        text = (
            f"marker {names[jump.marker]} jumps by up to {size:.1f} mm in {len(jump.frames)} "
            f"samples from {start:.2f} s"
        )
        level = "warning" if jump.most_m > LARGE_JUMP_M else "note"
        yield Finding(level, subject, text, "it is left out of these samples")
    for one in examined.stand_outs:
        text = (
            f"marker {names[one.marker]} contradicts the others by up to {1e3 * one.most_m:.1f} mm "
            f"in {len(one.frames)} samples from {times[one.frames.min()]:.2f} s"
        )
        yield Finding("note", subject, text, "these samples have no pose")


def _rigidity(subject: str, run: RunMarkers, usual_m: float) -> Iterator[Finding]:
    found, names = run.examined.rigidity, run.examined.recording.names
    for k in found.left_out:
        text = (
            f"marker {names[k]} is not rigid with the others: {_um(found.std_m[k])} um; all agree "
            f"to {_um(found.all_m)} um, those that are kept to {_um(found.kept_m)} um"
        )
        yield Finding("warning", subject, text, "it is left out; is it loose, or partly hidden?")
    if found.kept_m > LESS_TRUST * usual_m:
        text = f"its markers agree to {_um(found.kept_m)} um, half of the runs to {_um(usual_m)} um"
        yield Finding("warning", subject, text, "it weighs less; drop it if it contradicts others")
    sizes = np.linalg.norm(run.layout_change_m, axis=1)
    for k in np.flatnonzero(sizes > LAYOUT_CHANGE_M):
        if k not in found.left_out:
            text = (
                f"marker {names[k]} sits {1e3 * sizes[k]:.1f} mm from its place in the other runs"
            )
            yield Finding("warning", subject, text, "was it touched, or another reflection taken?")
    each = ", ".join(
        f"{name} {_um(std)}" for name, std in zip(names, found.std_m, strict=True) if std == std
    )
    text = f"markers are rigid to {each} um"
    slow = run.trajectory.slow
    if slow is not None:
        frame = np.sqrt(np.diag(slow.frame_covariance))
        text += f"; its platform frame is known to {1e3 * frame[:3].max():.2g} mm and "
        text += f"{1e3 * frame[3:].max():.2g} mrad"
    yield Finding("note", subject, text)


def _um(metres: float) -> str:
    return f"{1e6 * metres:.0f}"


def _mm(vector: np.ndarray) -> str:
    return ", ".join(f"{1e3 * value:+.1f}" for value in vector)
