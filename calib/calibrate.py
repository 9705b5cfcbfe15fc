"""The whole calibration: recordings in, cameras and the content of calibration.json out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from freeswing.calib.board.board_unlike_seen import settled_board
from freeswing.calib.board.declared_board import Board, board_from
from freeswing.calib.board.recordings import find_recordings
from freeswing.calib.board.sightings import Sightings, gather, see_boards
from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.intrinsics import CameraStart
from freeswing.calib.camera.lens_choice import lens_warnings, weigh_lenses
from freeswing.calib.camera.lens_models import Array
from freeswing.calib.remarks import (
    marker_said,
    moved_warnings,
    no_base_warning,
    rig_warnings,
)
from freeswing.calib.rig.coarse_clocks import board_moves, coarse_clocks
from freeswing.calib.rig.reprojection_kernels import WARP
from freeswing.calib.rig.solve_rig import Rig, solve_rig, start_cameras, tie_to_base
from freeswing.calib.rig.tie_by_shared_boards import BaseTie, base_tie, board_groups
from freeswing.calib.rig.tie_by_swings import Joined, SwingFilms, joined
from freeswing.calib.rig.views import Views
from freeswing.calib.scene.clicked_points import Click, read_clicks
from freeswing.calib.scene.survey import Survey
from freeswing.calib.scene.tape_measured import SurveyedPoint
from freeswing.calib.tags.base_tags import CORNER_NAMES, SURVEY_STD_M, SurveyedTag
from freeswing.calib.tags.tag_bend import straightened
from freeswing.calib.verdict.calibration_result import (
    FORMAT,
    camera_covariance,
    camera_entries,
    covariance_entry,
)
from freeswing.calib.verdict.halves_and_lengths import check_truth, widened
from freeswing.calib.verdict.platform_layout import layout_entry
from freeswing.calib.verdict.plumb_line import StringView, find_vertical, vertical_entry
from freeswing.calib.verdict.plumb_line_file import read_plumb_line
from freeswing.calib.verdict.survey_check import SurveyCheck, check_survey
from freeswing.calib.verdict.verdict import Verdict, judge
from freeswing.cdpr.files.documents import DataError, InputError
from freeswing.cdpr.robot import STANDARD_GRAVITY_M_S2
from freeswing.cdpr.system.progress import Progress

DEFAULT_MODEL = "OPENCV"
KEPT_BOARDS = ".boards"  # below the results
_STILLS = 9


@dataclass(frozen=True, slots=True)
class CalibrationResult:
    """What `calibrate_session` gives.

    Attributes:
        cameras: the calibrated cameras.
        document: the content of results/calibration.json.
        rig: the adjustment behind it.
        refused: why it must not be used; the document explains it.
    """

    cameras: tuple[Camera, ...]
    document: dict[str, Any]
    rig: Rig
    refused: str | None = None


@dataclass(frozen=True, slots=True)
class PlumbLine:
    """Hanging strings, and the gravity that is held against them.

    Attributes:
        path: points clicked along them, see `calib.verdict.plumb_line_file`.
        gravity_m_s2: as declared, in the base frame, (3,).
    """

    path: Path | str
    gravity_m_s2: Sequence[float] | Array = (0.0, 0.0, -STANDARD_GRAVITY_M_S2)


@dataclass(frozen=True, slots=True)
class Aids:
    """What a calibration may use beside the board and the surveyed tags.

    Attributes:
        plumb_line: hanging strings, or None.
        swings: gives recordings of the platform, asked for where no board joins the cameras.
        surveyed: points whose places in the base frame were measured.
        points: table in which these are marked, columns camera, point, u_px, v_px (std_px).
    """

    plumb_line: PlumbLine | None = None
    swings: Callable[[], SwingFilms | None] | None = None
    surveyed: tuple[SurveyedPoint, ...] = ()
    points: Path | None = None


def calibrate_session(
    recordings: Path | str,
    board: Board | Mapping[str, object],
    base_tags: Sequence[SurveyedTag] = (),
    *,
    frame_rate_hz: float | None = None,
    kept_boards: Path | str | None = None,
    model: str = DEFAULT_MODEL,
    survey_std_m: float | None = None,
    beside: Aids | None = None,
    progress: Progress | None = None,
) -> CalibrationResult:
    """Calibrate cameras, clocks and base frame from recordings of a board.

    As `freeswing.commands.session.calibrate` calls it.

    Args:
        recordings: folder with `<camera>.mkv` (+ `<camera>.csv`) or `<camera>/*.png`.
        board: the board, or its table from session.toml.
        base_tags: surveyed tags (family, id, corners_base_m); without them the frame of one camera
            is the base and the result warns of it.
        frame_rate_hz: nominal rate, where no stamps were recorded.
        kept_boards: folder that keeps the boards found so far, from where a call that was killed
            goes on; None for none.
        model: lens model of every camera.
        survey_std_m: standard deviation of coordinates of tags that state none; measured from the
            fit when None.
        beside: hanging strings, swings and surveyed points, where there are any.
        progress: told a label and the fraction done.

    Raises:
        InputError: unreadable recordings or a board that makes no sense.
        DataError: the recordings give no calibration at all; one that is not to be trusted is
            returned as `refused`.
    """
    told, beside = progress or _silent, beside or Aids()
    board = board if isinstance(board, Board) else board_from(board)
    told("finding the board", 0.0)
    found = find_recordings(recordings)
    names = [recording.name for recording in found]
    strings = _strings(beside.plumb_line, names)
    clicks = _clicks(beside, names)
    std = SURVEY_STD_M if survey_std_m is None else survey_std_m
    given = Survey(tuple(base_tags), std, beside.surveyed, clicks)
    sightings = see_boards(
        found,
        board,
        frame_rate_hz,
        _STILLS if base_tags else 0,
        lambda label, share: told(label, 0.7 * share),
        None if kept_boards is None else Path(kept_boards),
    )
    told("adjusting", 0.7)
    board, said = settled_board(board, np.concatenate([s.pixels for s in sightings]))
    rig, alone_px = rig_from_sightings(sightings, board, frame_rate_hz, model, given, beside.swings)
    warnings = [text for text in (said, marker_said(board, rig)) if text is not None]
    survey: SurveyCheck | None = None
    if given:
        told("base frame", 0.8)
        rig, survey, moved = _tied(rig, sightings, given, measured=survey_std_m is None)
        warnings += moved
    else:
        warnings.append(no_base_warning(rig.cameras[rig.reference].name))
    told("checking against truth", 0.9)
    rig, truth = widened(rig, check_truth(rig, board.edges))
    verdict = judge(rig, truth, survey, alone_px)
    lenses = weigh_lenses(rig)
    warnings += [*rig_warnings(rig, truth.spread), *lens_warnings(rig.cameras, lenses)]
    verdict = replace(verdict, warnings=(*warnings, *verdict.warnings))
    verdict, vertical = _with_vertical(verdict, rig, strings, beside.plumb_line)
    document = {**_document(rig, board, sightings, verdict), **vertical, **_layout(rig)}
    for entry, choice in zip(document["cameras"], lenses, strict=True):
        entry["lens_models_held_out_px"] = choice.held_out_px
    told("calibrated", 1.0)
    why = "; ".join(["the calibration must not be used", *verdict.reasons])
    return CalibrationResult(rig.cameras, document, rig, None if verdict.usable else why)


def _tied(
    rig: Rig,
    sightings: tuple[Sightings, ...],
    given: Survey,
    *,
    measured: bool,
) -> tuple[Rig, SurveyCheck, list[str]]:
    """The rig in the survey's frame where that makes sense; and who moved."""
    seen = given.seen(rig.cameras, sightings, rig.adjustment.sigma_px)
    survey = check_survey(rig.cameras, seen.fixed)
    if not survey.reasons:
        rig = tie_to_base(rig, seen.fixed, given.unstated(measured))
    return rig, survey, moved_warnings(seen.moved)


