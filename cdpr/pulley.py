"""Cables over swivel pulleys as symbolic expressions, written once.

Swivel frame, wrap and length follow self-calibration 2019, eqs. (2)-(8), solved in closed form.
A radius of zero is an eyelet at D; nothing else changes.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from cdpr.body import Expression
from cdpr.robot import Robot


@dataclass(frozen=True, slots=True)
class Geometry:
    """What effects may displace: expressions or numbers for one cable after another.

    Attributes:
        entries: D in the base frame, each (3,).
        radii: r, each a scalar.
        attachments: A in the platform frame, each (3,).
        axes: rows x, y, z of the swivel frame in the base frame, each (3, 3).
        gravity: gravity in the base frame, (3,).
    """

    entries: tuple[Expression, ...]
    radii: tuple[Expression, ...]
    attachments: tuple[Expression, ...]
    axes: tuple[Expression, ...]
    gravity: Expression

    @classmethod
    def of(cls, robot: Robot) -> Geometry:
        """The declared geometry of a robot."""
        cables = robot.cables
        return cls(
            entries=tuple(ca.SX(ca.DM(c.entry_m)) for c in cables),
            radii=tuple(ca.SX(c.pulley_radius_m) for c in cables),
            attachments=tuple(ca.SX(ca.DM(c.attachment_m)) for c in cables),
            axes=tuple(ca.SX(ca.DM(axes)) for axes in robot.swivel_axes),
            gravity=ca.SX(ca.DM(robot.gravity_m_s2)),
        )


@dataclass(frozen=True, slots=True)
class CableState:
    """One cable at one pose.

    Attributes:
        length: l = |rho| + r (pi - psi) (eq. 6).
        swivel: sigma (eqs. 2, 3).
        wrap: psi (eq. 7).
        straight: |rho|.
        arm: u . (a - d), the distance of A from the swivel axis.
        lever: a', from P to A in the base frame, (3,).
        direction: t, from the pulley to the platform, base frame, (3,).
        bend: dt/da, how the direction turns when A moves, (3, 3), symmetric.
    """

    length: Expression
    swivel: Expression
    wrap: Expression
    straight: Expression
    arm: Expression
    lever: Expression
    direction: Expression
    bend: Expression


def cable_state(
    geometry: Geometry, index: int, position: Expression, rotation: Expression
) -> CableState:
    """Length, angles and direction of cable `index` at a pose.

    The cable leaves the pulley along t, tangent to it: with e = a - c measured from the pulley's
    centre, e = r n + |rho| t gives psi and |rho| without iteration. The bend is the closed form
    of eqs. (23), (26), (27): half the operations of differentiating the length twice.
    """
    radius, axes = geometry.radii[index], geometry.axes[index]
    lever = rotation @ geometry.attachments[index]
    local = axes @ (position + lever - geometry.entries[index])
    square = local[0] ** 2 + local[1] ** 2
    arm = ca.sqrt(square)
    across, along_axis = arm - radius, local[2]
    straight = ca.sqrt(square - 2 * radius * arm + along_axis**2)
    reach = across**2 + along_axis**2
    sine = (radius * along_axis + straight * across) / reach
    cosine = (radius * across - straight * along_axis) / reach
    wrap = ca.atan2(sine, cosine)
    if radius.is_zero():
        direction = local / straight
        bend = (ca.SX.eye(3) - direction @ direction.T) / straight
    else:
        u = ca.vertcat(local[0] / arm, local[1] / arm, 0)
        w = ca.vertcat(-u[1], u[0], 0)
        direction = ca.vertcat(sine * u[0], sine * u[1], -cosine)
        normal = ca.vertcat(cosine * u[0], cosine * u[1], sine)
        bend = (sine / arm) * (w @ w.T) + normal @ normal.T / straight
    return CableState(
        length=straight + radius * (ca.pi - wrap),
        swivel=ca.atan2(local[1], local[0]),
        wrap=wrap,
        straight=straight,
        arm=arm,
        lever=lever,
        direction=axes.T @ direction,
        bend=axes.T @ bend @ axes,
    )
