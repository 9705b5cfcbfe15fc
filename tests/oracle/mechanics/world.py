"""What the simulated world really is: geometry, body, forces and disturbances, as plain arrays.

Everything is SI in the base frame unless a field says "platform frame". A neutral value (0) of a
field leaves its effect out. The tuple goes straight into the compiled integrator.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Body:
    """A rigid body seen from P, platform frame.

    Attributes:
        mass_kg: mass.
        com_m: P to centre of mass, (3,).
        specific_inertia_m2: xx yy zz xy xz yz about P over the mass (tensor entries), (6,).
    """

    mass_kg: float
    com_m: Array
    specific_inertia_m2: Array

    @property
    def inertia_p(self) -> Array:
        """Inertia tensor about P, kg m2, (3, 3)."""
        return self.mass_kg * tensor(self.specific_inertia_m2)

    @property
    def inertia_com(self) -> Array:
        """Inertia tensor about the centre of mass, kg m2, (3, 3)."""
        c = np.asarray(self.com_m, dtype=float)
        return self.inertia_p - self.mass_kg * (c @ c * np.eye(3) - np.outer(c, c))


def tensor(entries: Array) -> Array:
    """The symmetric (3, 3) matrix of entries xx yy zz xy xz yz."""
    xx, yy, zz, xy, xz, yz = entries
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], dtype=float)


class World(NamedTuple):
    """All constants of one run (n cables)."""

    entry: Array  # (n, 3) D
    radius: Array  # (n,)
    swivel: Array  # (n, 3, 3) rows x, y, z
    attach: Array  # (n, 3) A, platform frame
    mass: float
    com: Array  # (3,) platform frame
    inertia: Array  # (3, 3) about P, kg m2, platform frame
    gravity: Array  # (3,)
    length: Array  # (n,) held lengths at t = 0 (unstretched when elastic)
    creep: Array  # (n,) m/s
    hunting: Array  # (n,) amplitude of a periodic length, m
    hunting_hz: float
    hunting_phase: float
    stiffness_ea: float  # N; 0 = rigid cables
    hook: Array  # (n,) N/m against moving sideways, of elastic cables' entries; 0 = fixed
    relaxation: float  # s, material damping: T = EA (e + relaxation de/dt)
    density: float  # kg/m
    drag: float  # N s/m
    drag_quadratic: float  # N s2/m2
    drag_point: Array  # (3,) where both act, platform frame
    drag_angular: float  # N m s/rad
    swivel_coulomb: Array  # (n,) N m
    swivel_viscous: Array  # (n,) N m s/rad
    bending: Array  # (n,) loss coefficient c: torque c r T against a change of the wrap angle
    force: Array  # (3,) constant, N
    force_point: Array  # (3,) platform frame
    oscillators: Array  # (k, 6) rows: Hz, phase, force N (3), Hz/s; act at force_point
    tether_anchor: Array  # (3,)
    tether_point: Array  # (3,) platform frame
    tether_stiffness: float  # N/m
    tether_rest: float  # m, slack below it
    torsion: float  # N m/rad about the vertical
    torsion_yaw: float  # rad, neutral heading of the platform's x axis
    wall_normal: Array  # (3,) unit, pointing out of the free side
    wall_offset: float  # m, contact where normal . p > offset
    wall_stiffness: float  # N/m
    wall_damping: float  # N s/m
    magnet: Array  # (3,) place of the pole
    magnet_strength: float  # N m4: attraction strength / distance**4
    rotor: Array  # (3,) angular momentum of a spinning rotor, platform frame, N m s
    bob_mass: float  # kg, a ball hung on the platform
    bob_length: float  # m
    bob_pivot: Array  # (3,) platform frame
    bob_damping: float  # N s/m


def plain_world(robot: Robot, body: Body, lengths_m: Array | None = None) -> World:
    """The robot as declared with the given true body, and not one effect."""
    n, zero3 = robot.n_cables, np.zeros(3)
    return World(
        entry=_copy(robot.entries_m),
        radius=_copy(robot.radii_m),
        swivel=_copy(robot.swivel_axes),
        attach=_copy(robot.attachments_m),
        mass=float(body.mass_kg),
        com=_copy(body.com_m),
        inertia=_copy(body.inertia_p),
        gravity=_copy(robot.gravity_m_s2),
        length=np.ones(n) if lengths_m is None else _copy(lengths_m),
        creep=np.zeros(n),
        hunting=np.zeros(n),
        hunting_hz=0.0,
        hunting_phase=0.0,
        stiffness_ea=0.0,
        hook=np.zeros(n),
        relaxation=0.0,
        density=0.0,
        drag=0.0,
        drag_quadratic=0.0,
        drag_point=zero3,
        drag_angular=0.0,
        swivel_coulomb=np.zeros(n),
        swivel_viscous=np.zeros(n),
        bending=np.zeros(n),
        force=zero3,
        force_point=zero3,
        oscillators=np.zeros((0, 6)),
        tether_anchor=zero3,
        tether_point=zero3,
        tether_stiffness=0.0,
        tether_rest=0.0,
        torsion=0.0,
        torsion_yaw=0.0,
        wall_normal=zero3,
        wall_offset=0.0,
        wall_stiffness=0.0,
        wall_damping=0.0,
        magnet=zero3,
        magnet_strength=0.0,
        rotor=zero3,
        bob_mass=0.0,
        bob_length=0.0,
        bob_pivot=zero3,
        bob_damping=0.0,
    )


def _copy(values: object) -> Array:
    return np.array(values, dtype=np.float64, order="C")
