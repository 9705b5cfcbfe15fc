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
from freeswing.cdpr.system.progress import Progress
from freeswing.servo.design.controller import Controller
from freeswing.servo.design.drawn_robots import DRAWS, Cloud
from freeswing.servo.design.offer import Order
from freeswing.servo.design.plant import Plant, plant_at
from freeswing.servo.design.schedule import Schedule, scheduled
from freeswing.servo.design.tuning import RATES_RAD_S
from freeswing.servo.synthesis.four_block import bare, weighted
from freeswing.servo.synthesis.norm import hinf_norm
from freeswing.servo.synthesis.state_space import Array, close
from freeswing.servo.tensions.robot_wrenches import held_at_rest

# A modulus margin below this is a loop that rings: failing, though not unstable yet.
FAILING = 0.2
LOOKS = 8  # along a ray, for a first place that fails
STEPS = 12  # bisections between two looks: to a thirty-thousandth of a ray
RAY_POINTS = 101  # of a ray, for what tensions hold: to a hundredth of it
# A margin gained that no one would see in a step: 0.41 and 0.49 overshoot alike.
WORTH = 0.1
PLACES = 7  # an axis of the box about all that tensions can hold
Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Found:
    """One plant under a controller: stable or not, margins with the delay, weighted norm."""

    stable: bool
    position: float
    orientation: float
    gamma: float | None = None

    @property
    def margin(self) -> float:
        """The smaller one; 0 for a loop that is not stable."""
        return min(self.position, self.orientation) if self.stable else 0.0

    @property
    def fails(self) -> bool:
        """Unstable, or so near that it rings."""
        return self.margin < FAILING

    def row(self) -> Row:
        """As robustness.json has it."""
        margins = {"position": self.position, "orientation": self.orientation}
        row: Row = {"stable": self.stable, "margins": margins}
        return row if self.gamma is None else row | {"gamma": self.gamma}


class Examiner:
    """Looks at one plant after another under one controller.

    Args:
        found: the controller.
        order: what it was designed for.
    """

    def __init__(self, found: Controller, order: Order) -> None:
        self._found = found
        self._weights = order.goals.weights.faster(found.weights_faster)
        self._response = found.system.at(RATES_RAD_S)
        self._late = np.exp(-1j * RATES_RAD_S * found.delay_s)[:, None, None]

    def look(self, plant: Plant, *, gamma: bool = True) -> Found:
        """Stability with the delay as an all-pass, margins at it, the weighted norm without."""
        controller = self._found.system
        stable = close(bare(plant.delayed()).plant, controller).is_stable()
        S = np.linalg.inv(np.eye(6) + plant.system.at(RATES_RAD_S) @ self._response * self._late)
        margins = [
            float(1.0 / np.linalg.norm(S[:, half, half], 2, axis=(1, 2)).max())
            for half in (slice(0, 3), slice(3, 6))
        ]
        if not gamma:
            return Found(stable, margins[0], margins[1])
        loop = close(weighted(plant.system, self._weights).plant, controller)
        norm = hinf_norm(loop, 1e-3).value if loop.is_stable() else np.inf
        return Found(stable, margins[0], margins[1], norm)


def survey_document(
    model: DrivenModel, found: Controller, order: Order, cloud: Cloud, progress: Progress
) -> Row:
    """The grid, the rays and the draws as robustness.json, with sentences."""
    examiner, schedule = Examiner(found, order), Schedule(model, np.array(order.at))
    delay = order.delay_s

    def fixed(pose: Array, gamma: bool = False) -> Found:
        return examiner.look(plant_at(model, pose, delay), gamma=gamma)

    def turned(pose: Array) -> Found:
        plant = scheduled(plant_at(model, pose, delay), schedule.factor(pose))
        return examiner.look(plant, gamma=False)

    grid = _grid(model, fixed, turned, progress)
    rays = _rays(model, fixed, turned, progress)
    draws = _draws(model, examiner, order, cloud, progress)
    return {
        "format": "freeswing-robustness/1",
        "method": "gridding: each plant examined as it is, no structured singular value",
        "controller": found.method,
        "grid": [row | {"scheduled": other.row()} for row, _, other in grid],
        "first_failures": rays,
        "draws": draws,
        "sentences": _sentences(grid, rays, draws),
    }


Look = Callable[[Array], Found]
Seen = tuple[Row, Found, Found]


def _grid(
    model: DrivenModel, fixed: Callable[..., Found], turned: Look, progress: Progress
) -> list[Seen]:
    """The upright places, of `PLACES` an axis, at which allowed tensions hold the platform."""
    reach = [max(held_shares(model, ray)) * ray[k] for k, ray in enumerate(_axes(model)[:3])]
    shares = np.linspace(-1.0, 1.0, PLACES)
    places = np.array([np.array([x, y, z]) * reach for x in shares for y in shares for z in shares])
    poses = np.hstack([places, np.zeros_like(places)])
    status = np.array(held_at_rest(model, poses).status)
    rows = []
    for pose in poses[status == "feasible"]:
        progress("workspace", len(rows) / len(poses))
        seen = fixed(pose, True)
        rows.append(({"position_m": pose[:3].tolist(), **seen.row()}, seen, turned(pose)))
    return rows


def _axes(model: DrivenModel) -> Array:
    """Ends of the six rays, (6, 6): nearly the frame, and 60 degrees."""
    reach = np.r_[np.abs(model.robot.entries_m).max(axis=0), np.full(3, np.pi / 3)]
    return 0.98 * np.diag(reach)


