"""What a robot at rest would read: swivel angles, cable lengths, statics, tensions and tilt.

Self-calibration 2019, eqs. (2)-(14); derivatives come from the same expressions, so the closed
forms (22)-(28) of the paper are tests and not a second implementation.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.model.batch import LARGEST_CHUNK, evaluate
from freeswing.cdpr.model.body import rotation
from freeswing.cdpr.model.pulley import CableState, Geometry, cable_state
from freeswing.cdpr.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Predicted readings of N poses and their derivatives.

    Attributes:
        values: (N, m), columns as `RestModel.rows` names them.
        by_pose: (N, m, 6), derivatives by x y z phi theta chi.
        by_geometry: (N, m, 7 n + 3), derivatives by the geometry offsets; None when not asked for.
    """

    values: Array
    by_pose: Array
    by_geometry: Array | None


class RestModel:
    """Readings of a robot at rest as functions of its pose and of small geometry offsets.

    The statics rows are F3 of eq. (14) over the platform's weight: pure numbers for free
    coordinates x y z and metres for phi theta chi; the tension rows are over the weight too, so
    that nothing here needs the mass.

    Args:
        robot: the robot; its centre of mass must be known.
        free: indices (6 - n of 0..5) of the twist components whose equilibrium rows are F3.
        with_tensions: whether to predict the tensions over the weight, (n,).
        with_tilt: whether to predict an inclinometer's roll and pitch, (2,).

    Raises:
        ValueError: when the centre of mass is unknown or there are six cables or more.
    """

    def __init__(
        self,
        robot: Robot,
        free: tuple[int, ...],
        *,
        with_tensions: bool = False,
        with_tilt: bool = False,
    ) -> None:
        n = robot.n_cables
        if robot.platform.com_m is None:
            raise ValueError("platform.com_m is missing: statics need the centre of mass; give it")
        if not 0 < n < 6 or len(set(free)) != 6 - n:
            raise ValueError(
                f"{n} cables and free coordinates {free}: need 1 to 5 cables and 6 - n coordinates"
            )
        self.robot, self.free = robot, tuple(free)
        self.n_cables = n
        self.n_geometry = 7 * n + 3
        self._pose, self._offsets = ca.SX.sym("pose", 6), ca.SX.sym("offsets", 7 * n + 3)
        parts = _rest_expressions(robot, self.free, self._pose, self._offsets)
        groups = ["sigma", "length", "statics"]
        groups += ["tension"] * with_tensions + ["tilt"] * with_tilt
        self.rows: tuple[str, ...] = tuple(g for g in groups for _ in range(parts[g].numel()))
        self._values = ca.vertcat(*[parts[g] for g in groups])
        self._by_pose = ca.densify(ca.jacobian(self._values, self._pose))

    def columns(self, group: str) -> NDArray[np.intp]:
        """Indices of the rows of one group: sigma, length, statics, tension or tilt."""
        return np.flatnonzero(np.array(self.rows) == group)

    @cached_property
    def _plain(self) -> Any:
        return self._function(self._by_pose)

    @cached_property
    def _with_geometry(self) -> Any:
        by_offsets = ca.densify(ca.jacobian(self._values, self._offsets))
        return self._function(self._by_pose, by_offsets)

    def _function(self, *jacobians: Any) -> Any:
        """A function for `evaluate`, which tells matrices by their names."""
        names = ["values", *(f"matrix_{k}" for k in range(len(jacobians)))]
        inputs, outputs = [self._pose, self._offsets], [self._values, *jacobians]
        return ca.Function("rest", inputs, outputs, ["pose", "offsets"], names)

    def evaluate(
        self, poses: Array, offsets: Array | None = None, *, by_geometry: bool = False
    ) -> Evaluation:
        """Predictions and derivatives at poses (N, 6).

        Args:
            poses: x y z phi theta chi, (N, 6).
            offsets: additions to d (3 n), a (3 n), r (n) and the centre of mass (3), (7 n + 3,).
            by_geometry: whether to give the derivatives by the offsets too.
        """
        offsets = np.zeros(self.n_geometry) if offsets is None else offsets
        if not by_geometry:
            values, by_pose = evaluate_evenly(self._plain, poses, offsets)
            return Evaluation(values, by_pose, None)
        values, by_pose, by_offsets = evaluate_evenly(self._with_geometry, poses, offsets)
        return Evaluation(values, by_pose, by_offsets)


