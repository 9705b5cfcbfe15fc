"""Undeclared effects by name and size: what is added to the truth and never told.

`add_effect(scene, name, size, rng)`: the size is "small", "medium", "large" or a number in the
unit of `MAGNITUDES[name]`; whatever else the effect needs (a cable, a direction, a frequency) is
drawn from the generator and recorded. Effects of `outside.py` lie outside the product's catalogue.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tests.oracle.mechanics.world import Array, World

SIZES = ("small", "medium", "large")


@dataclass(frozen=True, slots=True)
class Scene:
    """The truth of a session.

    Attributes:
        world: physics, with the lengths of no run in particular.
        centre_m: middle of the workspace, base frame, (3,).
        heading_rad: usual heading of the platform.
        length_bias_m: told minus true lengths, (n,).
        marker_offset_m: measured point minus P, platform frame, (3,).
        orientation_delay_s: orientation samples show the platform so much earlier.
        clock_rate: stamps run fast by this share.
        random_phase: oscillating forces start anew at every run.
        stop_share: a stop is set up afresh in every run, at this share of the displacement.
        record: name, size and drawn parameters of every effect.
    """

    world: World
    centre_m: Array
    heading_rad: float
    length_bias_m: Array
    marker_offset_m: Array = field(default_factory=lambda: np.zeros(3))
    orientation_delay_s: float = 0.0
    clock_rate: float = 0.0
    random_phase: bool = False
    stop_share: float | None = None
    record: tuple[dict[str, Any], ...] = ()

    @property
    def n_cables(self) -> int:
        """Number of cables n."""
        return len(self.world.radius)


Effect = Callable[[Scene, float, np.random.Generator], tuple[Scene, dict[str, Any]]]

MAGNITUDES: dict[str, tuple[str, float, float, float]] = {
    "translational_drag": ("rate_1_s", 0.005, 0.02, 0.08),
    "rotational_drag": ("damping_nms", 0.004, 0.016, 0.06),
    "quadratic_drag": ("coefficient_ns2_m2", 0.1, 0.4, 1.6),
    "swivel_friction": ("torque_nm", 0.002, 0.006, 0.02),
    "swivel_viscous": ("damping_nms", 0.01, 0.04, 0.15),
    "pulley_friction": ("coefficient", 0.01, 0.03, 0.1),
    "cable_elasticity": ("stiffness_ea_n", 2e5, 6e4, 1.5e4),
    "cable_mass": ("density_kg_m", 0.003, 0.01, 0.035),
    "gravity_tilt": ("angle_rad", 0.0035, 0.0105, 0.035),
    "marker_offset": ("distance_m", 0.002, 0.005, 0.015),
    "cable_length_bias": ("bias_m", 0.001, 0.003, 0.01),
    "anchor_offset": ("distance_m", 0.002, 0.005, 0.015),
    "attachment_offset": ("distance_m", 0.001, 0.003, 0.01),
    "pulley_radius": ("excess_m", 0.001, 0.003, 0.008),
    "pulley_axis": ("angle_rad", 0.035, 0.087, 0.21),
    "tether": ("stiffness_n_m", 1.0, 4.0, 15.0),
    "torsion_spring": ("stiffness_nm_rad", 0.1, 0.4, 1.5),
    "constant_force": ("force_n", 0.1, 0.3, 1.0),
    "harmonic_force": ("amplitude_n", 0.03, 0.1, 0.4),
    "winch_creep": ("rate_m_s", 1e-5, 4e-5, 1.5e-4),
    "clock_offset": ("delay_s", 0.002, 0.006, 0.02),
}


def magnitude(table: dict[str, tuple[str, float, float, float]], name: str, size: object) -> float:
    """The number behind "small", "medium" or "large", or the number itself.

    Raises:
        ValueError: a name or a size that is not known.
    """
    if name not in table:
        raise ValueError(f"effect {name!r} is not known; there are {sorted(table)}")
    if isinstance(size, int | float):
        return float(size)
    if size not in SIZES:
        raise ValueError(f"size {size!r} of {name} must be a number or one of {SIZES}")
    _, small, medium, large = table[name]
    return (small, medium, large)[SIZES.index(str(size))]


def random_direction(rng: np.random.Generator, flat: bool = False) -> Array:
    """A unit vector; horizontal when flat."""
    vector = rng.normal(size=3)
    if flat:
        vector[2] = 0.0
    return vector / np.linalg.norm(vector)


def turned(vectors: Array, axis: Array, angle: float) -> Array:
    """Rows of `vectors` (..., 3) turned about a unit axis (Rodrigues)."""
    across = np.cross(axis, vectors)
    along = (vectors @ axis)[..., None] * axis
    return vectors * math.cos(angle) + across * math.sin(angle) + along * (1.0 - math.cos(angle))


def changed(scene: Scene, **fields: Any) -> Scene:
    """The scene with fields of its world replaced."""
    return replace(scene, world=scene.world._replace(**fields))


def _per_cable(scene: Scene, value: float) -> Array:
    return np.full(scene.n_cables, value)


def _translational_drag(scene: Scene, rate: float, rng: np.random.Generator):
    """Force -mass rate v at P, v the velocity of P."""
    return changed(scene, drag=rate * scene.world.mass), {}


def _rotational_drag(scene: Scene, damping: float, rng: np.random.Generator):
    """Moment -damping omega."""
    return changed(scene, drag_angular=damping), {}


def _quadratic_drag(scene: Scene, coefficient: float, rng: np.random.Generator):
    """Force -coefficient |v| v at P."""
    return changed(scene, drag_quadratic=coefficient), {}


def _swivel_friction(scene: Scene, torque: float, rng: np.random.Generator):
    """Dry torque against the swivel rate of every pulley, the same at any load."""
    return changed(scene, swivel_coulomb=_per_cable(scene, torque)), {}


def _swivel_viscous(scene: Scene, damping: float, rng: np.random.Generator):
    """Torque -damping times the swivel rate of every pulley."""
    return changed(scene, swivel_viscous=_per_cable(scene, damping)), {}


def _pulley_friction(scene: Scene, coefficient: float, rng: np.random.Generator):
    """Dry torque coefficient r T against the wrap angle's rate: the cable is bent on and off."""
    return changed(scene, bending=_per_cable(scene, coefficient)), {}