def _clicks(beside: Aids, cameras: list[str]) -> tuple[Click, ...]:
    names = [point.name for point in beside.surveyed]
    if beside.points is not None:
        return read_clicks(beside.points, cameras, names, "camera")
    if names:
        raise InputError(
            f"[[calibration.surveyed]]: {', '.join(names[:6])}: nothing says where the cameras see "
            "them: mark them in points.csv beside the recordings (camera,point,u_px,v_px)"
        )
    return ()


def _strings(plumb_line: PlumbLine | None, names: Sequence[str]) -> tuple[StringView, ...]:
    return () if plumb_line is None else read_plumb_line(plumb_line.path, names)


def _with_vertical(
    verdict: Verdict, rig: Rig, strings: tuple[StringView, ...], plumb_line: PlumbLine | None
) -> tuple[Verdict, dict[str, Any]]:
    """The verdict with what strings say against the gravity, and `vertical` of the document."""
    if plumb_line is None or not strings or not verdict.usable:
        return verdict, {}
    gravity_m_s2 = np.asarray(plumb_line.gravity_m_s2, dtype=np.float64)
    found = find_vertical(rig.cameras, strings, camera_covariance(rig))
    vertical = vertical_entry(found, strings, gravity_m_s2)
    if vertical["verdict"] != "agrees":
        verdict = replace(verdict, warnings=(*verdict.warnings, vertical["sentence"]))
    return verdict, {"vertical": vertical}


