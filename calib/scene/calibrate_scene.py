"""Cameras that share no view: tied by the features of the laboratory, placed by a survey."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from freeswing.calib.calibrate import CalibrationResult
from freeswing.calib.rig.solve_rig import Rig
from freeswing.calib.rig.views import FixedPoints
from freeswing.calib.scene.clicked_points import (
    Click,
    clicked,
    read_clicks,
    surveyed_sightings,
)
from freeswing.calib.scene.frame_by_survey import placed_points, roughly_in_base, tied_to_survey
from freeswing.calib.scene.lab_map import LabMap, map_of
from freeswing.calib.scene.scale_by_distances import with_distances
from freeswing.calib.scene.scene_rig import rig_of_map, rig_part
from freeswing.calib.scene.scene_verdict import (
    SceneChecks,
    can_be_halved_by_size,
    check_scene,
    grown,
    growth_of,
    halves_of,
    judge_scene,
)
from freeswing.calib.scene.source import SceneSource
from freeswing.calib.scene.stills import Still, rig_stills, walk_stills
from freeswing.calib.scene.tape_measured import SurveyedPoint
from freeswing.calib.tags.base_tags import SurveyedTag
from freeswing.calib.verdict.calibration_result import FORMAT, camera_entries, covariance_entry
from freeswing.calib.verdict.survey_check import SurveyCheck, check_survey
from freeswing.cdpr.files.documents import DataError, InputError
from freeswing.cdpr.system.progress import Progress

KEPT_SCENE = ".scene"  # below the results


def calibrate_scene(
    source: SceneSource,
    base_tags: Sequence[SurveyedTag],
    kept: Path,
    *,
    model: str = "OPENCV",
    progress: Progress | None = None,
) -> CalibrationResult:
    """Calibrate a rig from images of the laboratory at rest.

    Args:
        source: the images, and what was measured.
        base_tags: surveyed tags.
        kept: folder where COLMAP's work is kept, so that a call that was killed goes on.
        model: lens model of all cameras.
        progress: told a label and the fraction done.

    Raises:
        InputError: unreadable images or marks, or nothing that gives a scale.
        DataError: naming the camera that could not be tied in, or what the survey lacks.
    """
    told = progress or _silent
    if not (base_tags or source.surveyed or source.distances):
        raise InputError(
            "[calibration]: nothing gives the laboratory its size: survey base tags "
            "([[calibration.base_tags]]) or points ([[calibration.scene.surveyed]]), or measure a "
            "distance of two points ([[calibration.scene.distances]])"
        )
    told("reading images", 0.0)
    rig = rig_stills(source.frames)
    stills = rig + (() if source.walk is None else walk_stills(source.walk))
    names = [still.name for still in stills]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(f"{source.walk}: image {twice} has the name of another; rename it")
    clicks = _clicks(source, names)
    found = map_of(stills, model, kept, lambda label, share: told(label, 0.02 + 0.68 * share))
    refuse_untied(found, stills)
    told("adjusting", 0.7)
    free = rig_of_map(found, stills, model)
    count = len(rig)
    halves = halves_of(free, count)
    unknown = rig_part(free, count).problem.free
    growth = growth_of(*halves, unknown)
    if can_be_halved_by_size(free, count):
        growth = max(growth, growth_of(*halves_of(free, count, by_size=True), unknown))
    told("survey", 0.85)
    whole, survey = _in_metres(free, source, base_tags, {s.name: s for s in stills}, clicks)
    part = rig_part(grown(whole, growth), count)
    told("checking", 0.95)
    checks = check_scene(part, halves, growth)
    said = judge_scene(part, checks)
    reasons = [one.text for one in said if one.refuses] + list(survey.reasons if survey else ())
    warnings = [one.text for one in said if not one.refuses] + _warnings(part, found, stills)
    document = _document(part, checks, survey, reasons, warnings)
    told("calibrated", 1.0)
    why = "; ".join(["the calibration must not be used", *reasons])
    return CalibrationResult(part.cameras, document, part, why if reasons else None)


def _clicks(source: SceneSource, names: list[str]) -> tuple[Click, ...]:
    points = [point.name for point in source.surveyed]
    points += [end for one in source.distances for end in one.between if end not in points]
    if source.clicks is None:
        if points:
            raise InputError(
                "[calibration.scene]: clicks: missing; it names the table in which "
                f"{', '.join(points[:6])} are marked (image,point,u_px,v_px)"
            )
        return ()
    return read_clicks(source.clicks, names, points)


def refuse_untied(found: LabMap, stills: Sequence[Still]) -> None:
    """Cameras of the rig that share too little with the map are named.

    Raises:
        DataError: with the image that each shares most features with.
    """
    lost = [k for k, s in enumerate(stills) if not s.walk and not found.tied[k]]
    if not lost:
        return
    sentences = []
    for k in lost:
        best = int(np.argmax(found.shared[k]))
        sentences.append(
            f"camera {stills[k].name} could not be tied in: of {len(stills)} images it shares most "
            f"with {stills[best].file}, {found.shared[k, best]:.0f} features"
        )
    raise DataError(
        "; ".join(sentences)
        + "; walk with the hand-held camera from what that camera sees to what the others see, in "
        "steps of half a metre and 15 degrees, and put posters on bare walls"
    )


def _in_metres(
    rig: Rig,
    source: SceneSource,
    base_tags: Sequence[SurveyedTag],
    stills: dict[str, Still],
    clicks: tuple[Click, ...],
) -> tuple[Rig, SurveyCheck | None]:
    """The rig by the survey, or where there is none by its distances alone."""
    sigma = rig.adjustment.sigma_px
    if base_tags or source.surveyed:
        fixed = surveyed_sightings(rig.cameras, stills, sigma, base_tags, source.surveyed, clicks)
        fixed = _placed_only(rig, fixed)
        rig = roughly_in_base(rig, fixed)
        survey = check_survey(rig.cameras, fixed)
        return (rig if survey.reasons else tied_to_survey(rig, fixed)), survey
    ends = tuple(dict.fromkeys(end for one in source.distances for end in one.between))
    marks = [SurveyedPoint(name, np.zeros(3)) for name in ends]
    return with_distances(rig, clicked(rig.cameras, sigma, marks, clicks), source.distances), None


def _placed_only(rig: Rig, fixed: FixedPoints) -> FixedPoints:
    """The survey without the points that fewer than two images show."""
    keep = np.isfinite(placed_points(rig, fixed)[:, 0])
    number = np.cumsum(keep) - 1
    seen = keep[fixed.point]
    return FixedPoints(
        tuple(name for name, ok in zip(fixed.names, keep, strict=True) if ok),
        fixed.points_base_m[keep],
        fixed.std_m[keep],
        fixed.camera[seen],
        number[fixed.point[seen]],
        fixed.pixels[seen],
        fixed.std_scale[seen],
    )


def _warnings(rig: Rig, found: LabMap, stills: Sequence[Still]) -> list[str]:
    said = [
        "clocks are not calibrated by a laboratory at rest: they are taken to agree here, and "
        "`track` measures them from the swing"
    ]
    lost = [s.name for s, tied in zip(stills, found.tied, strict=True) if s.walk and not tied]
    if lost:
        said.append(
            f"{len(lost)} images of the walk show too little that others show and are left out: "
            + ", ".join(lost[:6])
        )
    if rig.problem.fixed is None or not _surveyed(rig):
        said.append(
            f"no survey: camera {rig.cameras[0].name} is the base frame, so gravity and cable "
            "anchors in robot.toml do not fit it; survey tags or points on the frame"
        )
    return said


def _surveyed(rig: Rig) -> bool:
    """Whether the base frame is a survey's, and not the first camera's own."""
    return not np.allclose(rig.cameras[0].T_camera_base, np.eye(4))


def _document(
    rig: Rig,
    checks: SceneChecks,
    survey: SurveyCheck | None,
    reasons: list[str],
    warnings: list[str],
) -> dict[str, Any]:
    entries = camera_entries(rig)
    for k, entry in enumerate(entries):
        entry["frames"] = 1
        entry["coverage"] = float(checks.filled[k])
    fixed, adjustment = rig.problem.fixed, rig.adjustment
    base: dict[str, Any] = {"source": f"camera {rig.cameras[0].name}"}
    if fixed is not None and survey is not None:
        base = {
            "source": "survey",
            "tags": list(dict.fromkeys(name.rpartition(" ")[0] for name in fixed.names)),
            "survey_std_m": float(fixed.std_m.mean()),
        }
    return {
        "format": FORMAT,
        "verdict": {"usable": not reasons, "reasons": reasons, "warnings": warnings},
        "base_frame": base,
        "cameras": entries,
        "checks": {
            "halves_shape_rms_m": checks.halves_shape_rms_m,
            "volume_std_m": checks.volume_std_m,
            "volume_size_m": checks.volume_size_m.tolist(),
            "deviations_grown": checks.growth,
            **({} if survey is None else _survey_entry(survey)),
        },
        "moments": 1,
        "board": {"kind": "scene", "points": len(adjustment.scene.T_base_boards)},
        "dropped_views": [],
        "trimmed_corners": rig.n_trimmed,
        "adjustment": {
            "stop": adjustment.stop,
            "iterations": adjustment.iterations,
            "unknowns": int(rig.problem.free.sum()),
            "rank": adjustment.rank,
            "condition": adjustment.condition,
        },
        "covariance": covariance_entry(rig),
    }


def _survey_entry(survey: SurveyCheck) -> dict[str, Any]:
    return {
        "survey_points": survey.n_points,
        "survey_scale": survey.scale,
        "survey_rms_m": survey.rms_m,
        "survey_mirrored_rms_m": survey.mirrored_rms_m,
    }


def _silent(label: str, share: float) -> None:
    """Tells nobody."""
