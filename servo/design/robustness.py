"""How far a controller carries: over the workspace, and over robots that are not as declared.

Both by gridding, not by a structured singular value: every plant is examined as it is, so that
what is said holds for the plants that were looked at and for no others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.servo.design.controller import Controller
from freeswing.servo.design.offer import Order, offer
from freeswing.servo.design.plant import Plant, plant_at
from freeswing.servo.design.tuning import RATES_RAD_S
from freeswing.servo.synthesis.four_block import bare, weighted
from freeswing.servo.synthesis.norm import hinf_norm
from freeswing.servo.synthesis.state_space import Array, close

# A modulus margin below this is a loop that rings: failing, though not unstable yet.
FAILING = 0.2
DRAWS = 200
# Relative std of what identification gives (Table 1 of the paper), where no result states it.
TABLE_1_STD = {
    "Lx_m": 0.068, "Ly_m": 0.070, "Lz_m": 0.054, "arm_m": 0.187, "theta_xy_rad": 0.006,
    "theta_xz_rad": 0.003, "drum_m": 0.010, "mass_kg": 0.003, "Ixx_kg_m2": 0.103,
    "Iyy_kg_m2": 0.130, "Izz_kg_m2": 0.130, "motor_inertia_kg_m2": 0.004,
    "viscous_N_m_s": 0.038, "spring_N_m": 0.0005,
}  # fmt: skip
STEPS = 12  # bisections of a ray: to a four-thousandth of it


@dataclass(frozen=True, slots=True)
class Found:
    """One plant under a controller: stable or not, margins with the delay, weighted norm."""

    stable: bool
    position: float
    orientation: float
    gamma: float

    @property
    def fails(self) -> bool:
        """Unstable, or so near that it rings."""
        return not self.stable or min(self.position, self.orientation) < FAILING


def look_at(found: Controller, plant: Plant, order: Order) -> Found:
    """Examine one plant under one controller."""
    stable = close(bare(plant.delayed()).plant, found.system).is_stable()
    response = plant.system.at(RATES_RAD_S) @ found.system.at(RATES_RAD_S)
    late = np.exp(-1j * RATES_RAD_S * found.delay_s)[:, None, None]
    S = np.linalg.inv(np.eye(6) + response * late)
    margins = [
        float(1.0 / np.linalg.norm(S[:, half, half], 2, axis=(1, 2)).max())
        for half in (slice(0, 3), slice(3, 6))
    ]
    loop = close(weighted(plant.system, order.goals.weights).plant, found.system)
    gamma = hinf_norm(loop, 1e-3).value if loop.is_stable() else np.inf
    return Found(stable, margins[0], margins[1], gamma)


def survey_document(
    model: DrivenModel, order: Order, progress: Callable[[str, float], None]
) -> dict[str, Any]:
    """The grid, the rays and the draws as robustness.json, with sentences."""
    found = offer(model, "hinf", order)
    delay = order.plant(model).delay_s

    def at(pose: Array, theta: Array | None = None) -> Found:
        return look_at(found, plant_at(model, pose, delay, theta), order)

    grid = _grid(model, at, progress)
    rays = _rays(model, at, progress)
    draws = _draws(model, order, at, progress)
    return {
        "format": "freeswing-robustness/1",
        "method": "gridding: each plant examined as it is, no structured singular value",
        "grid": grid,
        "first_failures": rays,
        "draws": draws,
        "sentences": _sentences(grid, rays, draws),
    }


Look = Callable[..., Found]


def _grid(
    model: DrivenModel, at: Look, progress: Callable[[str, float], None]
) -> list[dict[str, Any]]:
    """Five places an axis in the middle 60 % of the frame."""
    reach = 0.6 * np.abs(model.robot.entries_m).max(axis=0)
    shares = np.linspace(-1.0, 1.0, 5)
    rows = []
    places = [np.array([x, y, z]) for x in shares for y in shares for z in shares]
    for k, share in enumerate(places):
        progress("workspace", k / len(places))
        seen = at(np.concatenate([share * reach, np.zeros(3)]))
        rows.append({"position_m": (share * reach).tolist(), **_row(seen)})
    return rows


def _rays(
    model: DrivenModel, at: Look, progress: Callable[[str, float], None]
) -> list[dict[str, Any]]:
    """Along each axis and angle from the centre: where the controller first fails, by bisection."""
    reach = np.r_[np.abs(model.robot.entries_m).max(axis=0), np.full(3, np.pi / 3)]
    rows = []
    for k, axis in enumerate(("x", "y", "z", "roll", "pitch", "yaw")):
        for sign in (1.0, -1.0):
            progress("rays", (k + 0.5 * (sign < 0)) / 6)
            direction = np.eye(6)[k] * sign * 0.98 * reach[k]
            shares = np.linspace(0.0, 1.0, 9)[1:]
            first = next((s for s in shares if at(s * direction).fails), None)
            if first is None:
                rows.append({"along": axis, "sign": sign, "fails_at": None})
                continue
            low, high = first - 1.0 / 8, first
            for _ in range(STEPS):
                middle = (low + high) / 2
                low, high = (low, middle) if at(middle * direction).fails else (middle, high)
            rows.append({"along": axis, "sign": sign, "fails_at": float(high * direction[k])})
    return rows


def _draws(
    model: DrivenModel, order: Order, at: Look, progress: Callable[[str, float], None]
) -> dict[str, Any]:
    """The worst of `DRAWS` robots about the declared one, numbers independent of each other."""
    rng = np.random.default_rng(0)
    rows = []
    for k in range(DRAWS):
        progress("draws", k / DRAWS)
        changes = {
            name: float(
                model.declared[model.index(name)] * max(1.0 + std * rng.standard_normal(), 0.1)
            )
            for name, std in TABLE_1_STD.items()
            if name in model.names
        }
        rows.append(at(np.array(order.at), model.theta(changes)))
    worst = min(rows, key=lambda seen: (seen.stable, min(seen.position, seen.orientation)))
    return {
        "count": DRAWS,
        "relative_std": {k: v for k, v in TABLE_1_STD.items() if k in model.names},
        "unstable": sum(not seen.stable for seen in rows),
        "failing": sum(seen.fails for seen in rows),
        "worst": _row(worst),
        "gamma_largest": max(seen.gamma for seen in rows),
    }


def _row(seen: Found) -> dict[str, Any]:
    return {
        "stable": seen.stable,
        "margins": {"position": seen.position, "orientation": seen.orientation},
        "gamma": seen.gamma,
    }


def _sentences(
    grid: list[dict[str, Any]], rays: list[dict[str, Any]], draws: dict[str, Any]
) -> list[str]:
    held = sum(bool(row["stable"]) for row in grid)
    said = [f"stable at {held} of {len(grid)} places in the middle 60 % of the frame"]
    failing = [row for row in rays if row["fails_at"] is not None]
    if failing:
        first = ", ".join(f"{row['along']} = {row['fails_at']:.3g}" for row in failing)
        said.append(f"first fails (margin below {FAILING:g} or unstable) at {first} (m, rad)")
    else:
        said.append("fails nowhere along the six axes within the frame and 60 degrees")
    worst = draws["worst"]
    said.append(
        f"of {draws['count']} robots drawn about this one {draws['unstable']} are unstable and "
        f"{draws['failing']} below a margin of {FAILING:g}; the worst margin is "
        f"{min(worst['margins'].values()):.3f}"
    )
    return said
