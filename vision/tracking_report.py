"""tracking.json: frames, agreement and effects of each run and camera."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vision.fuse import Fit
from vision.run_track import RunTrack
from vision.watch import Watch


def tracking_document(tracks: Sequence[RunTrack], watch: Watch) -> dict[str, Any]:
    """The document of `results/tracking.json`.

    Agreement is the root mean square reprojection in pixels, and the distance in millimetres at
    which a camera's mean ray passes the platform that all cameras agree on.
    """
    return {
        "format": "freeswing-tracking/1",
        "runs": [_run(track, watch) for track in tracks],
        "effects": [entry for track in tracks for entry in _effects(track)],
    }


def _run(track: RunTrack, watch: Watch) -> dict[str, Any]:
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
        "rate_hz": track.rate_hz,
        "position_std_mm": 1e3 * track.std_m,
        "rotation_std_mrad": 1e3 * track.std_rad,
        **_agreement(track.after),
        "cameras": cameras,
        "problems": list(track.problems),
    }


def _agreement(fit: Fit) -> dict[str, float]:
    used = fit.used > 0
    if not used.any():
        return {"reprojection_px": float("nan"), "consistency_mm": float("nan")}
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
