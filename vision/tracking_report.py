"""tracking.json: frames, agreement and effects of each run and camera."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from freeswing.cdpr.measured.pose_errors import PoseErrors
from freeswing.vision.fuse.calibration_share import common_errors
from freeswing.vision.fuse.fuse_cameras import Fit
from freeswing.vision.fuse.tag_layout import LayoutChange
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.track_run import RunTrack


def tracking_document(
    tracks: Sequence[RunTrack], watch: Watch, change: LayoutChange, *, refined: bool
) -> dict[str, Any]:
    """The document of `results/tracking.json`.

    Agreement is the root mean square reprojection in pixels, and the distance in millimetres at
    which a camera's mean ray passes the platform that all cameras agree on. `position_std_mm`
    is the scatter of single poses, as in the track; `calibration_std_mm` is how far the
    calibration's own uncertainty may shift all of them together (null when it is not known),
    and `calibration_errors` how: see `cdpr.measured.pose_errors.PoseErrors`.
    """
    errors = common_errors([track.calibration for track in tracks])
    runs = [_run(track, watch, own) for track, own in zip(tracks, errors, strict=True)]
    return {
        "format": "freeswing-tracking/1",
        "runs": runs,
        "layout": _layout(watch, change, refined=refined),
        "effects": [entry for track in tracks for entry in _effects(track)],
    }


def _layout(watch: Watch, change: LayoutChange, *, refined: bool) -> dict[str, Any]:
    """How far each tag sits from where target.toml has it, corners' rms in millimetres."""
    tags = [
        {
            "family": family,
            "id": number,
            "mismatch_mm": 1e3 * float(change.change_m[k]),
            "std_mm": 1e3 * float(change.std_m[k]),
            "corners_platform_m": change.corners_m[k].tolist(),
        }
        for k, (family, number) in enumerate(watch.tags)
    ]
    worst = max((tag["mismatch_mm"] for tag in tags), default=0.0)
    return {"refined": refined, "worst_mismatch_mm": worst, "tags": tags}


def _run(track: RunTrack, watch: Watch, errors: PoseErrors | None) -> dict[str, Any]:
    std = np.full(6, np.nan) if track.calibration is None else track.calibration.std
    cameras = []
    for index, count in enumerate(track.cameras):
        cameras.append(
            {
                "camera": count.name,
                "frames_seen": count.frames,
                "frames_used": count.used,
                "frames_rejected": count.rejected,
                "frames_dropped": count.dropped,
                "sightings_used": int(track.after.used[index]),
                "reprojection_px": float(track.after.reprojection_px[index]),
                "beyond_pixel_noise_px": float(track.after.floor_px[index]),
                "consistency_mm": 1e3 * float(track.after.consistency_m[index]),
                "outliers": [
                    {
                        "what": watch.name(thing),
                        "count": number,
                        "first_frame": first,
                        "worst_px": worst,
                    }
                    for (camera, thing), (number, first, worst) in track.after.rejected.items()
                    if camera == index
                ],
            }
        )
    return {
        "run": track.name,
        "samples": track.samples,
        "known": track.known,
        "rate_hz": _known(track.rate_hz),
        "position_std_mm": _known(1e3 * track.std_m),
        "rotation_std_mrad": _known(1e3 * track.std_rad),
        "calibration_std_mm": _known(1e3 * float(np.median(std[:3]))),
        "calibration_std_mrad": _known(1e3 * float(np.median(std[3:]))),
        **_agreement(track.after),
        "cameras": cameras,
        "problems": list(track.problems),
        "calibration_errors": None if errors is None else errors.document(),
    }


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _agreement(fit: Fit) -> dict[str, float | None]:
    used = fit.used > 0
    if not used.any():
        return {"reprojection_px": None, "consistency_mm": None}
    weights = fit.used[used] / fit.used[used].sum()
    return {
        "reprojection_px": float(np.sqrt(weights @ fit.reprojection_px[used] ** 2)),
        "consistency_mm": 1e3 * float(np.sqrt(weights @ fit.consistency_m[used] ** 2)),
    }


def _effects(track: RunTrack) -> list[dict[str, Any]]:
    return [
        {
            "effect": finding.effect,
            "verdict": "accepted",
            "run": track.name,
            "camera": finding.camera,
            "parameters": [
                {"name": name, "value": value, "std": std}
                for name, value, std in finding.parameters
            ],
            "before": _agreement(track.before),
            "after": _agreement(track.after),
        }
        for finding in track.findings
    ]
