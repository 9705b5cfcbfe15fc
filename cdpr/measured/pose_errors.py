"""Errors that all poses of a session share, such as those of the cameras' calibration.

Noise scatters single poses; a calibration that is a little wrong moves them all alike. How a pose
moves is taken as linear in the pose itself (a shift, a turn, a scale of the base frame are that,
and so is any smooth distortion over the width of a swing) and in its velocity (clocks that
disagree): error = M b with

    b = (1, p - p0, log(R R0^T), v, omega)

Each mode M is one independent cause, of one standard deviation; the same mode acts in all runs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.robot import frozen_array
from freeswing.cdpr.rotation import log_rotation, matrix_from_quaternion, quaternion_from_matrix

Array = NDArray[np.float64]

TERMS = 13
_DIGITS = 6
_LEAST_SPREAD = 1e-6  # of the largest: directions in which a run hardly moves say nothing


@dataclass(frozen=True, slots=True)
class PoseErrors:
    """What common causes do to the poses of one run.

    Attributes:
        about_m: p0, (3,).
        about_rotation: R0, (3, 3).
        modes: each of one standard deviation: position in m and small rotation in rad, base
            frame, by the terms of b, (r, 6, 13).
    """

    about_m: Array
    about_rotation: Array
    modes: Array

    def __post_init__(self) -> None:
        count = len(self.modes)
        for name, shape in (
            ("about_m", (3,)),
            ("about_rotation", (3, 3)),
            ("modes", (count, 6, TERMS)),
        ):
            value = np.asarray(getattr(self, name), dtype=np.float64)
            object.__setattr__(self, name, frozen_array(value, shape, f"pose errors: {name}"))

    def at(self, positions_m: Array, rotations: Array, velocities: Array) -> Array:
        """One standard deviation of each mode at some poses, (n, 6, r).

        Args:
            positions_m: (n, 3).
            rotations: R_base_platform, (n, 3, 3).
            velocities: of position and orientation (omega), base frame, (n, 6).
        """
        terms = error_terms(positions_m, rotations, velocities, self.about_m, self.about_rotation)
        return np.einsum("rab,nb->nar", self.modes, terms)

    def document(self) -> dict[str, Any]:
        """JSON-ready, numbers to six digits."""
        return {
            "about_position_m": _rounded(self.about_m),
            "about_q_wxyz": quaternion_from_matrix(self.about_rotation).tolist(),
            "modes": _rounded(self.modes),
        }


def read_pose_errors(document: Any) -> PoseErrors:
    """From what `PoseErrors.document` gave.

    Raises:
        InputError: when it is something else.
    """
    try:
        modes = np.array(document["modes"], dtype=np.float64).reshape(-1, 6, TERMS)
        rotation = matrix_from_quaternion(np.array(document["about_q_wxyz"], dtype=np.float64))
        return PoseErrors(np.array(document["about_position_m"], dtype=float), rotation, modes)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"calibration_errors: {str(error)[:120]}: not what tracking writes; track again"
        ) from error


def error_terms(
    positions_m: Array, rotations: Array, velocities: Array, about_m: Array, about_rotation: Array
) -> Array:
    """The terms b of the errors at some poses, (n, 13); see `PoseErrors.at`.

    Source:
        Murray, Li, Sastry 1994, A Mathematical Introduction to Robotic Manipulation, ch. 2:
        errors of a frame as small screws.
    """
    turn = log_rotation(rotations @ np.swapaxes(about_rotation, -1, -2))
    return np.concatenate(
        [np.ones((len(positions_m), 1)), positions_m - about_m, turn, velocities], axis=1
    )


def fitted_terms(terms: Array, slopes: Array) -> Array:
    """Least-squares coefficients of slopes (n, 6, m) over k terms (n, k), (6, k, m).

    Source:
        Press et al. 2007, Numerical Recipes, sec. 15.4: general linear least squares.
    """
    scale = np.maximum(np.sqrt(np.mean(terms**2, axis=0)), 1e-12)
    flat = slopes.reshape(len(slopes), -1)
    found = np.linalg.lstsq(terms / scale, flat, rcond=_LEAST_SPREAD)[0] / scale[:, None]
    return np.moveaxis(found.reshape(len(scale), *slopes.shape[1:]), 0, 1)


def _rounded(values: Array) -> list[Any]:
    """Nested lists of numbers with six significant digits, which keeps result files small."""
    flat = [float(f"{value:.{_DIGITS}g}") for value in values.ravel()]
    return np.array(flat).reshape(values.shape).tolist()
