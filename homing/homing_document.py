"""results/homing.json: the start pose and how far it can be trusted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.robot import Robot
from freeswing.homing.fit_start_pose import StartFit
from freeswing.homing.reading_mistakes import suspect_readings
from freeswing.homing.rest_readings import geometry_labels

Array = NDArray[np.float64]


def homing_document(robot: Robot, fit: StartFit, seconds: float) -> dict:
    """results/homing.json as a dictionary."""
    std = np.sqrt(np.diag(fit.pose_covariance))
    offsets_std = np.sqrt(np.diag(fit.offsets_covariance))
    n = robot.n_cables
    start = fit.poses[0]
    return {
        "format": "freeswing-homing/1",
        "start_pose": {
            "position_m": start[:3].tolist(),
            "angles_rad": _wrapped(start[3:]).tolist(),
        },
        "start_pose_std": {"position_m": std[:3].tolist(), "angles_rad": std[3:].tolist()},
        "cable_lengths_m": fit.length_m.tolist(),
        "cable_lengths_std_m": offsets_std[n:].tolist(),
        "swivel_angles_rad": fit.sigma_rad.tolist(),
        "swivel_angles_std_rad": offsets_std[:n].tolist(),
        "residual_rms": {
            "sigma_rad": _rms(fit, "sigma"),
            "length_m": _rms(fit, "length"),
            "statics": _rms(fit, "statics"),
        },
        "conditioning": fit.conditioning,
        "seconds": seconds,
        "poses": len(fit.poses),
        "noise": {
            "sigma_rad": fit.noise.sigma_rad,
            "length_m": fit.noise.length_m,
            "stated": fit.noise.stated,
        },
        "chi_square_over_degrees": fit.chi_square / fit.degrees,
        "suspect_readings": suspect_readings(fit),
        "geometry": _geometry(robot, fit),
    }


def _wrapped(angles: Array) -> Array:
    return np.remainder(angles + np.pi, 2 * np.pi) - np.pi


def _rms(fit: StartFit, kind: str) -> float:
    columns = [k for k, row in enumerate(fit.rows) if row == kind]
    return float(np.sqrt(np.nanmean(fit.residuals[:, columns] ** 2)))


def _geometry(robot: Robot, fit: StartFit) -> list[dict]:
    """Geometry offsets that were estimated, the best known first."""
    if fit.geometry_std is None:
        return []
    labels = geometry_labels(robot)
    order = np.argsort(fit.geometry_std)
    return [
        {"name": labels[k], "offset": float(fit.geometry[k]), "std": float(fit.geometry_std[k])}
        for k in order
    ]
