"""First guess of the poses from cable tensions: the stable equilibria of eqs. (9) and (29).

At constant tensions a platform rests where its potential energy, weight and cables together, is
stationary, and rests stably where that energy is smallest; Newton's method with a step that always
descends therefore finds stable poses only.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.model.body import rotation
from freeswing.cdpr.model.free_motion import coordinate_indices
from freeswing.cdpr.model.pulley import Geometry, cable_state
from freeswing.cdpr.robot import Robot
from freeswing.homing.homing_files import Homing
from freeswing.homing.rest_readings import evaluate_evenly, length_screws

Array = NDArray[np.float64]

_LARGEST_STEP = 0.3
_MOST_STEPS = 60
_MOST_HALVINGS = 12

# Start tensions together, by the weight: what `default_tensions` asks for too. Cables that lean by
# about 48 degrees.
_WEIGHTS_OF_A_GUESS = 1.5


@dataclass(frozen=True, slots=True)
class StableRest:
    """Stable rest poses at given tensions.

    Attributes:
        poses: (N, 6).
        settled: (N,), False where no stable pose was reached.
        smallest_stiffness: smallest eigenvalue of the energy's curvature over the weight, (N,).
    """

    poses: Array
    settled: NDArray[np.bool_]
    smallest_stiffness: Array


class TensionEnergy:
    """Potential energy over the weight of a platform hanging on cables of constant tension."""

    def __init__(self, robot: Robot) -> None:
        if robot.platform.com_m is None:
            raise ValueError(
                "platform.com_m is missing: rest poses need the centre of mass; give it"
            )
        n = robot.n_cables
        pose, pulls, pushes = ca.SX.sym("pose", 6), ca.SX.sym("pulls", n), ca.SX.sym("pushes", 6)
        geometry, matrix = Geometry.of(robot), rotation(pose[3:])
        lengths = [cable_state(geometry, i, pose[:3], matrix).length for i in range(n)]
        down = geometry.gravity / ca.norm_2(geometry.gravity)
        height = -ca.dot(down, pose[:3] + matrix @ robot.platform.com_m)
        energy = height + ca.dot(pulls, ca.vertcat(*lengths)) - ca.dot(pushes, pose)
        curvature, slope = ca.hessian(energy, pose)
        self._all = ca.Function(
            "energy",
            [pose, pulls, pushes],
            [energy, slope, ca.densify(curvature)],
            ["pose", "pulls", "pushes"],
            ["scalar_energy", "slope", "matrix_curvature"],
        )
        self.robot = robot

    def settle(self, poses: Array, pulls: Array, pushes: Array | None = None) -> StableRest:
        """The stable pose downhill of each start.

        Args:
            poses: starts, (N, 6).
            pulls: tensions over the weight, (N, n).
            pushes: constant forces on the pose coordinates over the weight, (N, 6); none if None.
        """
        poses = np.array(poses, dtype=np.float64)
        forces = (pulls, np.zeros(6) if pushes is None else pushes)
        computed = np.isfinite(evaluate_evenly(self._all, poses, *forces)[2])
        inside = np.asarray(computed.all(axis=(1, 2)))
        if not inside.all():  # a start within a pulley, or at angles that no rotation has
            return self._among(inside, poses, forces)
        energy, slope, curvature = evaluate_evenly(self._all, poses, *forces)
        for _ in range(_MOST_STEPS):
            values, vectors = np.linalg.eigh(curvature)
            along = np.einsum("nij,ni->nj", vectors, slope)
            step = -np.einsum("nij,nj->ni", vectors, along / np.maximum(np.abs(values), 1e-3))
            length = np.linalg.norm(step, axis=1, keepdims=True)
            step *= np.minimum(1.0, _LARGEST_STEP / np.maximum(length, 1e-300))
            trial, found = self._descend(poses, forces, energy, step)
            done = np.abs(trial - poses).max() < 1e-9
            poses, (energy, slope, curvature) = trial, found
            if done:
                break
        stiffness: Array = np.linalg.eigvalsh(curvature)[:, 0].astype(np.float64)
        settled = (np.abs(slope).max(axis=1) < 1e-6) & (stiffness > 0)
        return StableRest(poses, settled, stiffness)

    def _among(
        self, inside: NDArray[np.bool_], poses: Array, forces: tuple[Array, Array]
    ) -> StableRest:
        """Settle the starts that can be computed; the others stay where they are, unsettled."""
        settled, stiffness = np.zeros(len(poses), dtype=bool), np.full(len(poses), -np.inf)
        if inside.any():
            pulls, pushes = (f[inside] if f.ndim > 1 else f for f in forces)
            rest = self.settle(poses[inside], pulls, pushes)
            poses[inside], settled[inside] = rest.poses, rest.settled
            stiffness[inside] = rest.smallest_stiffness
        return StableRest(poses, settled, stiffness)

    def _descend(
        self, poses: Array, forces: tuple[Array, Array], energy: Array, step: Array
    ) -> tuple[Array, tuple[Array, Array, Array]]:
        """Halve the steps of those poses whose energy would rise."""
        share, halvings = np.ones((len(poses), 1)), 0
        while True:
            trial = poses + share * step
            found = evaluate_evenly(self._all, trial, *forces)
            outside = ~np.isfinite(found[2]).all(axis=(1, 2))  # within a pulley, say
            uphill = ~(found[0] <= energy + 1e-12) | outside
            if not uphill.any() or halvings > _MOST_HALVINGS:
                return trial, (found[0], found[1], found[2])
            share[uphill] *= 0.5 if halvings < _MOST_HALVINGS else 0.0
            halvings += 1


def stable_starts(energy: TensionEnergy, pulls: Array) -> Array:
    """All stable poses found at one set of tensions over the weight, lowest energy first, (k, 6).

    Starts hang below the middle of the pulleys at three heights and eight headings.

    Source:
        Ida, Merlet, Carricato 2019, eq. (9); starts spread by hand.
    """
    robot = energy.robot
    middle = robot.entries_m.mean(axis=0)
    span = np.linalg.norm(robot.entries_m - middle, axis=1).mean()
    down = robot.gravity_m_s2 / np.linalg.norm(robot.gravity_m_s2)
    starts = [
        [*(middle + depth * span * down), 0.0, 0.0, heading]
        for depth in (0.3, 0.7, 1.2)
        for heading in np.linspace(-np.pi, np.pi, 8, endpoint=False)
    ]
    rest = energy.settle(np.array(starts), np.tile(pulls, (len(starts), 1)))
    found = rest.poses[rest.settled]
    found[:, 3:] = np.remainder(found[:, 3:] + np.pi, 2 * np.pi) - np.pi
    upright = found[np.abs(found[:, 4]) < np.pi / 2]
    distinct: list[Array] = []
    for pose in upright:
        if all(np.abs(pose - other).max() > 1e-4 for other in distinct):
            distinct.append(pose)
    heights = [float(-down @ pose[:3]) for pose in distinct]
    return np.array([distinct[k] for k in np.argsort(heights)]).reshape(-1, 6)


def free_indices(robot: Robot, pose: Array) -> tuple[int, ...]:
    """Coordinates whose equilibrium rows make F3: the declared ones, else the best conditioned.

    The cables' part of the equations is kept invertible by pivoting.
    """
    if robot.free_coordinates:
        return tuple(coordinate_indices(robot.free_coordinates))
    left, bound = length_screws(robot, pose), []
    for _ in range(robot.n_cables):
        sizes = np.linalg.norm(left, axis=0)
        bound.append(int(sizes.argmax()))
        direction = left[:, bound[-1]] / sizes.max()
        left = left - np.outer(direction, direction @ left)
    return tuple(k for k in range(6) if k not in bound)


def acquisition_tensions(start_N: Array, largest_N: Array, n_poses: int) -> Array:
    """Tension set-points of section 4 for `n_poses` static poses, the start pose first, (N, n).

    One cable after another is tightened in equal steps to its largest tension and let back.

    Source:
        Ida, Merlet, Carricato 2019, sec. 4: tensioning and detensioning phases.
    """
    start, largest = np.asarray(start_N, float), np.asarray(largest_N, float)
    n = len(start)
    phase = np.arange(n_poses) * n / max(n_poses - 1, 1)
    cable = np.minimum(phase.astype(int), n - 1)
    share = 1 - np.abs(2 * (phase - cable) - 1)
    tensions = np.tile(start, (n_poses, 1))
    tensions[np.arange(n_poses), cable] += share * (largest - start)[cable]
    return tensions


def guess_poses(homing: Homing, energy: TensionEnergy) -> list[Array]:
    """First guesses of all poses, (N, 6) each: one for every stable rest at the start tensions.

    Tensions that were read serve where there are any, else the set-points of the procedure. There
    is no guess where the platform cannot rest at the start tensions.

    Source:
        Ida, Merlet, Carricato 2019, eqs. (9), (29).
    """
    robot, readings = homing.robot, homing.readings
    count = len(readings.sigma_rad)
    tensions = acquisition_tensions(homing.start_tensions_N, homing.max_tensions_N, count)
    if readings.tension_N is not None:
        tensions = np.where(np.isfinite(readings.tension_N), readings.tension_N, tensions)
    pulls = tensions / _weight_N(robot, homing.start_tensions_N)
    guesses = []
    for start in stable_starts(energy, pulls[0])[:4]:
        rest = energy.settle(np.tile(start, (count, 1)), pulls)
        guesses.append(np.where(rest.settled[:, None], rest.poses, start))
    return guesses


def _weight_N(robot: Robot, start_tensions_N: Array) -> float:
    """The platform's weight; unknown, that which the start tensions would lift comfortably."""
    gravity = float(np.linalg.norm(robot.gravity_m_s2))
    if robot.platform.mass_kg is not None:
        return robot.platform.mass_kg * gravity
    return float(np.sum(start_tensions_N)) / _WEIGHTS_OF_A_GUESS
