"""Plants and problems for the tests, made here and not by the product's own model."""

from __future__ import annotations

import numpy as np

from freeswing.servo.synthesis.riccati import StandardProblem
from freeswing.servo.synthesis.state_space import StateSpace

LENGTHS_M = np.array([2.50, 2.75, 3.05])
ARM_M, XY_RAD, XZ_RAD = 0.138, np.deg2rad(63.0), np.deg2rad(21.6)
DRUM_M, MASS_KG, INERTIA = 0.0175, 0.289, np.array([1.49e-4, 2.07e-4, 2.07e-4])
MOTOR_INERTIA, VISCOUS, STIFFNESS = 3.88e-5, 6.68e-5, 14.4 * 0.006**2
TORQUE_N_M_A = 0.0603
CORNERS = np.array([[x, y, z] for x in (1, -1) for y in (1, -1) for z in (1, -1)])


def attachments() -> np.ndarray:
    """The paper's arms in the reading of samples/inca-6d."""
    xy = CORNERS * ARM_M * np.array([np.cos(XY_RAD), np.sin(XY_RAD), 0.0])
    xz = CORNERS * ARM_M * np.array([np.cos(XZ_RAD), 0.0, np.sin(XZ_RAD)])
    return np.where(CORNERS.prod(axis=1)[:, None] > 0, xy, xz)


def rotation(angles: np.ndarray) -> np.ndarray:
    """Eq. (1)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(angles), np.sin(angles)
    Rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    Ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    Rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    return Rz @ Ry @ Rx


def cables(pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lengths (8,) and the Jacobian (8, 6) of eq. (3)."""
    arms = attachments() @ rotation(pose[3:]).T
    lines = pose[:3] + arms - CORNERS * LENGTHS_M / 2
    lengths = np.linalg.norm(lines, axis=1)
    along = lines / lengths[:, None]
    return lengths, np.hstack([along, np.cross(arms, along)])


def inca_plant() -> StateSpace:
    """Eq. (17) at the centre; the stiffness (16) by central differences."""
    _, J = cables(np.zeros(6))
    gear = J / DRUM_M
    mass = np.diag([MASS_KG] * 3 + list(INERTIA)) + MOTOR_INERTIA * gear.T @ gear
    damping = VISCOUS * gear.T @ gear
    stiffness, h = np.empty((6, 6)), 1e-5
    for k in range(6):
        ends = [_spring_force(np.eye(6)[k] * sign * h) for sign in (1, -1)]
        stiffness[:, k] = (ends[0] - ends[1]) / (2 * h)
    low = -np.linalg.solve(mass, np.hstack([stiffness, damping]))
    A = np.vstack([np.hstack([np.zeros((6, 6)), np.eye(6)]), low])
    B = np.vstack([np.zeros((6, 6)), np.linalg.inv(mass)])
    return StateSpace(A, B, np.eye(6, 12), np.zeros((6, 6)))


def _spring_force(pose: np.ndarray) -> np.ndarray:
    lengths, J = cables(pose)
    (cp, cy), (sp, sy) = np.cos(pose[4:]), np.sin(pose[4:])
    turn = np.eye(6)
    turn[3:, 3:] = [[cy * cp, -sy, 0], [sy * cp, cy, 0], [-sp, 0, 1]]
    return turn.T @ J.T @ (STIFFNESS / DRUM_M**2 * lengths)


def random_problem(seed: int) -> StandardProblem:
    """2 to 12 states, square or not, with all of D11, D12, D21, D22."""
    rng = np.random.default_rng(seed)
    n, n_u, n_y = int(rng.integers(2, 13)), int(rng.integers(1, 4)), int(rng.integers(1, 4))
    n_w, n_z = n_y + int(rng.integers(0, 4)), n_u + int(rng.integers(0, 4))
    sizes = ((n, n), (n, n_w + n_u), (n_z + n_y, n), (n_z + n_y, n_w + n_u))
    return StandardProblem(StateSpace(*[rng.standard_normal(size) for size in sizes]), n_y, n_u)


def wrench_cases(
    seed: int, count: int, reach_m: float = 0.25, tilt_rad: float = 0.1
) -> list[tuple[np.ndarray, ...]]:
    """(A, b, offset, lower, upper, wish) of the INCA robot: unknowns are currents."""
    rng = np.random.default_rng(seed)
    cases = []
    for _ in range(count):
        pose = np.r_[rng.uniform(-reach_m, reach_m, 3), rng.uniform(-tilt_rad, tilt_rad, 3)]
        lengths, J = cables(pose)
        springs, per_A = STIFFNESS / DRUM_M**2 * lengths, TORQUE_N_M_A / DRUM_M
        wrench = np.r_[rng.uniform(-5, 5, 3), rng.uniform(-0.1, 0.1, 3)]
        lower = np.maximum(0.0, (1.48 - springs) / per_A)
        upper = np.minimum(3.0, (18.5 - springs) / per_A)
        wish = (10.0 - springs) / per_A
        cases.append(
            (np.ascontiguousarray(-J.T * per_A), wrench, -J.T @ springs, lower, upper, wish)
        )
    return cases
