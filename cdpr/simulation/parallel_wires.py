"""Closed forms of a platform on parallel wires, whose yaw the classic formula describes."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.robot import Robot

PARALLEL_RAD = 0.02  # wires that lean towards each other by less hang parallel


def bending(top_m: float, bottom_m: float, length_m: float, specific_izz: float) -> float:
    """How the frequency of yaw on parallel wires changes with its amplitude, 1/rad^2.

    omega(A) = omega (1 + k A^2), k = -1/16 + 3 p / (16 L^2) - p^2 / (4 L^2 s), with p the product
    of the radii and s inertia over mass: the pendulum's part, what wires that lean add to the
    potential, and the platform's own rise and fall, which wide benches feel most.

    Source:
        Landau, Lifshitz, Mechanics, sec. 28, for the energy m g (L - sqrt(L^2 - 2 p (1 - cos chi)))
        + m (s + (p sin chi / L)^2) chi'^2 / 2.
    """
    product = top_m * bottom_m
    lean = 3.0 * product / (16.0 * length_m**2)
    return -1.0 / 16.0 + lean - product**2 / (4.0 * length_m**2 * specific_izz)


def hangs_parallel(robot: Robot) -> bool:
    """Whether two or three wires without pulleys hang parallel, as of a bench.

    Their entries and attachments are then the same figure, up to a turn and a shift.
    """
    if robot.n_cables not in (2, 3) or robot.radii_m.any():
        return False
    above = robot.entries_m - robot.entries_m.mean(axis=0)
    below = robot.attachments_m - robot.attachments_m.mean(axis=0)
    down = robot.gravity_m_s2 / np.linalg.norm(robot.gravity_m_s2)
    if np.abs(above @ down).max() > PARALLEL_RAD * np.abs(above).max():
        return False
    sides = [_sides(points) for points in (above, below)]
    return bool(np.abs(sides[0] - sides[1]).max() < PARALLEL_RAD * sides[0].max())


def _sides(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points[:, None] - points[None], axis=2)