def held_shares(model: DrivenModel, direction: Array) -> tuple[float, float]:
    """How far either way along a ray allowed tensions hold the platform, as shares of it."""
    shares = np.linspace(0.0, 1.0, RAY_POINTS)
    ends = []
    for sign in (1.0, -1.0):
        status = held_at_rest(model, shares[:, None] * sign * direction).status
        lost = next((k for k, word in enumerate(status) if word != "feasible"), len(shares))
        ends.append(float(shares[max(lost - 1, 0)]))
    return ends[0], ends[1]


def _rays(model: DrivenModel, fixed: Look, turned: Look, progress: Progress) -> list[Row]:
    """Along each axis and angle: what tensions hold, and where the controller first fails."""
    rows = []
    for k, axis in enumerate(("x", "y", "z", "roll", "pitch", "yaw")):
        ray = _axes(model)[k]
        held = held_shares(model, ray)
        for sign, share in zip((1.0, -1.0), held, strict=True):
            progress("rays", (k + 0.5 * (sign < 0)) / 6)
            end = sign * ray[k]
            at = [_first_failure(look, sign * ray) for look in (fixed, turned)]
            fails = [None if one is None else one * end for one in at]
            rows.append(
                {"along": axis, "sign": sign, "held_to": share * end, "fails_at": fails[0],
                 "scheduled_fails_at": fails[1]}
            )  # fmt: skip
    return rows


def _first_failure(look: Look, ray: Array) -> float | None:
    """The share of a ray at which the controller first fails, by bisection; None if nowhere."""
    shares = np.linspace(0.0, 1.0, LOOKS + 1)[1:]
    first = next((float(share) for share in shares if look(share * ray).fails), None)
    if first is None:
        return None
    low, high = first - 1.0 / LOOKS, first
    for _ in range(STEPS):
        middle = (low + high) / 2
        low, high = (low, middle) if look(middle * ray).fails else (middle, high)
    return high


def _draws(
    model: DrivenModel, examiner: Examiner, order: Order, cloud: Cloud, progress: Progress
) -> Row:
    """`DRAWS` robots out of a cloud, at the pose of the design."""
    rng, at, rows = np.random.default_rng(0), np.array(order.at), []
    for k in range(DRAWS):
        progress("draws", k / DRAWS)
        theta, numbers = cloud.draw(model, rng)
        rows.append((examiner.look(plant_at(model, at, order.delay_s, theta)), numbers))
    worst, numbers = min(rows, key=lambda row: row[0].margin)
    return {
        "count": DRAWS,
        "source": cloud.source,
        "note": cloud.note,
        "std": {
            names[0]: float(np.sqrt(variance))
            for names, variance in zip(cloud.members, np.diag(cloud.covariance), strict=True)
        },
        "unstable": sum(not seen.stable for seen, _ in rows),
        "failing": sum(seen.fails for seen, _ in rows),
        "worst": worst.row() | {"margin": worst.margin, "numbers": numbers},
        "gamma_largest": max(seen.gamma or 0.0 for seen, _ in rows),
    }


def _sentences(grid: list[Seen], rays: list[Row], draws: Row) -> list[str]:
    said = ["no place is held by allowed tensions: there is no workspace to examine"]
    if grid:
        fixed, turned = [seen for _, seen, _ in grid], [seen for _, _, seen in grid]
        least = min(range(len(grid)), key=lambda k: fixed[k].margin)
        said = [
            f"of {len(grid)} places that allowed tensions hold it is stable at "
            f"{sum(seen.stable for seen in fixed)} and fails (margin below {FAILING:g} or none) "
            f"at {sum(seen.fails for seen in fixed)}; the least margin is "
            f"{fixed[least].margin:.3f} at "
            f"{_place(grid[least][0]['position_m'])}",
            _pays(fixed[least].margin, min(seen.margin for seen in turned)),
        ]
    for row in rays:
        if row["sign"] > 0.0:
            said.append(_along(row))
    said.append(
        f"of {draws['count']} robots drawn from {draws['source']} {draws['unstable']} are unstable "
        f"and {draws['failing']} fail; the worst margin is {draws['worst']['margin']:.3f}, the "
        f"largest gamma {draws['gamma_largest']:.3f}"
    )
    return said + ([draws["note"]] if draws["note"] else [])


def _pays(fixed: float, turned: float) -> str:
    """Whether scheduling is worth its name here."""
    if fixed >= FAILING and turned - fixed < WORTH:
        return f"scheduling the wrench by the pose does not pay: {turned:.3f} instead"
    return f"the wrench scheduled by the pose (servo --schedule) keeps {turned:.3f} instead"


def _along(row: Row) -> str:
    unit = "m" if row["along"] in ("x", "y", "z") else "rad"
    ends = [
        f"{name} nowhere up to the frame or 60 degrees" if row[key] is None
        else f"{name} at {row[key]:.3g} {unit}"
        for key, name in (("fails_at", "fails"), ("scheduled_fails_at", "scheduled"))
    ]  # fmt: skip
    held = f"tensions hold it to {row['held_to']:.3g} {unit}"
    return f"along {row['along']} the controller {', '.join(ends)}; {held}"


def _place(position: list[float]) -> str:
    return f"({', '.join(f'{value:.3f}' for value in position)}) m"