def _cable_elasticity(scene: Scene, stiffness: float, rng: np.random.Generator):
    """Every cable a damped spring of EA over its held length; real vibration, not statics."""
    return changed(scene, stiffness_ea=stiffness, relaxation=1e-3), {"relaxation_s": 1e-3}


def _cable_mass(scene: Scene, density: float, rng: np.random.Generator):
    """Straight heavy cables: a third of their mass moves with A, half their weight hangs on it."""
    return changed(scene, density=density), {}


def _gravity_tilt(scene: Scene, angle: float, rng: np.random.Generator):
    """Gravity turned about a horizontal axis: the base frame is not level."""
    gravity = turned(scene.world.gravity, random_direction(rng, flat=True), angle)
    return changed(scene, gravity=gravity), {"gravity_m_s2": gravity}


def _marker_offset(scene: Scene, distance: float, rng: np.random.Generator):
    """The measured point is P plus a shift in the platform frame."""
    offset = distance * random_direction(rng)
    return replace(scene, marker_offset_m=offset), {"offset_m": offset}


def _cable_length_bias(scene: Scene, bias: float, rng: np.random.Generator):
    """Told lengths wrong by 0.5 to 1 times the size, each sign at random, all runs alike."""
    n = scene.n_cables
    biases = bias * rng.choice([-1.0, 1.0], n) * rng.uniform(0.5, 1.0, n)
    return replace(scene, length_bias_m=biases), {"told_minus_true_m": biases}


def _moved_point(scene: Scene, points: Array, distance: float, rng: np.random.Generator):
    k = int(rng.integers(len(points)))
    offset = distance * random_direction(rng)
    moved = points.copy()
    moved[k] += offset
    return moved, {"cable": k, "true_minus_told_m": offset}


def _anchor_offset(scene: Scene, distance: float, rng: np.random.Generator):
    """One cable's entry point lies elsewhere than declared."""
    entry, drawn = _moved_point(scene, scene.world.entry, distance, rng)
    return changed(scene, entry=entry), drawn


def _attachment_offset(scene: Scene, distance: float, rng: np.random.Generator):
    """One cable's attachment lies elsewhere than declared."""
    attach, drawn = _moved_point(scene, scene.world.attach, distance, rng)
    return changed(scene, attach=attach), drawn


def _pulley_radius(scene: Scene, excess: float, rng: np.random.Generator):
    """All pulleys larger than declared (cable thickness, groove depth)."""
    return changed(scene, radius=scene.world.radius + excess), {"cable": "all"}


