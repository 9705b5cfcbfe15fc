"""Where a driven platform rests under held currents, and currents that hold it at a pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.cdpr.driven.slopes import moved, stiffness
from freeswing.cdpr.model.batch import evaluate

Array = NDArray[np.float64]

CENTRE = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
MOST_ITERATIONS = 200
LARGEST_SHIFT = np.repeat([0.1, 0.2], 3)  # of one iteration, metres and radians: a tenth of a frame
AT_REST = 1e-12  # last shift, metres and radians: a thousandth of any measurement's last digit


@dataclass(frozen=True, slots=True)
class Rest:
    """A stable rest.

    Attributes:
        pose: position and quaternion, (7,).
        tensions_N: (n,), negative where a cable would have to push.
        least_stiffness: least eigenvalue of mass^-1 stiffness, 1/s^2.
    """

    pose: Array
    tensions_N: Array
    least_stiffness: float


def static_pose(
    model: DrivenModel, currents: Array, theta: Array | None = None, start: Array = CENTRE
) -> Rest:
    """The pose at which the platform rests under held currents, Coulomb friction left out.

    Newton's method in small translations and turns; where the stiffness is not positive the
    platform follows its acceleration instead.

    Raises:
        ValueError: when no stable rest is found, with where the search ended.
    """
    theta = model.declared if theta is None else theta
    pose, acceleration = np.array(start, dtype=np.float64), np.full(6, np.inf)
    for _ in range(MOST_ITERATIONS):
        acceleration, falling = stiffness(model, pose, currents, theta)
        least = float(np.linalg.eigvals(falling).real.min())
        lifted = falling + max(0.0, 1.0 - least) * np.eye(6) if least < 1.0 else falling
        shift = np.linalg.solve(lifted, acceleration)
        shift = shift / max(1.0, float(np.abs(shift / LARGEST_SHIFT).max()))
        pose = moved(pose, shift)
        if np.abs(shift).max() < AT_REST and least > 0.0:
            state = np.concatenate([pose, np.zeros(6)])
            tensions = evaluate(model.motion, state, currents, theta)[1]
            return Rest(pose, tensions, least)
    raise ValueError(
        f"no stable rest under currents {np.array2string(np.asarray(currents), precision=3)} A: "
        f"the search ended at {np.array2string(pose, precision=3)} with an acceleration of "
        f"{np.abs(acceleration).max():.3g}; without springs cables of held currents only pull"
    )


def holding_wrench(model: DrivenModel, pose: Array, theta: Array | None = None) -> Array:
    """Wrench of the currents that holds a pose, (6,): force in the base frame, moment about P in
    the platform frame.
    """  # noqa: D205
    theta = model.declared if theta is None else theta
    state = np.concatenate([pose, np.zeros(6)])
    return evaluate(model.needed, state, np.zeros(6), theta)[0]


def holding_currents(
    model: DrivenModel, pose: Array, theta: Array | None = None, near_A: Array | None = None
) -> Array:
    """Currents that hold a pose, those nearest to `near_A` (25)-(28), (n,).

    Args:
        model: the equations.
        pose: position and quaternion, (7,).
        theta: the model's numbers; None as declared.
        near_A: (n,); None: the middle of each motor's limits.

    Raises:
        ValueError: when a limit is passed, naming the motor, or the cables cannot give the wrench.

    Source:
        INCA 2016, eqs. (25) to (28): the pseudo-inverse of the wrench matrix.
    """
    theta = model.declared if theta is None else theta
    limits = model.drive.current_limits_A
    near = limits.mean(axis=1) if near_A is None else np.asarray(near_A, dtype=np.float64)
    gains = evaluate(model.wrench_matrix, pose, theta)[0]
    if np.linalg.matrix_rank(gains) < 6:
        raise ValueError(f"at {np.array2string(pose, precision=3)} the cables lose a direction")
    gap = holding_wrench(model, pose, theta) - gains @ near
    currents = near + np.linalg.pinv(gains) @ gap
    outside = np.maximum(limits[:, 0] - currents, currents - limits[:, 1])
    worst = int(np.argmax(outside))
    if outside[worst] > 0.0:
        low, high = limits[worst]
        raise ValueError(
            f"holding {np.array2string(pose, precision=3)} takes {currents[worst]:.3g} A in motor "
            f"{model.robot.cables[worst].name}, limits {low:g} to {high:g} A; take a pose nearer "
            "to the centre"
        )
    return currents
