"""Base tags against the board-scaled rig: mirrored, tilted, mis-scaled or mixed-up surveys."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import Array
from freeswing.calib.rig.triangulation import triangulate
from freeswing.calib.rig.views import FixedPoints

# A board's squares and a survey's tape err by 0.1 to 0.2 % each; 0.5 % is one of them read wrong.
SCALE_LIMIT = 0.005
# Surveys are good to 1 or 2 mm. 5 mm is a tag that was taken for another, turned, or moved.
TAG_LIMIT_M = 0.005
# Residual as a mirror image over that as it is: noise and one wrong tag spoil both alike.
MIRRORED = 0.3
# Four corners: one tag, as little as tells a mirror image from a turn.
LEAST_TRIANGULATED = 4


@dataclass(frozen=True, slots=True)
class SurveyCheck:
    """Surveyed corners beside the same corners triangulated by the rig alone.

    Attributes:
        n_points: corners seen by two or more cameras.
        scale: size of the survey over size in the rig, 1 when they agree; NaN when unknown.
        rms_m: residual of the best fit by a proper rotation and that scale.
        mirrored_rms_m: residual of the best fit by a mirror image.
        reasons: what is wrong with the survey, in words.
    """

    n_points: int
    scale: float
    rms_m: float
    mirrored_rms_m: float
    reasons: tuple[str, ...]


def check_survey(cameras: tuple[Camera, ...], fixed: FixedPoints) -> SurveyCheck:
    """Compare the survey with the rig as the board alone made it (before tags took part)."""
    pixels = np.full((len(cameras), len(fixed.points_base_m), 2), np.nan)
    pixels[fixed.camera, fixed.point] = fixed.pixels
    points = triangulate(cameras, pixels)
    good = np.isfinite(points[:, 0])
    if good.sum() < LEAST_TRIANGULATED:
        return SurveyCheck(int(good.sum()), np.nan, np.nan, np.nan, ())
    survey, seen = fixed.points_base_m[good], points[good]
    residual, scale = _fit(survey, seen, mirror=False)
    mirrored, _ = _fit(survey, seen, mirror=True)
    rms, mirrored_rms = rms_distance(residual), rms_distance(mirrored)
    names = np.array(fixed.names)[good]
    reasons: list[str] = []
    if mirrored_rms < MIRRORED * rms and rms > TAG_LIMIT_M:
        reasons.append(
            f"the surveyed base tags are a mirror image of what the cameras see (rigid fit "
            f"{1e3 * rms:.1f} mm, mirrored {1e3 * mirrored_rms:.1f} mm): the survey's axes are "
            "left-handed, or one axis has the wrong sign"
        )
    elif abs(scale - 1.0) > SCALE_LIMIT and rms < TAG_LIMIT_M:
        reasons.append(
            f"the survey is {scale:.4f} times as large as the board says: measure the board's "
            "squares and the tags' corners again, one of them is wrong"
        )
    else:
        reasons += _wrong_tags(names, survey, seen)
    return SurveyCheck(int(good.sum()), float(scale), rms, mirrored_rms, tuple(reasons))


def _fit(survey: Array, seen: Array, *, mirror: bool) -> tuple[Array, float]:
    """Residuals (n, 3) of the scaled rigid fit of seen points onto the survey, and the scale."""
    a, b = seen - seen.mean(axis=0), survey - survey.mean(axis=0)
    left, _, right = np.linalg.svd(a.T @ b)
    sign = np.sign(np.linalg.det(left @ right)) * (-1.0 if mirror else 1.0)
    fitted = a @ (left @ np.diag([1.0, 1.0, sign]) @ right)
    scale = float(np.sum(fitted * b) / np.sum(fitted * fitted))
    return b - scale * fitted, scale


def _wrong_tags(names: np.ndarray, survey: Array, seen: Array) -> list[str]:
    """Tags that do not lie where the others say, by leaving each out in turn."""
    tags = np.array([name.rpartition(" ")[0] for name in names])
    reasons = []
    for tag in dict.fromkeys(tags.tolist()):
        own = tags == tag
        others = ~own
        base = own if others.sum() < LEAST_TRIANGULATED else others
        moved = _placed(seen, survey[base], seen[base])
        error = rms_distance(moved[own] - survey[own])
        if error <= TAG_LIMIT_M or (
            base is others and rms_distance(moved[base] - survey[base]) > error
        ):
            continue
        hint = _order_hint(moved, survey, own)
        reasons.append(f"base tag {tag} lies {1e3 * error:.1f} mm from its survey{hint}")
    if len(reasons) > 1:
        worst = max(reasons, key=lambda text: float(text.split(" lies ")[1].split(" mm")[0]))
        return [worst + "; others disagree too: check the survey's axes, order and units"]
    return reasons


def _placed(points: Array, survey: Array, seen: Array) -> Array:
    """Points of the rig in the survey's frame, by the rigid fit of seen onto survey."""
    a, b = seen - seen.mean(axis=0), survey - survey.mean(axis=0)
    left, _, right = np.linalg.svd(a.T @ b)
    turn = left @ np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))]) @ right
    return (points - seen.mean(axis=0)) @ turn + survey.mean(axis=0)


def _order_hint(moved: Array, survey: Array, own: np.ndarray) -> str:
    """Says when another order of the four corners would fit."""
    a, b = moved[own], survey[own]
    if len(a) != 4:
        return ": survey it again"
    for shift in (1, 2, 3):
        if rms_distance(np.roll(a, shift, axis=0) - b) < TAG_LIMIT_M:
            return f": its corners are listed {90 * shift} degrees turned; the order is TL TR BR BL"
    for shift in range(4):
        if rms_distance(np.roll(a[::-1], shift, axis=0) - b) < TAG_LIMIT_M:
            return ": its corners run the wrong way round; the order is TL TR BR BL"
    return ": survey it again"


def rms_distance(residuals: Array) -> float:
    """Root mean square length of vectors (.., 3)."""
    return float(np.sqrt(np.mean(np.sum(residuals**2, axis=-1))))
