"""`drive.json`: the estimates of a driven robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from freeswing.ident.drive.identify import DriveIdentification, DriveSession, RunFit
from freeswing.ident.drive.joint import Estimate
from freeswing.ident.drive.kinematics import Kinematics

Array = NDArray[np.float64]

# A number whose deviation is more of itself is not an estimate.
LARGEST_SHARE = 0.3


def drive_document(name: str, session: DriveSession, found: DriveIdentification) -> dict[str, Any]:
    """The document; what the data do not determine has null values."""
    estimates: dict[str, Any] = {
        "inverse_dynamics": {
            "parameters": _parameters(
                session.asked.dynamic.names, found.regression.values, found.regression.std
            ),
            "condition": found.regression.condition,
        },
        "output_error": _estimate(found.output_error)
        | {"second_start_z": found.second_start, "initial_values": "inverse_dynamics"},
        "joint": _estimate(found.joint),
    }
    if found.kinematics is not None and found.published is not None:
        names = session.asked.kinematic.names
        estimates["kinematic"] = {
            **_kinematics(names, found.kinematics),
            "equation_18": _kinematics(names, found.published),
        }
    return {
        "format": "freeswing-drive-result/1",
        "session": name,
        "estimates": estimates,
        "fit_percent": [_fit(fit) for fit in found.fits],
        "initial_fit_percent": [_fit(fit) for fit in found.initial if fit is not None],
        "slack": [_slack(session, fit) for fit in found.fits if fit.slack.any()],
        "saturated": [_saturated(session, fit) for fit in found.fits if fit.saturated.any()],
        "residual": {
            "autocorrelation_10_ms": found.joint.autocorrelation,
            "times_noise": {fit.run.name: times_noise(session, fit) for fit in found.fits},
        },
    }


def times_noise(session: DriveSession, fit: RunFit) -> float:
    """The angles' residual over what encoder counts leave."""
    return fit.rms_rad / session.noise.angle_std_rad


def unknown(std: float, value: float) -> bool:
    """Whether a number is not determined."""
    return not np.isfinite(std) or std > LARGEST_SHARE * abs(value)


def _parameters(
    names: Sequence[str], values: Array, std: Array, on_bound: NDArray[np.bool_] | None = None
) -> list[dict[str, Any]]:
    entries = []
    for k, name in enumerate(names):
        # Offsets of points have no size of their own to compare with.
        is_offset = "_offset." in name
        lost = not np.isfinite(std[k]) if is_offset else unknown(std[k], values[k])
        entry = {"name": name, "value": None if lost else values[k]}
        entry |= {"std": None if lost else std[k], "identifiable": not lost}
        entries.append(entry | {"on_bound": bool(on_bound is not None and on_bound[k])})
    return entries


def _estimate(found: Estimate) -> dict[str, Any]:
    std = np.where(found.determined, np.sqrt(np.maximum(np.diag(found.covariance), 0.0)), np.inf)
    safe = np.where(np.isfinite(found.covariance), found.covariance, 0.0)
    size = np.where(np.isfinite(std) & (std > 0.0), std, 1.0)
    parameters = _parameters(found.asked.names, found.values, std, found.on_bound)
    for one, group in zip(parameters, found.asked.groups, strict=True):
        if len(group.members) > 1:
            one["tied"] = list(group.members[1:])
    return {
        "parameters": parameters,
        "correlation": safe / np.outer(size, size),
        "condition": found.found.condition,
        "iterations": found.found.iterations,
        "stopped": found.found.stopped,
    }


def _kinematics(names: Sequence[str], found: Kinematics) -> dict[str, Any]:
    std = np.where(found.determined, np.sqrt(np.maximum(np.diag(found.covariance), 0.0)), np.inf)
    return {
        "parameters": _parameters(names, found.values, std),
        "rms_rad": found.rms_rad,
        "condition": found.found.condition,
        "stopped": found.found.stopped,
    }


def _fit(fit: RunFit) -> dict[str, Any]:
    return {
        "run": fit.run.name,
        "role": fit.run.role,
        "equation_22": fit.equation_22,
        "matlab": fit.matlab,
        "rms_rad": fit.rms_rad,
    }


def _slack(session: DriveSession, fit: RunFit) -> dict[str, Any]:
    cables = session.model.robot.cables
    return {
        "run": fit.run.name,
        "samples": int(fit.motion.slack.any(axis=1).sum()),
        "cables": [cables[k].name for k in np.flatnonzero(fit.slack)],
        "least_tension_N": float(fit.motion.tensions_N.min()),
    }


def _saturated(session: DriveSession, fit: RunFit) -> dict[str, Any]:
    cables = session.model.robot.cables
    motors = [cables[k].name for k in np.flatnonzero(fit.saturated)]
    return {"run": fit.run.name, "samples": int(fit.saturated.max()), "motors": motors}
