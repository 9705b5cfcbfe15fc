"""The verdict: may this calibration be used, and if not, what has to be filmed again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from freeswing.calib.board.coverage import coverage_of
from freeswing.calib.camera.lens_models import PARAMETER_NAMES
from freeswing.calib.rig.bundle_adjustment import named
from freeswing.calib.rig.reprojection import board_size, camera_slices
from freeswing.calib.rig.solve_rig import Rig
from freeswing.calib.verdict.halves_and_lengths import TruthChecks
from freeswing.calib.verdict.limits_of_use import (
    CameraNumbers,
    Finding,
    RigNumbers,
    camera_findings,
    rig_findings,
)
from freeswing.calib.verdict.survey_check import SurveyCheck


@dataclass(frozen=True, slots=True)
class Verdict:
    """Reasons against use (empty = usable), warnings, and the numbers behind them."""

    reasons: tuple[str, ...]
    warnings: tuple[str, ...]
    checks: dict[str, Any]
    by_camera: tuple[dict[str, Any], ...]

    @property
    def usable(self) -> bool:
        """Whether the calibration may be used."""
        return not self.reasons


def judge(
    rig: Rig, truth: TruthChecks, survey: SurveyCheck | None, alone_px: np.ndarray
) -> Verdict:
    """Weigh everything that is known about a calibration.

    Args:
        rig: the solution.
        truth: held-out views, lengths and halves.
        survey: base tags against the rig, None without.
        alone_px: what each camera reached on its own, each axis, (n_cameras,).
    """
    said: list[Finding] = []
    by_camera = []
    for index in range(len(rig.cameras)):
        numbers = camera_numbers(rig, index, truth, alone_px)
        said += camera_findings(numbers)
        by_camera.append(
            {
                "held_out_px": numbers.held_out_px,
                "alone_px": numbers.alone_px,
                "coverage": numbers.filled,
                "tilt_deg": numbers.tilt_deg,
                "focal_std": numbers.focal_std,
            }
        )
    said += rig_findings(rig_numbers(rig, truth))
    reasons = [one.text for one in said if one.refuses] + list(survey.reasons if survey else ())
    warnings = [one.text for one in said if not one.refuses]
    checks = {
        "length_bias": truth.length_bias,
        "length_rms_m": truth.length_rms_m,
        "lengths": truth.n_lengths,
        "halves_rms_m": truth.halves_rms_m,
        "halves_shape_rms_m": truth.halves_shape_rms_m,
        "volume_std_m": truth.volume_std_m,
        "volume_size_m": truth.volume_size_m.tolist(),
    }
    if survey:
        checks |= {
            "survey_points": survey.n_points,
            "survey_scale": survey.scale,
            "survey_rms_m": survey.rms_m,
            "survey_mirrored_rms_m": survey.mirrored_rms_m,
        }
    return Verdict(tuple(reasons), tuple(warnings), checks, tuple(by_camera))


def camera_numbers(rig: Rig, index: int, truth: TruthChecks, alone_px: np.ndarray) -> CameraNumbers:
    """What is known of one camera of a solution."""
    camera = rig.cameras[index]
    scene, views = rig.adjustment.scene, rig.problem.views
    board = np.asarray(views.seen[:, : board_size(rig.problem.board_points_m)].any(axis=1))
    views = views.select(board)
    coverage = coverage_of(camera, index, views, scene.T_base_boards)
    labels = (f"{camera.name}/", f"{camera.name}.")
    return CameraNumbers(
        name=camera.name,
        model=camera.model,
        views=int((views.camera == index).sum()),
        dropped=sum(drop.label.startswith(labels) for drop in rig.dropped),
        tilt_deg=coverage.tilt_deg,
        filled=coverage.filled,
        empty=coverage.empty,
        focal_std=_focal_std(rig, index),
        sigma_px=float(rig.adjustment.sigma_px[index]),
        held_out_px=float(truth.held_out_px[index]),
        alone_px=float(alone_px[index]),
        among=len(rig.cameras),
    )


def rig_numbers(rig: Rig, truth: TruthChecks) -> RigNumbers:
    """What is known of all cameras together."""
    result, unknowns = rig.adjustment, int(rig.problem.free.sum())
    weakest = ""
    if result.rank < unknowns:
        weakest = named(result.scene)[int(np.argmax(np.abs(result.weakest)))]
    return RigNumbers(
        cameras=len(rig.cameras),
        unknowns=unknowns,
        rank=int(result.rank),
        weakest=weakest,
        length_bias=truth.length_bias,
        n_lengths=truth.n_lengths,
        halves_shape_rms_m=truth.halves_shape_rms_m,
        volume_std_m=truth.volume_std_m,
    )


def _focal_std(rig: Rig, index: int) -> float:
    """Largest relative standard deviation of the focal lengths."""
    camera = rig.cameras[index]
    own = camera_slices(rig.cameras)[index]
    count = 1 if PARAMETER_NAMES[camera.model][0] == "f" else 2
    std = np.sqrt(np.diag(rig.adjustment.covariance)[own][:count])
    return float(np.max(std / camera.params[:count]))
