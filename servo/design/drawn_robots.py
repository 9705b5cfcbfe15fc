"""Robots that might be the one that was identified."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.servo.files.identified_file import Identified
from freeswing.servo.synthesis.state_space import Array

DRAWS = 200
# Relative std of what identification gives (Table 1 of the paper), where no result states it.
TABLE_1_STD = {
    "Lx_m": 0.068, "Ly_m": 0.070, "Lz_m": 0.054, "arm_m": 0.187, "theta_xy_rad": 0.006,
    "theta_xz_rad": 0.003, "drum_m": 0.010, "mass_kg": 0.003, "Ixx_kg_m2": 0.103,
    "Iyy_kg_m2": 0.130, "Izz_kg_m2": 0.130, "motor_inertia_kg_m2": 0.004,
    "viscous_N_m_s": 0.038, "spring_N_m": 0.0005,
}  # fmt: skip
# A positive number stays above this share of itself however wide its deviation: less is no robot.
LEAST_SHARE = 0.1


@dataclass(frozen=True, slots=True)
class Cloud:
    """Numbers of a robot with their covariance.

    Attributes:
        source: where it is from, in words.
        members: names of the model's numbers that each unknown moves, (k,).
        values: (k,).
        covariance: (k, k).
        note: what to know of it, empty where nothing.
    """

    source: str
    members: tuple[tuple[str, ...], ...]
    values: Array
    covariance: Array
    note: str = ""

    def draw(self, model: DrivenModel, rng: np.random.Generator) -> tuple[Array, dict[str, float]]:
        """Theta of one robot, and what was drawn by name."""
        sizes, directions = np.linalg.eigh(self.covariance)
        # Rounding makes eigenvalues of a singular covariance negative.
        spread = directions * np.sqrt(np.maximum(sizes, 0.0))
        drawn = self.values + spread @ rng.standard_normal(len(self.values))
        drawn = np.where(self.values > 0.0, np.maximum(drawn, LEAST_SHARE * self.values), drawn)
        numbers = {
            name: float(value)
            for names, value in zip(self.members, drawn, strict=True)
            for name in names
        }
        return model.theta(numbers), numbers


def by_table_1(model: DrivenModel) -> Cloud:
    """About the declared robot, numbers independent of each other."""
    names = [name for name in TABLE_1_STD if name in model.names]
    values = np.array([model.declared[model.index(name)] for name in names])
    std = values * np.array([TABLE_1_STD[name] for name in names])
    members = tuple((name,) for name in names)
    return Cloud("the paper's Table 1 deviations", members, values, np.diag(std**2))


def by_identified(found: Identified, source: str) -> Cloud:
    """About the identified robot, with its covariance."""
    note = ""
    if found.unknown:
        note = f"not determined there and kept as declared: {', '.join(found.unknown)}"
    return Cloud(source, found.members, found.values, found.covariance, note)
