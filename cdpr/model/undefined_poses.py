"""Where the cable geometry and the angles stop being defined, named by sample and cable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import POSE_COORDINATES, Array

LEAST_LENGTH_M = 1e-6
LEAST_COSINE = 1e-3  # rates of angles then multiply errors of a turn by 1000, no pose is as good


@dataclass(frozen=True, slots=True)
class DomainProblem:
    """One reason why a pose has no cable lengths or rates.

    Attributes:
        sample: index of the pose in the batch, flattened.
        cable: the cable's name, or "" where the orientation is at fault.
        cause: what is wrong, with the number and the limit.
    """

    sample: int
    cable: str
    cause: str

    def __str__(self) -> str:
        cable = f"cable {self.cable}: " if self.cable else ""
        return f"sample {self.sample}: {cable}{self.cause}"


def domain_problems(
    model: Model, zetas: Array, values: Array | None = None
) -> tuple[DomainProblem, ...]:
    """Everything that leaves the domain of the model at poses (..., 6), sample by sample.

    Named are coordinates that are not finite, theta within 0.06 degrees of +-90 degrees,
    attachment points inside their pulley (the straight part would have no length) and on a swivel
    axis (the pulley would not know where to turn).

    Args:
        model: the robot.
        zetas: poses, (..., 6).
        values: effect values, (k,).
    """
    values = model.start_values if values is None else np.asarray(values, dtype=np.float64)
    poses: Array = np.reshape(np.asarray(zetas, dtype=np.float64), (-1, len(POSE_COORDINATES)))
    finite: Array = np.all(np.isfinite(poses), axis=1)
    found = [
        DomainProblem(int(k), "", f"the pose {poses[k]} holds a number that is not finite")
        for k in np.flatnonzero(~finite)
    ]
    safe = np.where(finite[:, None], poses, 0.0)
    cosines = np.cos(safe[:, 4])
    for k in np.flatnonzero(finite & (np.abs(cosines) < LEAST_COSINE)):
        angle = np.rad2deg(poses[k, 4])
        cause = (
            f"theta is {angle:.3f} degrees and the angles have no rates at +-90; turn the "
            "platform frame by 90 degrees in the robot and target files"
        )
        found.append(DomainProblem(int(k), "", cause))
    found += _cable_problems(model, safe, values, finite)
    return tuple(sorted(found, key=lambda problem: (problem.sample, problem.cable)))


def check_domain(model: Model, zetas: Array, values: Array | None = None) -> None:
    """Refuse poses (..., 6) at which the model is not defined.

    Raises:
        ValueError: naming the first three problems of `domain_problems` and their number.
    """
    problems = domain_problems(model, zetas, values)
    if problems:
        listed = "; ".join(str(problem) for problem in problems[:3])
        raise ValueError(f"{len(problems)} poses or cables outside the model's domain: {listed}")


def _cable_problems(
    model: Model, poses: Array, values: Array, finite: Array
) -> list[DomainProblem]:
    arms, squares, radii = evaluate(model.domain, poses, values)
    names = [cable.name for cable in model.robot.cables]
    on_axis = (radii > 0.0) & (arms < LEAST_LENGTH_M) & finite[:, None]
    inside = (squares < LEAST_LENGTH_M**2) & ~on_axis & finite[:, None]
    found = [
        DomainProblem(
            int(k),
            names[i],
            f"its attachment point is {arms[k, i]:.1e} m from the swivel axis (limit "
            f"{LEAST_LENGTH_M:g} m), where the pulley has no direction; check entry_m, swivel_z "
            "and the pose",
        )
        for k, i in zip(*np.nonzero(on_axis), strict=True)
    ]
    for k, i in zip(*np.nonzero(inside), strict=True):
        depth = np.sqrt(max(radii[k, i] ** 2 + squares[k, i], 0.0))
        place = "at its eyelet"
        if radii[k, i] > 0.0:
            place = f"inside its pulley, {depth:.4f} m from the centre of radius {radii[k, i]:g} m"
        cause = f"its attachment point lies {place}; check entry_m, swivel axes and the pose"
        found.append(DomainProblem(int(k), names[i], cause))
    return found
