"""Motors, drums, balancing springs and named lengths: the constants of a driven robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.formula import Formula

Array = NDArray[np.float64]

MOTOR_NUMBERS = (
    "drum_radius_m",
    "spring_drum_radius_m",
    "spring_N_m",
    "motor_inertia_kg_m2",
    "viscous_N_m_s",
    "coulomb_N_m",
    "coulomb_width_rad_s",
    "torque_constant_N_m_A",
    "current_time_constant_s",
)
LEAST_DRIVEN = 6  # with fewer the platform moves where no cable holds it: (12) is still of rank 6,
# but no currents reach every wrench (13), which every command on driven robots takes for granted


@dataclass(frozen=True, slots=True)
class Motor:
    """What pulls one cable: formulas of `MOTOR_NUMBERS`, and limits.

    Attributes:
        formulas: one for each of `MOTOR_NUMBERS`.
        own: which of them are this cable's alone ([cables.drive]).
        current_limits_A: least and greatest current, (2,).
        tension_limits_N: least and greatest tension, (2,).
    """

    formulas: tuple[Formula, ...]
    own: frozenset[str]
    current_limits_A: tuple[float, float]
    tension_limits_N: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Shape:
    """Named lengths and angles, each a number or a formula of others, none of them in a circle.

    Attributes:
        names: in an order in which each needs earlier ones alone.
        formulas: one a name.
    """

    names: tuple[str, ...] = ()
    formulas: tuple[Formula, ...] = ()

    @property
    def free(self) -> tuple[str, ...]:
        """The names that are numbers: what may be unknown."""
        pairs = zip(self.names, self.formulas, strict=True)
        return tuple(name for name, formula in pairs if formula.is_number)

    def at(self, numbers: Mapping[str, Any], functions: Any) -> dict[str, Any]:
        """Every name's value; `numbers` replaces those of `free`."""
        values: dict[str, Any] = {}
        for name, formula in zip(self.names, self.formulas, strict=True):
            values[name] = numbers[name] if name in numbers else formula.at(values, functions)
        return values


@dataclass(frozen=True, slots=True)
class Drive:
    """How the cables of a robot are moved, and where its shape depends on named lengths.

    Attributes:
        shape: the named lengths and angles.
        entries: D of each cable as three formulas.
        attachments: A of each cable as three formulas.
        motors: one a cable.
    """

    shape: Shape
    entries: tuple[tuple[Formula, ...], ...]
    attachments: tuple[tuple[Formula, ...], ...]
    motors: tuple[Motor, ...]

    @property
    def current_limits_A(self) -> Array:
        """Least and greatest current of each motor, (n, 2)."""
        return np.array([motor.current_limits_A for motor in self.motors])

    @property
    def tension_limits_N(self) -> Array:
        """Least and greatest tension of each cable, (n, 2)."""
        return np.array([motor.tension_limits_N for motor in self.motors])
