"""The whole calibration: recordings in, cameras.toml and results/calibration.json out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from calib.base_tags import SURVEY_STD_M, SurveyedTag, find_base_tags
from calib.boards import Board, board_from
from calib.calibration_result import FORMAT, camera_entries, covariance_entry
from calib.camera import Camera
from calib.cameras_file import write_cameras
from calib.recordings import find_recordings
from calib.rig import Rig, solve_rig, start_cameras, tie_to_base
from calib.sightings import Sightings, gather, see_boards
from calib.views import FixedPoints
from cdpr.documents import DataError, write_json

Progress = Callable[[str, float], None]

DEFAULT_MODEL = "OPENCV"
_STILLS = 9


@dataclass(frozen=True, slots=True)
class CalibrationResult:
    """What `calibrate_session` gives.

    Attributes:
        cameras: the calibrated cameras.
        document: the content of results/calibration.json.
        rig: the adjustment behind it.
    """

    cameras: tuple[Camera, ...]
    document: dict[str, Any]
    rig: Rig


def calibrate_session(
    recordings: Path | str,
    board: Board | Mapping[str, object],
    base_tags: Sequence[SurveyedTag] = (),
    *,
    frame_rate_hz: float | None = None,
    cameras_path: Path | str | None = None,
    results_folder: Path | str | None = None,
    model: str = DEFAULT_MODEL,
    survey_std_m: float | None = None,
    progress: Progress | None = None,
) -> CalibrationResult:
    """Calibrate cameras, clocks and base frame from recordings of a board.

    From the command line, with a `Session` and its `calibration`::

        calibrate_session(
            calibration.recordings, calibration.board, calibration.base_tags,
            frame_rate_hz=session.frame_rate_hz, cameras_path=session.cameras,
            results_folder=session.results, progress=progress,
        )

    Args:
        recordings: folder with `<camera>.mkv` (+ `<camera>.csv`) or `<camera>/*.png`.
        board: the board, or its table from session.toml.
        base_tags: surveyed tags (family, id, corners_base_m); without them the frame of one camera
            is the base and the result warns of it.
        frame_rate_hz: nominal rate, where no stamps were recorded.
        cameras_path: cameras.toml to write, None for none.
        results_folder: takes calibration.json, None for none.
        model: lens model of every camera.
        survey_std_m: standard deviation of a surveyed coordinate; measured from the fit when None.
        progress: told a label and the fraction done.

    Raises:
        InputError: unreadable recordings or a board that makes no sense.
        DataError: the recordings cannot give a calibration to be trusted; calibration.json is
            still written where there is a result to explain, cameras.toml is left alone.
    """
    told = progress or _silent
    board = board if isinstance(board, Board) else board_from(board)
    told("finding the board", 0.0)
    found = find_recordings(recordings)
    sightings = see_boards(
        found,
        board,
        frame_rate_hz,
        _STILLS if base_tags else 0,
        lambda label, share: told(label, 0.7 * share),
    )
    told("adjusting", 0.7)
    rig, n_moments = _board_rig(sightings, board, frame_rate_hz, model)
    warnings: list[str] = []
    fixed: FixedPoints | None = None
    if base_tags:
        told("base tags", 0.8)
        stills = [camera.still_frames for camera in sightings]
        std = SURVEY_STD_M if survey_std_m is None else survey_std_m
        seen = find_base_tags(rig.cameras, stills, base_tags, rig.adjustment.sigma_px, std)
        warnings += [
            f"camera {name}: its base tags moved by {drift:.1f} px during the recording; "
            "fasten it and record again"
            for name, drift in seen.moved
        ]
        fixed = seen.fixed
        rig = tie_to_base(rig, fixed, estimate_survey=survey_std_m is None)
    else:
        reference = rig.cameras[rig.reference].name
        warnings.append(
            f"no base tags: camera {reference} is the base frame, so gravity and cable anchors in "
            "robot.toml do not fit it; survey tags on the frame and name them in session.toml"
        )
    document = _document(rig, board, sightings, warnings, n_moments)
    if results_folder is not None:
        write_json(Path(results_folder) / "calibration.json", document)
    if cameras_path is not None:
        write_cameras(cameras_path, rig.cameras)
    told("calibrated", 1.0)
    return CalibrationResult(rig.cameras, document, rig)


def _board_rig(
    sightings: tuple[Sightings, ...], board: Board, frame_rate_hz: float | None, model: str
) -> tuple[Rig, int]:
    for camera in sightings:
        if len(camera.numbers) == 0:
            raise DataError(
                f"camera {camera.name}: the board was found in none of {camera.n_frames} frames; "
                "check the board's kind and numbers in session.toml, focus and light"
            )
    views, times = gather(sightings, frame_rate_hz)
    starts = start_cameras(
        tuple(camera.name for camera in sightings),
        tuple(camera.size_px for camera in sightings),
        (model,) * len(sightings),
        board.points_m,
        views,
    )
    return solve_rig(board.points_m, starts), len(times)


def _document(
    rig: Rig,
    board: Board,
    sightings: tuple[Sightings, ...],
    warnings: list[str],
    n_moments: int,
) -> dict[str, Any]:
    entries = camera_entries(rig)
    for entry, camera in zip(entries, sightings, strict=True):
        entry["frames"] = camera.n_frames
        entry["frames_with_board"] = len(camera.numbers)
    return {
        "format": FORMAT,
        "verdict": {"usable": True, "reasons": [], "warnings": warnings},
        "cameras": entries,
        "moments": n_moments,
        "board": {
            "kind": board.kind,
            "points": len(board.points_m),
            "warp_m": rig.adjustment.scene.warp_m.tolist(),
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


def _silent(label: str, share: float) -> None:
    """Tells nobody."""
