"""`linear.json` and its picture: the linear model of a driven robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.linear import COORDINATES, LinearModel, Mode
from freeswing.printing.curves import Panel

Array = NDArray[np.float64]


def linear_document(
    robot: str, linear: LinearModel, found: Sequence[Mode], rates: Array, response: Any
) -> dict[str, Any]:
    """The document: u is the change of the wrench about P in base axes, y that of the pose."""
    return {
        "format": "freeswing-linear/1",
        "robot": robot,
        "coordinates": list(COORDINATES),
        "at": linear.at,
        "wrench": linear.wrench,
        "A": linear.A,
        "B": linear.B,
        "C": linear.C,
        "D": linear.D,
        "mass": linear.mass,
        "damping": linear.damping,
        "stiffness": linear.stiffness,
        "turning": linear.turning,
        "wrench_matrix": linear.wrench_matrix,
        "modes": [
            {
                "rate_rad_s": mode.rate_rad_s,
                "frequency_hz": mode.rate_rad_s / (2.0 * np.pi),
                "damping": mode.damping,
                "words": mode.words,
                "shape": mode.shape,
            }
            for mode in found
        ],
        "singular_values": {
            "rate_rad_s": rates,
            "position_m_N": _values(response[:, :3, :3]),
            "orientation_rad_N_m": _values(response[:, 3:, 3:]),
        },
    }


def linear_panels(rates: Array, response: Any) -> tuple[Panel, ...]:
    """Fig. 8: position by force, orientation by moment."""
    return tuple(
        Panel(title, "rad/s", up, rates, _values(block))
        for title, up, block in (
            ("position", "m/N", response[:, :3, :3]),
            ("orientation", "rad/(N m)", response[:, 3:, 3:]),
        )
    )


def _values(blocks: Any) -> Array:
    return np.asarray(np.linalg.svd(blocks, compute_uv=False), float)
