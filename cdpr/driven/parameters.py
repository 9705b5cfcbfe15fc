"""The numbers of a driven robot under their names: what may be unknown, and where it stands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.drive import MOTOR_NUMBERS, Drive
from freeswing.cdpr.driven.formula import Formula
from freeswing.cdpr.model.pulley import Geometry
from freeswing.cdpr.robot import BODY_NAMES, Robot

Array = NDArray[np.float64]
Expression = Any


@dataclass(frozen=True, slots=True)
class Numbers:
    """Names and declared values of everything that is a number in a driven robot's file.

    Attributes:
        names: shape entries, then `BODY_NAMES` (inertia about the origin), then the motors'
            numbers; a cable's own is named `key.cable`.
        values: as declared, (len(names),).
    """

    names: tuple[str, ...]
    values: Array

    def index(self, name: str) -> int:
        """Where a name stands.

        Raises:
            ValueError: when it is not there, naming what is.
        """
        if name not in self.names:
            raise ValueError(f"{name!r} is not one of {', '.join(self.names)}")
        return self.names.index(name)

    def replaced(self, names: Sequence[str], values: Sequence[float] | Array) -> Array:
        """The values with some of them replaced, (len(names),)."""
        changed = self.values.copy()
        for name, value in zip(names, values, strict=True):
            changed[self.index(name)] = value
        return changed


def declared_numbers(robot: Robot) -> Numbers:
    """Every number of a driven robot.

    Raises:
        ValueError: when the robot is not driven, or mass or inertia are missing.
    """
    drive = drive_of(robot)
    platform = robot.platform
    if platform.mass_kg is None or platform.specific_inertia_m2 is None:
        raise ValueError(
            f"robot {robot.name}: [platform] needs mass_kg and inertia_kg_m2 "
            "(or specific_inertia_m2) for the dynamics of a driven robot"
        )
    com = np.zeros(3) if platform.com_m is None else platform.com_m
    inertia = platform.mass_kg * np.asarray(platform.specific_inertia_m2)
    pairs = {name: float(drive.shape.formulas[i].at({})) for i, name in _free(drive)}
    pairs |= dict(zip(BODY_NAMES, [platform.mass_kg, *com, *inertia], strict=True))
    for index in range(robot.n_cables):
        for name, formula in _motor_names(robot, drive, index):
            if formula.is_number:
                pairs[name] = float(formula.at({}))
    return Numbers(tuple(pairs), np.array(list(pairs.values()), dtype=np.float64))


@dataclass(frozen=True, slots=True)
class MotorTerms:
    """Constants of every motor as expressions, (n,) each; effects change them.

    Attributes:
        drum_radius: r_pm.
        spring: K_eq = k_sp r_pe^2, rotational.
        spring_drum_radius: r_pe.
        inertia: j_eq.
        viscous: f_v.
        coulomb: f_c.
        coulomb_width: width of its smoothed sign, tanh(rate / width).
        torque_constant: k_em.
        time_constant: tau of the current loop.
        roll: share of the tension that the output pulley's friction adds or takes.
    """

    drum_radius: Expression
    spring: Expression
    spring_drum_radius: Expression
    inertia: Expression
    viscous: Expression
    coulomb: Expression
    coulomb_width: Expression
    torque_constant: Expression
    time_constant: Expression
    roll: Expression


@dataclass(frozen=True, slots=True)
class Terms:
    """The declared robot as expressions of its numbers.

    Attributes:
        geometry: points and gravity.
        motors: the actuators.
        body: `BODY_NAMES` values, (10,).
    """

    geometry: Geometry
    motors: MotorTerms
    body: Expression


def terms(robot: Robot, numbers: Numbers, symbols: Expression) -> Terms:
    """Geometry, motors and body where the numbers are `symbols` (len(numbers.names),)."""
    drive = drive_of(robot)
    named = {name: symbols[i] for i, name in enumerate(numbers.names)}
    shape = drive.shape.at({name: named[name] for name in drive.shape.free}, ca)
    points = [_points(rows, shape) for rows in (drive.entries, drive.attachments)]
    declared = Geometry.of(robot)
    geometry = Geometry(points[0], declared.radii, points[1], declared.axes, declared.gravity)
    columns: dict[str, list[Expression]] = {key: [] for key in MOTOR_NUMBERS}
    for index in range(robot.n_cables):
        for key, (name, formula) in zip(
            MOTOR_NUMBERS, _motor_names(robot, drive, index), strict=True
        ):
            value = named[name] if formula.is_number else formula.at(shape, ca)
            columns[key].append(value)
    stacked = [ca.vertcat(*columns[key]) for key in MOTOR_NUMBERS]
    drum, spring_drum, spring, inertia, viscous, coulomb, width, torque, lag = stacked
    motors = MotorTerms(
        drum,
        spring * spring_drum**2,
        spring_drum,
        inertia,
        viscous,
        coulomb,
        width,
        torque,
        lag,
        ca.SX.zeros(robot.n_cables),
    )
    body = ca.vertcat(*[named[name] for name in BODY_NAMES])
    return Terms(geometry, motors, body)


def drive_of(robot: Robot) -> Drive:
    """The robot's drive.

    Raises:
        ValueError: when nothing drives it.
    """
    if robot.drive is None:
        raise ValueError(f"robot {robot.name} is not driven: its file has no [drive]")
    return robot.drive


def _free(drive: Drive) -> list[tuple[int, str]]:
    return [(i, name) for i, name in enumerate(drive.shape.names) if name in drive.shape.free]


def _motor_names(robot: Robot, drive: Drive, index: int) -> list[tuple[str, Formula]]:
    motor, cable = drive.motors[index], robot.cables[index].name
    return [
        (f"{key}.{cable}" if key in motor.own else key, formula)
        for key, formula in zip(MOTOR_NUMBERS, motor.formulas, strict=True)
    ]


def _points(
    rows: tuple[tuple[Formula, ...], ...], shape: dict[str, Expression]
) -> tuple[Expression, ...]:
    return tuple(ca.SX(ca.vertcat(*[f.at(shape, ca) for f in row])) for row in rows)