def rig_from_sightings(
    sightings: tuple[Sightings, ...],
    board: Board,
    frame_rate_hz: float | None,
    model: str = DEFAULT_MODEL,
    survey: Survey | None = None,
    swings: Callable[[], SwingFilms | None] | None = None,
) -> tuple[Rig, Array]:
    """The rig in a frame of its own, and what each camera reached alone, px.

    Where cameras share no board the platform in the swings takes part, and what was surveyed, which
    then gives the frame.

    Raises:
        DataError: when a camera never sees the board or the sightings make no rig.
    """
    for camera in sightings:
        if len(camera.numbers) == 0:
            raise DataError(
                f"camera {camera.name}: the board was found in none of {camera.n_frames} frames; "
                "check the board's kind and numbers in session.toml, focus and light"
            )
    seen = gather(sightings, frame_rate_hz)
    starts = _starts(sightings, board, model, seen.views)
    offsets, unknown = np.zeros(len(sightings)), ()
    line = seen.line
    if line is not None and board_moves(seen.speed_px_s, seen.views.camera, len(sightings)):
        stamps = tuple(line.times_s[start.views.moment] + start.views.lag_s for start in starts)
        coarse = coarse_clocks(starts, stamps)
        offsets, unknown = coarse.offsets_s, coarse.unknown
        seen = gather(sightings, frame_rate_hz, offsets)
        line = seen.line
        starts = _starts(sightings, board, model, seen.views)
    else:
        line = None
    alone = np.array([start.rms_px for start in starts])
    borders = [camera.border_cells for camera in sightings]
    tie = _tie(sightings, starts, seen.views, survey or Survey())
    films = swings() if swings and board_groups(len(starts), seen.views).any() else None
    all_seen = Joined(board.points_m, starts, offsets, line, unknown)
    if films is not None:
        all_seen = joined(all_seen, films.tags, films.seen(sightings, frame_rate_hz), frame_rate_hz)
    tags = None if films is None else films.tags
    rig = solve_rig(
        all_seen.points_m,
        all_seen.starts,
        all_seen.offsets_s,
        all_seen.line,
        lambda scene, views: straightened(scene, views, board, borders, tags),
        tie,
        all_seen.layout_std_m,
    )
    guessed = tuple(sightings[k].name for k in all_seen.unknown)
    return replace(rig, guessed_clocks=guessed, platform=tags), alone


def _tie(
    sightings: tuple[Sightings, ...],
    starts: tuple[CameraStart, ...],
    views: Views,
    survey: Survey,
) -> BaseTie | None:
    """What was surveyed as each camera sees it, where boards alone do not join the cameras."""
    if not survey or not board_groups(len(starts), views).any():
        return None
    cameras = tuple(start.camera for start in starts)
    noise = np.array([start.rms_px for start in starts])
    return base_tie(cameras, survey.seen(cameras, sightings, noise).fixed)


def _starts(
    sightings: tuple[Sightings, ...], board: Board, model: str, views: Views
) -> tuple[CameraStart, ...]:
    names = tuple(camera.name for camera in sightings)
    sizes = tuple(camera.size_px for camera in sightings)
    return start_cameras(names, sizes, (model,) * len(names), board.points_m, views)


def _document(
    rig: Rig,
    board: Board,
    sightings: tuple[Sightings, ...],
    verdict: Verdict,
) -> dict[str, Any]:
    entries = camera_entries(rig)
    for entry, camera, judged in zip(entries, sightings, verdict.by_camera, strict=True):
        entry["frames"] = camera.n_frames
        entry["frames_with_board"] = len(camera.numbers)
        entry.update(judged)
    return {
        "format": FORMAT,
        "verdict": {
            "usable": verdict.usable,
            "reasons": list(verdict.reasons),
            "warnings": list(verdict.warnings),
        },
        "base_frame": _base_frame(rig),
        "cameras": entries,
        "checks": verdict.checks,
        "moments": len(np.unique(rig.problem.views.moment)),
        "board": {
            "kind": board.kind,
            "points": len(board.points_m),
            "warp_m": rig.adjustment.scene.warp_m[:WARP].tolist(),
        },
        "dropped_views": [str(drop) for drop in rig.dropped],
        "trimmed_corners": rig.n_trimmed,
        "adjustment": {
            "stop": rig.adjustment.stop,
            "iterations": rig.adjustment.iterations,
            "unknowns": int(rig.problem.free.sum()),
            "rank": rig.adjustment.rank,
            "condition": rig.adjustment.condition,
        },
        "covariance": covariance_entry(rig),
    }


def _layout(rig: Rig) -> dict[str, Any]:
    """`layout` of the document where the platform's tags tie the cameras."""
    entry = layout_entry(rig)
    return {} if entry is None else {"layout": entry}


def _base_frame(rig: Rig) -> dict[str, Any]:
    """Where the base frame comes from and how well it is held."""
    fixed = rig.problem.fixed
    if fixed is None:
        return {"source": f"camera {rig.cameras[rig.reference].name}"}
    tags = list(dict.fromkeys(name.rpartition(" ")[0] for name in fixed.names))
    residuals = rig.adjustment.fixed_residuals_px
    tagged = any(name.endswith(CORNER_NAMES) for name in fixed.names)
    return {
        "source": "base tags" if tagged else "survey",
        "tags": tags,
        "survey_std_m": float(np.sqrt(np.mean(fixed.std_m**2))),
        "reprojection_px": float(np.sqrt(np.mean(residuals**2))),
    }


def _silent(label: str, share: float) -> None:
    """Tells nobody."""
