"""Panel: the cameras. Calibration, how they agree on the platform, the rig in space."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from freeswing.cdpr.rotation import matrix_from_quaternion
from freeswing.report.figures import AFTER, BEFORE, INK, SERIES, figure
from freeswing.report.material import Material
from freeswing.report.words import HALF_WIDTH_95, number, plain
from freeswing.results.calibration import CalibratedCamera, Checks
from freeswing.results.codec import Numbers
from freeswing.results.common import FoundEffect
from freeswing.results.identification import SwingPlace
from freeswing.results.tracking import TrackedRun

FRUSTUM_M = 0.35
HATCHES = ("", "////", "....", "xxxx", "\\\\\\\\", "++++")


class Cameras:
    """How well the cameras are known, and how well they agree on where the platform is."""

    name = "cameras"
    title = "The cameras"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Calibration by camera, tracking by run, what was corrected, and the rig."""
        calibration, tracking = material.calibration, material.tracking
        if calibration is None and tracking is None:
            return None
        cameras = () if calibration is None else calibration.cameras
        runs = () if tracking is None else tracking.runs
        verdict = None if calibration is None else calibration.verdict
        found = material.identification
        swings, entries = ((), ()) if found is None else (found.swings, found.entries_m)
        return {
            "cameras": [_camera(entry) for entry in cameras],
            "warnings": [*verdict.reasons, *verdict.warnings] if verdict else [],
            "checks": _checks(calibration.checks if calibration else None),
            "runs": [_run(entry) for entry in runs],
            "effects": [_effect(entry) for entry in (tracking.effects if tracking else ())],
            "agreement": _agreement(runs),
            "rig": _rig(cameras, swings, entries),
        }


def _camera(entry: CalibratedCamera) -> dict[str, str]:
    seen, frames = ("–" if n is None else n for n in (entry.frames_with_board, entry.frames))
    return {
        "camera": entry.name,
        "board seen": f"{seen} of {frames} frames",
        "field covered": "–" if entry.coverage is None else f"{100 * entry.coverage:.0f} %",
        "reprojection (px)": number(entry.reprojection_px),
        "on unused views (px)": number(entry.held_out_px),
        "position ± 95 % (mm)": number(_largest(entry.position_std_m), 2),
        "rotation ± 95 % (mrad)": number(_largest(entry.rotation_std_rad), 2),
        "clock ± 95 % (ms)": _clock(entry),
    }


def _clock(entry: CalibratedCamera) -> str:
    offset, std = entry.clock_offset_s, entry.clock_offset_std_s
    if offset is None or std is None:
        return "–"
    return f"{1e3 * offset:+.3f} ± {1e3 * HALF_WIDTH_95 * std:.3f}"


def _checks(checks: Checks | None) -> list[dict[str, str]]:
    if checks is None:
        return []
    sizes = (
        ("known lengths on the board, rms", checks.length_rms_m),
        ("two halves of the footage apart, rms", checks.halves_rms_m),
        ("worst position std in the working volume", checks.volume_std_m),
        ("surveyed points, rms", checks.survey_rms_m),
    )
    return [
        {"check": what, "mm": number(1e3 * value)} for what, value in sizes if value is not None
    ]


def _run(entry: TrackedRun) -> dict[str, str]:
    known, samples = ("–" if n is None else n for n in (entry.known, entry.samples))
    return {
        "run": entry.run,
        "samples": f"{known} of {samples}",
        "reprojection (px)": number(entry.reprojection_px),
        "cameras apart (mm)": number(entry.consistency_mm),
        "position std (mm)": number(entry.position_std_mm, 2),
        "rotation std (mrad)": number(entry.rotation_std_mrad, 2),
    }