def _pulley_axis(scene: Scene, angle: float, rng: np.random.Generator):
    """One pulley's swivel frame turned about an axis perpendicular to its swivel axis."""
    k = int(rng.integers(scene.n_cables))
    swivel = scene.world.swivel.copy()
    across = math.tau * rng.random()
    axis = math.cos(across) * swivel[k, 0] + math.sin(across) * swivel[k, 1]
    swivel[k] = turned(swivel[k], axis, angle)
    return changed(scene, swivel=swivel), {"cable": k, "axis": axis}


def _tether(scene: Scene, stiffness: float, rng: np.random.Generator):
    """A spring from a fixed point to a point near P, slack below its rest length."""
    away = random_direction(rng, flat=True)
    anchor = scene.centre_m + 1.2 * away + np.array([0.0, 0.0, rng.uniform(0.2, 0.8)])
    point = np.array([0.1, 0.1, 0.05]) * rng.uniform(-1.0, 1.0, 3)
    rest = 0.6 * float(np.linalg.norm(anchor - scene.centre_m))
    fields = {"tether_anchor": anchor, "tether_point": point, "tether_rest": rest}
    return changed(scene, tether_stiffness=stiffness, **fields), fields


def _torsion_spring(scene: Scene, stiffness: float, rng: np.random.Generator):
    """Energy stiffness h^2 / 2 of the heading h from its neutral value."""
    yaw = scene.heading_rad + rng.uniform(-0.2, 0.2)
    return changed(scene, torsion=stiffness, torsion_yaw=yaw), {"neutral_yaw_rad": yaw}


def _constant_force(scene: Scene, size: float, rng: np.random.Generator):
    """A horizontal force at P, fixed in the base frame."""
    force = size * random_direction(rng, flat=True)
    return changed(scene, force=force), {"force_vector_n": force, "at": "P"}


def _harmonic_force(scene: Scene, amplitude: float, rng: np.random.Generator):
    """A horizontal sine force at P; its phase at release is new in every run."""
    hz, direction = rng.uniform(0.7, 3.5), random_direction(rng, flat=True)
    row = np.array([[hz, 0.0, *(amplitude * direction), 0.0]])
    scene = replace(changed(scene, oscillators=row), random_phase=True)
    return scene, {"frequency_hz": hz, "direction": direction, "phase": "new in every run"}


def _winch_creep(scene: Scene, rate: float, rng: np.random.Generator):
    """All cables run out, each at 0.6 to 1.4 times the size, from the release on."""
    rates = rate * rng.uniform(0.6, 1.4, scene.n_cables)
    return changed(scene, creep=rates), {"rates_m_s": rates}


def _clock_offset(scene: Scene, delay: float, rng: np.random.Generator):
    """Orientation samples come from an instrument that lags behind the positions."""
    return replace(scene, orientation_delay_s=delay), {"of": "orientation after position"}


EFFECTS: dict[str, Effect] = {
    "translational_drag": _translational_drag,
    "rotational_drag": _rotational_drag,
    "quadratic_drag": _quadratic_drag,
    "swivel_friction": _swivel_friction,
    "swivel_viscous": _swivel_viscous,
    "pulley_friction": _pulley_friction,
    "cable_elasticity": _cable_elasticity,
    "cable_mass": _cable_mass,
    "gravity_tilt": _gravity_tilt,
    "marker_offset": _marker_offset,
    "cable_length_bias": _cable_length_bias,
    "anchor_offset": _anchor_offset,
    "attachment_offset": _attachment_offset,
    "pulley_radius": _pulley_radius,
    "pulley_axis": _pulley_axis,
    "tether": _tether,
    "torsion_spring": _torsion_spring,
    "constant_force": _constant_force,
    "harmonic_force": _harmonic_force,
    "winch_creep": _winch_creep,
    "clock_offset": _clock_offset,
}


def add_effect(
    scene: Scene,
    name: str,
    size: object,
    rng: np.random.Generator,
    table: dict[str, tuple[str, float, float, float]] = MAGNITUDES,
    effects: dict[str, Effect] = EFFECTS,
) -> Scene:
    """The scene with one more effect, recorded.

    Raises:
        ValueError: a name or a size that is not known.
    """
    value = magnitude(table, name, size)
    scene, drawn = effects[name](scene, value, rng)
    entry = {"effect": name, "size": size, table[name][0]: value, **drawn}
    return replace(scene, record=(*scene.record, entry))
