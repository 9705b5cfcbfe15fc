"""What really happened in the demonstration: robot, body, an undeclared effect, the swings.

The robot and the cable lengths of the swings are those of Ida, Briot, Carricato 2022 (Tables 1
and 2, eq. 43; columns that are near-singular in x, y are left out).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import Array, Cable, Platform, Robot
from freeswing.cdpr.simulation.free_swing import Motion, simulate
from freeswing.cdpr.simulation.release import release, rest_at_lengths

EFFECT = "translational_drag"
EFFECT_VALUES = (0.05, 0.6)
NOMINAL_COM_M = (0.0, 0.0, 0.19)
NOMINAL_INERTIA_M2 = (0.051, 0.069, 0.037, 0.0, 0.0, 0.0)
TRUE_INERTIA = np.array([0.0016, -0.0025, 0.196, 0.0538, 0.0661, 0.0352, 2e-4, -9e-4, 7e-4])
SWINGS = (
    ("swing-01", "identify", (1.30, 1.26, 1.57, 1.56)),
    ("swing-02", "identify", (1.52, 1.26, 1.27, 1.50)),
    ("swing-03", "identify", (1.19, 1.15, 1.65, 1.65)),
    ("swing-04", "identify", (1.43, 1.37, 1.27, 1.30)),
    ("swing-05", "identify", (1.35, 1.45, 1.42, 1.28)),
    ("check-01", "validate", (1.38, 1.39, 1.36, 1.32)),
    ("check-02", "validate", (1.16, 1.17, 1.63, 1.59)),
)
SWING_AMPLITUDE_M = 0.035


@dataclass(frozen=True, slots=True)
class Swing:
    """One swing as it was.

    Attributes:
        name: of the run.
        role: identify or validate.
        lengths_m: of the locked cables, (n,).
        motion: from the release on, starting at 0 s.
    """

    name: str
    role: str
    lengths_m: Array
    motion: Motion


def demo_robot() -> Robot:
    """The robot as its files declare it."""
    x, y, z = np.eye(3)
    rows = (
        ((0.219, -1.316, 0.527), (-0.144, -0.219, 0.264), y, -x),
        ((2.295, -1.158, 0.521), (0.115, -0.233, 0.270), -x, -y),
        ((2.153, 0.973, 0.560), (0.142, 0.220, 0.266), -y, x),
        ((0.0532, 0.796, 0.532), (-0.120, 0.236, 0.266), x, y),
    )
    cables = tuple(
        Cable(str(k), np.array(entry), 0.025, np.array(attachment), swivel_x, -z, swivel_z)
        for k, (entry, attachment, swivel_x, swivel_z) in enumerate(rows, start=1)
    )
    platform = Platform(8.0, np.array(NOMINAL_COM_M), np.array(NOMINAL_INERTIA_M2))
    return Robot("demo-4", cables, free_coordinates=("x", "y"), platform=platform)


def demo_swings(
    generator: np.random.Generator,
    duration_s: float,
    effect_values: tuple[float, float] = EFFECT_VALUES,
    names: tuple[str, ...] | None = None,
) -> tuple[Swing, ...]:
    """The swings of those names (all: None), each released at rest beside its own equilibrium.

    Which ones are asked for does not change them.
    """
    model = build_model(demo_robot(), (EFFECT,))
    values = np.array(effect_values)
    swings = []
    for name, role, lengths in SWINGS:
        rest = rest_at_lengths(model, np.array(lengths), TRUE_INERTIA, values, generator)
        zeta = release(model, rest, TRUE_INERTIA, values, SWING_AMPLITUDE_M, generator)
        if names is not None and name not in names:
            continue
        span = (0.0, duration_s)
        motion = simulate(model, zeta, np.zeros(6), span, TRUE_INERTIA, values)
        swings.append(Swing(name, role, rest.lengths_m, motion))
    return tuple(swings)
