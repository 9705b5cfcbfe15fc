"""The verdict: may this calibration be used, and if not, what has to be filmed again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from freeswing.calib.board.coverage import Coverage, coverage_of
from freeswing.calib.camera.lens_models import PARAMETER_NAMES
from freeswing.calib.rig.bundle_adjustment import named
from freeswing.calib.rig.reprojection import camera_slices
from freeswing.calib.rig.solve_rig import Rig
from freeswing.calib.verdict.survey_check import SurveyCheck
from freeswing.calib.verdict.truth_checks import TruthChecks

LEAST_VIEWS = 6
GOOD_VIEWS = 12
LEAST_TILT_DEG = 10.0
GOOD_TILT_DEG = 25.0
LEAST_FILLED = 0.12
GOOD_FILLED = 0.35
WORST_FOCAL_STD = 0.02
GOOD_FOCAL_STD = 0.003
WORST_PX = 3.0
WORST_HELD_OUT = 10.0
GOOD_HELD_OUT = 2.0
WORST_LENGTH_BIAS = 0.01
GOOD_LENGTH_BIAS = 0.002
WORST_VOLUME_M = 0.01
GOOD_VOLUME_M = 0.001
WORST_DROPPED = 0.5
WORST_RIG_OVER_ALONE = 4.0


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
    reasons: list[str] = []
    warnings: list[str] = []
    by_camera = []
    for index in range(len(rig.cameras)):
        coverage = coverage_of(
            rig.cameras[index], index, rig.problem.views, rig.adjustment.scene.T_base_boards
        )
        entry = _judge_camera(rig, index, coverage, truth, alone_px, reasons, warnings)
        by_camera.append(entry)
    _judge_rig(rig, truth, reasons, warnings)
    reasons += survey.reasons if survey else ()
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


def _judge_camera(
    rig: Rig,
    index: int,
    coverage: Coverage,
    truth: TruthChecks,
    alone_px: np.ndarray,
    reasons: list[str],
    warnings: list[str],
) -> dict[str, Any]:
    camera, result = rig.cameras[index], rig.adjustment
    name = f"camera {camera.name}"
    views = int((rig.problem.views.camera == index).sum())
    dropped = sum(
        drop.label.startswith((f"{camera.name}/", f"{camera.name}.")) for drop in rig.dropped
    )
    empty = f"; nothing seen {' and '.join(coverage.empty[:3])}" if coverage.empty else ""
    film = f"film the board all over this camera's image, tilted 20 to 40 degrees{empty}"
    _grade(
        views < LEAST_VIEWS, views < GOOD_VIEWS, reasons, warnings,
        f"{name}: {views} views of the board, want {GOOD_VIEWS} (least {LEAST_VIEWS}): {film}",
    )  # fmt: skip
    _grade(
        coverage.tilt_deg < LEAST_TILT_DEG, coverage.tilt_deg < GOOD_TILT_DEG, reasons, warnings,
        f"{name}: its views are alike, the board turned by {coverage.tilt_deg:.0f} degrees in all, "
        f"want {GOOD_TILT_DEG:.0f} (least {LEAST_TILT_DEG:.0f}): film it tilted left, right, up, "
        "down",
    )  # fmt: skip
    _grade(
        coverage.filled < LEAST_FILLED, coverage.filled < GOOD_FILLED, reasons, warnings,
        f"{name}: the board covered {100 * coverage.filled:.0f} % of the image, want "
        f"{100 * GOOD_FILLED:.0f} % (least {100 * LEAST_FILLED:.0f} %): {film}",
    )  # fmt: skip
    focal_std = _focal_std(rig, index)
    _grade(
        focal_std > WORST_FOCAL_STD, focal_std > GOOD_FOCAL_STD, reasons, warnings,
        f"{name}: focal length known to {100 * focal_std:.2g} %, want {100 * GOOD_FOCAL_STD:.2g} % "
        f"(worst {100 * WORST_FOCAL_STD:.2g} %): film the board closer and tilted more",
    )  # fmt: skip
    if result.sigma_px[index] > WORST_PX:
        reasons.append(
            f"{name}: corners lie {result.sigma_px[index]:.1f} px off, limit {WORST_PX} px: the "
            f"lens is no {camera.model}, the focus changed, or the board's numbers are wrong"
        )
    held_out = float(truth.held_out_px[index] / result.sigma_px[index])
    _grade(
        held_out > WORST_HELD_OUT, held_out > GOOD_HELD_OUT, reasons, warnings,
        f"{name}: error {truth.held_out_px[index]:.2f} px on views not used, "
        f"{held_out:.1f} times that of views used: film more views of more kinds",
    )  # fmt: skip
    if dropped > WORST_DROPPED * (dropped + views):
        reasons.append(f"{name}: {dropped} of {dropped + views} views had to be dropped")
    ratio = float(result.sigma_px[index] / max(alone_px[index], 0.05))
    if len(rig.cameras) > 1 and ratio > WORST_RIG_OVER_ALONE:
        reasons.append(
            f"{name}: fits itself to {alone_px[index]:.2f} px but the other cameras only to "
            f"{result.sigma_px[index]:.2f} px: the cameras are not simultaneous, or one moved; "
            "record with a common trigger, or hold the board still for each view"
        )
    return {
        "held_out_px": float(truth.held_out_px[index]),
        "alone_px": float(alone_px[index]),
        "coverage": coverage.filled,
        "tilt_deg": coverage.tilt_deg,
        "focal_std": focal_std,
    }


def _judge_rig(rig: Rig, truth: TruthChecks, reasons: list[str], warnings: list[str]) -> None:
    result = rig.adjustment
    unknowns = int(rig.problem.free.sum())
    if result.rank < unknowns:
        weakest = named(result.scene)[int(np.argmax(np.abs(result.weakest)))]
        reasons.append(
            f"{unknowns - result.rank} of {unknowns} unknowns cannot be found from these views "
            f"(first {weakest}): film the board where two cameras see it, and tilted"
        )
    bias = abs(truth.length_bias)
    _grade(
        bias > WORST_LENGTH_BIAS, bias > GOOD_LENGTH_BIAS, reasons, warnings,
        f"known lengths on the board come out {100 * truth.length_bias:+.2f} % "
        f"(limit {100 * WORST_LENGTH_BIAS:.0f} %): measure the board, or film more views",
    )  # fmt: skip
    if truth.n_lengths == 0 and len(rig.cameras) > 1:
        warnings.append(
            "too few moments with two cameras on the board to test half of the data on the other: "
            "film at least 8 common views a camera"
        )
    for value, what in (
        (truth.halves_shape_rms_m, "two halves of the recordings disagree by"),
        (truth.volume_std_m, "points where the board was are known to"),
    ):
        _grade(
            value > WORST_VOLUME_M, value > GOOD_VOLUME_M, reasons, warnings,
            f"{what} {1e3 * value:.2f} mm, want {1e3 * GOOD_VOLUME_M:.0f} mm (worst "
            f"{1e3 * WORST_VOLUME_M:.0f} mm): film more views that several cameras share",
        )  # fmt: skip


def _focal_std(rig: Rig, index: int) -> float:
    """Largest relative standard deviation of the focal lengths."""
    camera = rig.cameras[index]
    own = camera_slices(rig.cameras)[index]
    count = 1 if PARAMETER_NAMES[camera.model][0] == "f" else 2
    std = np.sqrt(np.diag(rig.adjustment.covariance)[own][:count])
    return float(np.max(std / camera.params[:count]))


def _grade(bad: bool, poor: bool, reasons: list[str], warnings: list[str], text: str) -> None:
    if bad:
        reasons.append(text)
    elif poor:
        warnings.append(text)