def evaluate_evenly(function: Any, poses: Array, *others: Array) -> tuple[Array, ...]:
    """`evaluate` at poses (N, 6), padded so that one mapped function serves the whole batch."""
    count = len(poses)
    whole = -(-count // LARGEST_CHUNK) * LARGEST_CHUNK
    size = 1 << (count - 1).bit_length() if count < LARGEST_CHUNK else whole

    def padded(array: Array) -> Array:
        if array.ndim < 2 or len(array) != count:
            return array
        return np.concatenate([array, np.repeat(array[-1:], size - count, axis=0)])

    results = evaluate(function, padded(poses), *(padded(array) for array in others))
    return tuple(result[:count] for result in results)


def geometry_labels(robot: Robot) -> tuple[str, ...]:
    """Names of the geometry offsets in their order, such as `cables.1.entry_x_m` or `com_z_m`."""
    points = [
        f"cables.{cable.name}.{kind}_{axis}_m"
        for kind in ("entry", "attachment")
        for cable in robot.cables
        for axis in "xyz"
    ]
    radii = [f"cables.{cable.name}.radius_m" for cable in robot.cables]
    return (*points, *radii, *(f"com_{axis}_m" for axis in "xyz"))


def length_screws(robot: Robot, pose: Array) -> Array:
    """The cables' screws at a pose (6,), (n, 6): J of eq. (9)."""
    symbol = ca.SX.sym("pose", 6)
    geometry, matrix = Geometry.of(robot), rotation(symbol[3:])
    states = [cable_state(geometry, i, symbol[:3], matrix) for i in range(robot.n_cables)]
    return np.array(ca.Function("screws", [symbol], [_screws(geometry, states)])(pose))


def _screws(geometry: Geometry, states: list[CableState]) -> Any:
    """[t, a' x t] of every cable; t by eq. (4), the gradient of the length."""
    rows = []
    for axes, state in zip(geometry.axes, states, strict=True):
        reach = ca.sin(state.wrap)
        local = [reach * ca.cos(state.swivel), reach * ca.sin(state.swivel), -ca.cos(state.wrap)]
        direction = axes.T @ ca.vertcat(*local)
        rows.append(ca.vertcat(direction, ca.cross(state.lever, direction)).T)
    return ca.vertcat(*rows)


def _rest_expressions(robot: Robot, free: tuple[int, ...], pose: Any, offsets: Any) -> dict:
    """Symbolic groups of readings; eqs. (3), (6) and (12)-(14)."""
    n = robot.n_cables
    declared = Geometry.of(robot)
    geometry = Geometry(
        entries=tuple(declared.entries[i] + offsets[3 * i : 3 * i + 3] for i in range(n)),
        attachments=tuple(
            declared.attachments[i] + offsets[3 * (n + i) : 3 * (n + i) + 3] for i in range(n)
        ),
        radii=tuple(declared.radii[i] + offsets[6 * n + i] for i in range(n)),
        axes=declared.axes,
        gravity=declared.gravity,
    )
    matrix = rotation(pose[3:])
    states = [cable_state(geometry, i, pose[:3], matrix) for i in range(n)]
    screws = _screws(geometry, states)
    down = geometry.gravity / ca.norm_2(geometry.gravity)
    com = robot.platform.com_m + offsets[7 * n :]
    wrench = ca.vertcat(down, ca.cross(matrix @ com, down))
    bound = [k for k in range(6) if k not in free]
    tensions = ca.inv(screws[:, bound].T) @ wrench[bound]
    up = -(matrix.T @ down)
    return {
        "sigma": ca.vertcat(*[state.swivel for state in states]),
        "length": ca.vertcat(*[state.length for state in states]),
        "statics": screws[:, list(free)].T @ tensions - wrench[list(free)],
        "tension": tensions,
        "tilt": ca.vertcat(ca.atan2(up[1], up[2]), ca.atan2(-up[0], ca.norm_2(up[1:]))),
    }
