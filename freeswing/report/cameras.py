"""Panel: the cameras. Calibration, how they agree on the platform, the rig in space."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from freeswing.cdpr.rotation import matrix_from_quaternion
from freeswing.report.figures import AFTER, BEFORE, INK, SERIES, figure
from freeswing.report.material import Document, Material
from freeswing.report.words import number, plain

FRUSTUM_M = 0.35


class Cameras:
    """How well the cameras are known, and how well they agree on where the platform is."""

    name = "cameras"
    title = "The cameras"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Calibration by camera, tracking by run, what was corrected, and the rig."""
        calibration, tracking = material.calibration, material.tracking
        if not calibration and not tracking:
            return None
        cameras = list(calibration.get("cameras") or [])
        runs = list(tracking.get("runs") or [])
        verdict = calibration.get("verdict") or {}
        swings = material.identification.get("swings") or []
        entries = material.identification.get("entries_m") or []
        return {
            "cameras": [_camera(entry) for entry in cameras],
            "warnings": [*(verdict.get("reasons") or []), *(verdict.get("warnings") or [])],
            "checks": _checks(calibration.get("checks") or {}),
            "runs": [_run(entry) for entry in runs],
            "effects": [_effect(entry) for entry in tracking.get("effects") or []],
            "agreement": _agreement(runs),
            "rig": _rig(cameras, swings, entries),
        }


def _camera(entry: Document) -> dict[str, str]:
    return {
        "camera": str(entry.get("name", "")),
        "board seen": f"{entry.get('frames_with_board', '–')} of {entry.get('frames', '–')} frames",
        "field covered": _percent(entry.get("coverage")),
        "reprojection (px)": number(entry.get("reprojection_px")),
        "on unused views (px)": number(entry.get("held_out_px")),
        "position std (mm)": number(_largest(entry.get("position_std_m")), 2),
        "rotation std (mrad)": number(_largest(entry.get("rotation_std_rad")), 2),
        "clock (ms)": _clock(entry),
    }


def _clock(entry: Document) -> str:
    offset, std = entry.get("clock_offset_s"), entry.get("clock_offset_std_s")
    if not isinstance(offset, int | float) or not isinstance(std, int | float):
        return "–"
    return f"{1e3 * offset:+.3f} ± {1.96e3 * std:.3f}"


def _checks(checks: Document) -> list[tuple[str, str]]:
    names = (
        ("length_rms_m", "known lengths on the board, rms", 1e3, "mm"),
        ("halves_rms_m", "two halves of the footage apart, rms", 1e3, "mm"),
        ("volume_std_m", "worst position std in the working volume", 1e3, "mm"),
        ("survey_rms_m", "surveyed points, rms", 1e3, "mm"),
    )
    return [
        (what, f"{number(scale * checks[key])} {unit}")
        for key, what, scale, unit in names
        if isinstance(checks.get(key), int | float)
    ]


def _run(entry: Document) -> dict[str, str]:
    return {
        "run": str(entry.get("run", "")),
        "samples": f"{entry.get('known', '–')} of {entry.get('samples', '–')}",
        "reprojection (px)": number(entry.get("reprojection_px")),
        "cameras apart (mm)": number(entry.get("consistency_mm")),
        "position std (mm)": number(entry.get("position_std_mm"), 2),
        "rotation std (mrad)": number(entry.get("rotation_std_mrad"), 2),
    }


def _effect(entry: Document) -> dict[str, str]:
    parameters = entry.get("parameters") or []
    values = ", ".join(
        f"{plain(str(p['name']))} {number(p.get('value'), 3)} ± {number(p.get('std'), 1)}"
        for p in parameters
    )
    before, after = entry.get("before") or {}, entry.get("after") or {}
    return {
        "run": str(entry.get("run", "")),
        "camera": str(entry.get("camera", "")),
        "corrected": plain(str(entry.get("effect", ""))),
        "by": values,
        "cameras apart (mm)": f"{number(before.get('consistency_mm'))} → "
        f"{number(after.get('consistency_mm'))}",
    }


def _agreement(runs: list[Document]) -> object:
    """Millimetres between each camera's ray and the platform that all agree on, by run."""
    names = list(dict.fromkeys(str(c["camera"]) for run in runs for c in run.get("cameras") or []))
    if not names:
        return ""

    def draw(sheet: Figure) -> None:
        axes = sheet.subplots()
        width = 0.8 / len(names)
        for index, name in enumerate(names):
            heights = [_camera_value(run, name, "consistency_mm") for run in runs]
            places = np.arange(len(runs)) - 0.4 + (index + 0.5) * width
            colour = SERIES[index % len(SERIES)]
            axes.bar(places, heights, width=width, color=colour, label=name)
        labels = [str(run.get("run", "")) for run in runs]
        axes.set_xticks(range(len(runs)), labels, rotation=60 if len(runs) > 6 else 0)
        axes.set_ylabel("mm")
        axes.legend(ncols=min(len(names), 8), fontsize=8)

    caption = "How far each camera's view lies from the platform that all cameras agree on."
    return figure(draw, 7.0, 2.6, caption)


def _camera_value(run: Document, name: str, key: str) -> float:
    found = [c.get(key) for c in run.get("cameras") or [] if str(c["camera"]) == name]
    value = found[0] if found else None
    return float(value) if isinstance(value, int | float) else float("nan")


def _rig(cameras: list[Document], swings: list[Document], entries: list[list[float]]) -> object:
    placed = [c for c in cameras if c.get("q_camera_base") and c.get("t_camera_base_m")]
    if not placed:
        return ""

    def draw(sheet: Figure) -> None:
        axes: Any = sheet.add_subplot(projection="3d")
        for camera in placed:
            _draw_camera(axes, camera)
        if entries:
            axes.plot(*np.array(entries).T, "^", color=INK, ms=5, label="pulleys")
        places = [s["equilibrium"]["position_m"] for s in swings if s.get("equilibrium")]
        if places:
            axes.plot(*np.array(places).T, "o", color=BEFORE, ms=4, label="platform")
        axes.set_xlabel("x (m)")
        axes.set_ylabel("y (m)")
        axes.set_zlabel("z (m)")
        axes.locator_params(axis="z", nbins=4)
        axes.set_aspect("equal")
        if entries or places:
            axes.legend(fontsize=8)

    return figure(draw, 6.4, 4.8, "The rig in the base frame: cameras, pulleys, rest poses.")


def _draw_camera(axes: Any, camera: Document) -> None:
    rotation = matrix_from_quaternion(np.array(camera["q_camera_base"], dtype=np.float64))
    centre = -rotation.T @ np.array(camera["t_camera_base_m"], dtype=np.float64)
    corners = np.array([[-0.4, -0.3, 1], [0.4, -0.3, 1], [0.4, 0.3, 1], [-0.4, 0.3, 1]])
    corners = centre + FRUSTUM_M * corners @ rotation
    for k in range(4):
        line = np.array([centre, corners[k], corners[(k + 1) % 4]])
        axes.plot(*line.T, color=AFTER, lw=0.9)
    axes.text(*centre, str(camera.get("name", "")), fontsize=8)


def _largest(values: object) -> float | None:
    """The largest of a list of metres or radians, in thousandths."""
    numbers = [v for v in values if isinstance(v, int | float)] if isinstance(values, list) else []
    return 1e3 * max(numbers) if numbers else None


def _percent(value: object) -> str:
    return f"{100 * value:.0f} %" if isinstance(value, int | float) else "–"