def _effect(entry: FoundEffect) -> dict[str, str]:
    values = ", ".join(
        f"{plain(one.name)} {number(one.value, 3)} "
        f"± {number(None if one.std is None else HALF_WIDTH_95 * one.std, 1)}"
        for one in entry.parameters
    )
    apart = [number(one and one.consistency_mm) for one in (entry.before, entry.after)]
    return {
        "run": entry.run,
        "camera": entry.camera,
        "corrected": plain(entry.effect),
        "by (± 95 %)": values,
        "cameras apart (mm)": " → ".join(apart),
    }


def _agreement(runs: tuple[TrackedRun, ...]) -> object:
    """Millimetres between each camera's ray and the platform that all agree on, by run."""
    names = list(dict.fromkeys(one.camera for run in runs for one in run.cameras))
    if not names:
        return ""

    def draw(sheet: Figure) -> None:
        axes = sheet.subplots()
        width = 0.8 / len(names)
        for index, name in enumerate(names):
            heights = [_consistency(run, name) for run in runs]
            places = np.arange(len(runs)) - 0.4 + (index + 0.5) * width
            colour, hatch = SERIES[index % len(SERIES)], HATCHES[index % len(HATCHES)]
            filled = "none" if hatch else colour
            axes.bar(
                places,
                heights,
                width=width,
                facecolor=filled,
                edgecolor=colour,
                hatch=hatch,
                label=name,
            )
        axes.set_xticks(range(len(runs)), [run.run for run in runs], rotation=60)
        axes.set_ylabel("mm")
        sheet.legend(loc="outside upper left", ncols=min(len(names), 4), fontsize=8)

    caption = "How far each camera's view lies from the platform that all cameras agree on."
    return figure(draw, 4.6, 2.6, caption)


def _consistency(run: TrackedRun, name: str) -> float:
    found = [one.consistency_mm for one in run.cameras if one.camera == name]
    return float("nan") if not found or found[0] is None else found[0]


def _rig(
    cameras: tuple[CalibratedCamera, ...],
    swings: tuple[SwingPlace, ...],
    entries: tuple[Numbers, ...],
) -> object:
    placed = [one for one in cameras if one.q_camera_base and one.t_camera_base_m]
    if not placed:
        return ""

    def draw(sheet: Figure) -> None:
        axes: Any = sheet.add_subplot(projection="3d")
        for camera in placed:
            _draw_camera(axes, camera)
        if entries:
            axes.plot(*np.array(entries).T, "^", color=INK, ms=5, label="pulleys")
        places = [one.equilibrium.position_m for one in swings if one.equilibrium]
        if places:
            axes.plot(*np.array(places).T, "o", color=BEFORE, ms=4, label="platform")
        axes.set_xlabel("x (m)")
        axes.set_ylabel("y (m)")
        axes.set_zlabel("z (m)")
        axes.locator_params(axis="z", nbins=4)
        axes.set_aspect("equal")
        axes.set_box_aspect(None, zoom=0.85)
        if entries or places:
            axes.legend(fontsize=8)

    caption = "The rig in the base frame: cameras, pulleys, rest poses."
    return figure(draw, 4.6, 3.8, caption)


def _draw_camera(axes: Any, camera: CalibratedCamera) -> None:
    rotation = matrix_from_quaternion(np.array(camera.q_camera_base, dtype=np.float64))
    centre = -rotation.T @ np.array(camera.t_camera_base_m, dtype=np.float64)
    corners = np.array([[-0.4, -0.3, 1], [0.4, -0.3, 1], [0.4, 0.3, 1], [-0.4, 0.3, 1]])
    corners = centre + FRUSTUM_M * corners @ rotation
    for k in range(4):
        line = np.array([centre, corners[k], corners[(k + 1) % 4]])
        axes.plot(*line.T, color=AFTER, lw=0.9)
    axes.text(*centre, camera.name, fontsize=8)


def _largest(values: Numbers) -> float | None:
    """Half the 95 % interval of the largest of some deviations, in thousandths."""
    numbers = [value for value in values if value is not None]
    return 1e3 * HALF_WIDTH_95 * max(numbers) if numbers else None
