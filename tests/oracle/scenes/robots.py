"""The two robots of the tests as their owners declare them, and plausible true bodies.

Sources: `bologna-4` is Table 1 and eq. (43) of Ida, Briot, Carricato 2022; `three-cable` is Table 1
of the self-calibration paper (2019) with the third attachment at x = -0.211 m: the printed plus
sign puts two attachments 4 cm apart and contradicts the pose and lengths the paper gives.
"""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.robot import Cable, Platform, Robot
from tests.oracle.mechanics.world import Array, Body

_X, _Y, _Z = np.eye(3)
MASS_KG = 8.0
# Principal specific inertias about the centre of mass, m2.
_COM_INERTIA = {"bologna-4": (0.0149, 0.0329, 0.0370), "three-cable": (0.0190, 0.0215, 0.0330)}
_COM_HEIGHT_M = {"bologna-4": 0.19, "three-cable": 0.182}


def declared_robot(name: str) -> Robot:
    """`bologna-4` or `three-cable`, nominal inertia included.

    Raises:
        ValueError: another name.
    """
    if name not in _COM_HEIGHT_M:
        raise ValueError(f"robot {name!r} is not known; there are {sorted(_COM_HEIGHT_M)}")
    body = nominal_body(name)
    platform = Platform(body.mass_kg, body.com_m, body.specific_inertia_m2)
    cables, free = (
        (_bologna_cables(), ("x", "y"))
        if name == "bologna-4"
        else (_three_cables(), ("x", "y", "chi"))
    )
    return Robot(name=name, cables=cables, free_coordinates=free, platform=platform)


def nominal_body(name: str) -> Body:
    """The CAD values."""
    com = np.array([0.0, 0.0, _COM_HEIGHT_M[name]])
    return Body(MASS_KG, com, about_p(np.diag(_COM_INERTIA[name]), com))


def true_body(name: str, rng: np.random.Generator) -> Body:
    """A body a few percent off the CAD values: mass, centre, principal inertias, axes."""
    com = np.array([0.0, 0.0, _COM_HEIGHT_M[name]]) + rng.normal(0.0, [0.004, 0.004, 0.005])
    principal = np.array(_COM_INERTIA[name]) * (1.0 + rng.uniform(-0.05, 0.05, 3))
    axes = np.linalg.qr(np.eye(3) + rng.normal(0.0, 0.04, (3, 3)))[0]
    mass = MASS_KG * (1.0 + rng.uniform(-0.04, 0.04))
    return Body(mass, com, about_p(axes @ np.diag(principal) @ axes.T, com))


def about_p(specific_inertia_com: Array, com: Array) -> Array:
    """Specific inertia entries (6,) about P of a tensor (3, 3) about the centre of mass."""
    moved = specific_inertia_com + (com @ com * np.eye(3) - np.outer(com, com))
    return moved[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


def with_eyelets(robot: Robot) -> Robot:
    """The same robot with every pulley shrunk to a fixed eyelet at D."""
    cables = tuple(
        Cable(c.name, c.entry_m, 0.0, c.attachment_m, c.swivel_x, c.swivel_y, c.swivel_z)
        for c in robot.cables
    )
    return Robot(robot.name, cables, robot.gravity_m_s2, robot.free_coordinates, robot.platform)


def _bologna_cables() -> tuple[Cable, ...]:
    rows = (
        ([0.219, -1.316, 0.527], [-0.144, -0.219, 0.264], _Y, -_Z, -_X),
        ([2.295, -1.158, 0.521], [0.115, -0.233, 0.270], -_X, -_Z, -_Y),
        ([2.153, 0.973, 0.560], [0.142, 0.220, 0.266], -_Y, -_Z, _X),
        ([0.0532, 0.796, 0.532], [-0.120, 0.236, 0.266], _X, -_Z, _Y),
    )
    return _cables(rows)


def _three_cables() -> tuple[Cable, ...]:
    rows = (
        ([-2.030, -0.170, 0.806], [0.020, -0.287, 0.250], _Y, -_Z, -_X),
        ([0.066, 0.920, 0.757], [0.251, 0.153, 0.250], -_X, -_Z, -_Y),
        ([-2.043, 2.241, 0.738], [-0.211, 0.153, 0.250], -_Y, _Z, -_X),
    )
    return _cables(rows)


def _cables(rows: tuple) -> tuple[Cable, ...]:
    return tuple(
        Cable(str(k + 1), np.array(d), 0.025, np.array(a), x, y, z)
        for k, (d, a, x, y, z) in enumerate(rows)
    )
