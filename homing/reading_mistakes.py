"""Mistakes in homing readings that can be told from the readings: units, signs, one wrong row."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from freeswing.homing.fit_start_pose import StartFit
from freeswing.homing.homing_files import Homing

_CHANGES = (
    ("if dsigma are degrees: convert them to radians", np.pi / 180, 1.0),
    ("if dl are millimetres: convert them to metres", 1.0, 1e-3),
    ("if dsigma are degrees and dl millimetres: convert both", np.pi / 180, 1e-3),
    ("if dl are centimetres: convert them to metres", 1.0, 1e-2),
    ("with dsigma of the other sign: they count the other way round the swivel axes", -1.0, 1.0),
    ("with dl of the other sign: they count cable wound up, not cable let out", 1.0, -1.0),
    ("with dsigma and dl of the other sign", -1.0, -1.0),
)

SUSPECT_WEIGHT = 0.6  # of the robust loss: a reading beyond five standard deviations


def likely_mistake(homing: Homing, explains: Callable[[Homing], bool]) -> str:
    """What would make the readings those of a start pose, as the end of a sentence; "" if nothing.

    Args:
        homing: the readings that fit nothing.
        explains: whether other readings fit some start pose.
    """
    return next((told for told, changed in _candidates(homing) if explains(changed)), "")


def _candidates(homing: Homing) -> Iterator[tuple[str, Homing]]:
    readings = homing.readings
    for told, turn, stretch in _CHANGES:
        changed = replace(
            readings, sigma_rad=turn * readings.sigma_rad, length_m=stretch * readings.length_m
        )
        yield told, replace(homing, readings=changed)


def suspect_readings(fit: StartFit) -> list[dict]:
    """Readings that the robust loss took weight from, the worst first, twenty at the most."""
    n = len(fit.length_m)
    names = [f"dsigma{i + 1}_rad" for i in range(n)] + [f"dl{i + 1}_m" for i in range(n)]
    where = np.argwhere(fit.weights[:, : 2 * n] < SUSPECT_WEIGHT)
    found = [
        {"row": int(k), "column": names[j], "residual": float(fit.residuals[k, j])}
        for k, j in where[np.argsort([fit.weights[k, j] for k, j in where])]
    ]
    return found[:20]
