"""Cables over swivel pulleys as symbolic expressions, written once.

Swivel frame, wrap and length follow self-calibration 2019, eqs. (2)-(8), solved in closed form.
A radius of zero is an eyelet at D; nothing else changes.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot


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
        square: |rho|^2, negative where A lies inside the pulley.
        entry: d, base frame, (3,).
        lever: a', from P to A in the base frame, (3,).
        direction: t, from the pulley to the platform, base frame, (3,).
        across: w, normal to the pulley's plane, base frame, (3,); None for an eyelet.
        normal: n, from the pulley's centre to the exit point, base frame, (3,); None likewise.
        sine: sin psi.
    """

    length: Expression
    swivel: Expression
    wrap: Expression
    straight: Expression
    arm: Expression
    square: Expression
    entry: Expression
    lever: Expression
    direction: Expression
    across: Expression
    normal: Expression
    sine: Expression

    @property
    def is_eyelet(self) -> bool:
        """Whether the declared radius is zero: nothing swivels and nothing winds."""
        return self.normal is None

    @property
    def bend(self) -> Expression:
        """dt/da, how the direction turns when A moves, (3, 3), symmetric.

        The closed form of eqs. (23), (26), (27): half the operations of differentiating the
        length twice.
        """
        if self.is_eyelet:
            return (ca.SX.eye(3) - self.direction @ self.direction.T) / self.straight
        about_axis = (self.sine / self.arm) * (self.across @ self.across.T)
        return about_axis + self.normal @ self.normal.T / self.straight

    def turning(self, velocity: Expression) -> Expression:
        """Velocity . bend . velocity: the length's second derivative when A moves evenly."""
        if self.is_eyelet:
            along = ca.dot(self.direction, velocity)
            return (ca.dot(velocity, velocity) - along**2) / self.straight
        swivelling = self.sine / self.arm * ca.dot(self.across, velocity) ** 2
        return swivelling + ca.dot(self.normal, velocity) ** 2 / self.straight


def cable_state(
    geometry: Geometry, index: int, position: Expression, rotation: Expression
) -> CableState:
    """Length, angles and direction of cable `index` at a pose.

    The cable leaves the pulley along t, tangent to it: with e = a - c measured from the pulley's
    centre, e = r n + |rho| t gives psi and |rho| without iteration.
    """
    radius, axes = geometry.radii[index], geometry.axes[index]
    lever = rotation @ geometry.attachments[index]
    local = axes @ (position + lever - geometry.entries[index])
    in_plane = local[0] ** 2 + local[1] ** 2
    arm = ca.sqrt(in_plane)
    beyond, along_axis = arm - radius, local[2]
    square = in_plane - 2 * radius * arm + along_axis**2
    straight = ca.sqrt(square)
    reach = beyond**2 + along_axis**2
    sine = (radius * along_axis + straight * beyond) / reach
    cosine = (radius * beyond - straight * along_axis) / reach
    wrap = ca.atan2(sine, cosine)
    across = normal = None
    if radius.is_zero():
        direction = local / straight
    else:
        u = ca.vertcat(local[0] / arm, local[1] / arm, 0)
        across = axes.T @ ca.vertcat(-u[1], u[0], 0)
        normal = axes.T @ ca.vertcat(cosine * u[0], cosine * u[1], sine)
        direction = ca.vertcat(sine * u[0], sine * u[1], -cosine)
    return CableState(
        length=straight + radius * (ca.pi - wrap),
        swivel=ca.atan2(local[1], local[0]),
        wrap=wrap,
        straight=straight,
        arm=arm,
        square=square,
        entry=geometry.entries[index],
        lever=lever,
        direction=axes.T @ direction,
        across=across,
        normal=normal,
        sine=sine,
    )
