"""Accelerations and tensions of the platform with every cable held, written once.

Newton and Euler about the centre of all mass, translation in the base frame and rotation in the
platform frame: the mass matrix is then a number and a 3 x 3 block that does not depend on the
pose, and the cables couple through one small symmetric matrix (FIDIM 2022, eqs. 8-10 over the
mass). Everything is per unit of platform mass.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca

from freeswing.cdpr.effects import Effect, Instant
from freeswing.cdpr.model.body import Expression, Spin, along, symmetric
from freeswing.cdpr.model.ldl_factors import Factors
from freeswing.cdpr.model.pulley import Geometry
from freeswing.cdpr.robot import Robot

Owned = list[tuple[Effect, Expression]]
SLIP_DECAY_1_S = 20.0


@dataclass(frozen=True, slots=True)
class Inertia:
    """Specific inertia of the platform and of what rides on it.

    Attributes:
        mass: inertial mass.
        moment: first moment about P, base frame, (3,).
        heavy_mass: mass that gravity pulls on.
        heavy_moment: its first moment about P, base frame, (3,).
        centre: P to the centre of mass, platform frame, (3,).
        tensor: about P, platform frame, (3, 3).
        central: about the centre of mass, platform frame, (3, 3).
    """

    mass: Expression
    moment: Expression
    heavy_mass: Expression
    heavy_moment: Expression
    centre: Expression
    tensor: Expression
    central: Expression


def total_inertia(robot: Robot, inertia: Expression, instant: Instant, owned: Owned) -> Inertia:
    """The platform's own inertia (eq. 9 over the mass) and the point masses of effects."""
    mass, heavy = ca.SX(1), ca.SX(1)
    moment = heavy_moment = instant.com
    body_moment, tensor = inertia[:3], symmetric(inertia[3:])
    for effect, values in owned:
        for lever, inertial, weight in effect.point_masses(robot, instant, values):
            local = instant.rotation.T @ lever
            cross = ca.skew(local)
            mass, heavy = mass + inertial, heavy + weight
            moment, heavy_moment = moment + inertial * lever, heavy_moment + weight * lever
            body_moment, tensor = body_moment + inertial * local, tensor - inertial * cross @ cross
    centre = body_moment / mass
    cross = ca.skew(centre)
    central = tensor + mass * cross @ cross
    return Inertia(mass, moment, heavy, heavy_moment, centre, tensor, central)


def applied_wrench(
    instant: Instant,
    spin: Spin,
    gravity: Expression,
    inertia: Inertia,
    owned: Owned,
) -> tuple[Expression, Expression]:
    """Weight and effects: force in the base frame, moment about P in the platform frame."""
    force = inertia.heavy_mass * gravity
    moment = instant.rotation.T @ ca.cross(inertia.heavy_moment, gravity)
    more = effect_wrench(instant, spin, owned, needs_tension=False)
    return force + more[0], moment + more[1]


def effect_wrench(
    instant: Instant, spin: Spin, owned: Owned, *, needs_tension: bool
) -> tuple[Expression, Expression]:
    """Force (base frame) and moment about P (platform frame) of the effects."""
    force, moment = ca.SX.zeros(3), ca.SX.zeros(3)
    for effect, values in owned:
        if effect.needs_tension != needs_tension:
            continue
        wrench = effect.wrench(instant, values)
        if wrench is not None:
            force += wrench[:3]
            moment += instant.rotation.T @ wrench[3:]
        effort = effect.generalised_force(instant, values)
        if effort is not None:
            force += effort[:3]
            moment += spin.torque(effort[3:])
    return force, moment


@dataclass(frozen=True, slots=True)
class Platform:
    """The equations of one instant, ready for any wrench and any tensions.

    Attributes:
        instant: the state.
        spin: rotation in the platform frame.
        inertia: what moves.
        moments: of unit tensions about the centre of mass, platform frame, one (3,) a cable.
        turned: inverse of the central inertia times `moments`.
        tensor: factors of the central inertia.
    """

    instant: Instant
    spin: Spin
    inertia: Inertia
    moments: tuple[Expression, ...]
    turned: tuple[Expression, ...]
    tensor: Factors

    @classmethod
    def of(cls, instant: Instant, spin: Spin, inertia: Inertia, geometry: Geometry) -> Platform:
        """Prepare the equations of an instant."""
        tensor = Factors.of(inertia.central)
        moments = tuple(
            ca.cross(point - inertia.centre, instant.rotation.T @ cable.direction)
            for point, cable in zip(geometry.attachments, instant.cables, strict=True)
        )
        turned = tuple(tensor.solved(moment) for moment in moments)
        return cls(instant, spin, inertia, moments, turned, tensor)

    def unheld(self, force: Expression, moment: Expression) -> tuple[Expression, Expression]:
        """Acceleration of the centre of mass and body angular acceleration without cables."""
        omega = self.spin.omega
        about_centre = moment - ca.cross(self.inertia.centre, self.instant.rotation.T @ force)
        gyration = ca.cross(omega, self.inertia.central @ omega)
        return force / self.inertia.mass, self.tensor.solved(about_centre - gyration)

    def second_rates(self, linear: Expression, angular: Expression) -> Expression:
        """zeta_ddot (6,) of the accelerations that `unheld` gives."""
        omega, centre = self.spin.omega, self.inertia.centre
        relative = ca.cross(angular, centre) + ca.cross(omega, ca.cross(omega, centre))
        of_p = linear - self.instant.rotation @ relative
        return ca.vertcat(of_p, self.spin.angle_rates(angular - self.spin.drift))

    def pulled(self, linear: Expression, angular: Expression, tensions: Expression) -> Expression:
        """zeta_ddot (6,) with the cables pulling at given tensions (n,)."""
        for index, cable in enumerate(self.instant.cables):
            linear = linear - tensions[index] / self.inertia.mass * cable.direction
            angular = angular - tensions[index] * self.turned[index]
        return self.second_rates(linear, angular)

    def under(self, geometry: Geometry, owned: Owned, tensions: Expression) -> Expression:
        """zeta_ddot (6,) under given tensions, with every effect's forces but no constraint."""
        loaded = replace(self.instant, tensions=tensions)
        force, moment = applied_wrench(loaded, self.spin, geometry.gravity, self.inertia, owned)
        more = effect_wrench(loaded, self.spin, owned, needs_tension=True)
        return self.pulled(*self.unheld(force + more[0], moment + more[1]), tensions)

    def yielding(self) -> Factors:
        """Factors of the matrix that turns tensions into second derivatives of the lengths."""
        cables, n = self.instant.cables, len(self.moments)
        matrix = ca.SX(n, n)
        for i in range(n):
            for j in range(i + 1):
                entry = ca.dot(cables[i].direction, cables[j].direction) / self.inertia.mass
                matrix[i, j] = entry + ca.dot(self.moments[i], self.turned[j])
        return Factors.of(matrix)

    def lengthening(
        self, geometry: Geometry, linear: Expression, angular: Expression
    ) -> Expression:
        """Second derivatives of the lengths, (n,), under accelerations without cables."""
        omega, rows = self.spin.omega, []
        for point, moment, cable in zip(
            geometry.attachments, self.moments, self.instant.cables, strict=True
        ):
            inward = self.instant.rotation @ ca.cross(
                omega, ca.cross(omega, point - self.inertia.centre)
            )
            rows.append(
                ca.dot(cable.direction, linear + inward)
                + ca.dot(moment, angular)
                + cable.turning(self.instant.velocity_of(cable))
            )
        return ca.vertcat(*rows)


@dataclass(frozen=True, slots=True)
class Held:
    """The motion with every cable held at the length that the effects allow.

    Attributes:
        acceleration: zeta_ddot, (6,).
        tensions: tau / m, (n,).
        change: by how much the effects lengthen the cables, (n,).
        change_rate: its time derivative.
    """

    acceleration: Expression
    tensions: Expression
    change: Expression
    change_rate: Expression


def held_motion(robot: Robot, platform: Platform, geometry: Geometry, owned: Owned) -> Held:
    """Accelerations and tensions with every cable held at its length.

    Effects that need tensions (friction under load, stretch) are added in a second pass with the
    tensions of the first: exact to first order in the effect, on the slow motion. What stretch
    leaves of second order would let the lengths run away with time, so that their rates are led
    back to what the stretch allows (EA = 100 kN, 10 s: 16 micrometres instead of 1.2 mm).

    Stretch follows slow tensions: a smoothed jump of dry friction, a micrometre of stretch, would
    count with its third derivative.
    """
    instant = platform.instant

    def wrench_of(effects: Owned) -> tuple[Expression, Expression]:
        return applied_wrench(instant, platform.spin, geometry.gravity, platform.inertia, effects)

    force, moment = wrench_of(owned)
    change = length_change(robot, instant, owned, needs_tension=False)
    yielding = platform.yielding()

    def solve(
        force: Expression, moment: Expression, demanded: Expression
    ) -> tuple[Expression, Expression]:
        loose = platform.unheld(force, moment)
        tensions = yielding.solved(platform.lengthening(geometry, *loose) - demanded)
        return platform.pulled(*loose, tensions), tensions

    rigid = solve(force, moment, change[2])
    if not any(effect.needs_tension for effect, _ in owned):
        return Held(*rigid, change[0], change[1])
    loaded = replace(instant, tensions=rigid[1])
    more = effect_wrench(loaded, platform.spin, owned, needs_tension=True)
    slow = rigid
    if stretches(owned) and any(effect.dry for effect, _ in owned):
        slow = solve(*wrench_of([one for one in owned if not one[0].dry]), change[2])
    stretched = replace(instant, tensions=slow[1])
    extra = length_change(robot, stretched, owned, needs_tension=True, acceleration=slow[0])
    changes = [before + added for before, added in zip(change, extra, strict=True)]
    demanded = changes[2]
    if stretches(owned):
        demanded = demanded - SLIP_DECAY_1_S * (length_rates(instant) - changes[1])
    total = solve(force + more[0], moment + more[1], demanded)
    return Held(*total, changes[0], changes[1])


def stretches(owned: Owned) -> bool:
    """Whether an effect changes cable lengths with their tension."""
    return any(effect.stretches for effect, _ in owned)


def length_rates(instant: Instant) -> Expression:
    """dl/dt of every cable, (n,)."""
    return ca.vertcat(
        *[ca.dot(cable.direction, instant.velocity_of(cable)) for cable in instant.cables]
    )


def length_change(
    robot: Robot,
    instant: Instant,
    owned: Owned,
    *,
    needs_tension: bool,
    acceleration: Expression | None = None,
) -> tuple[Expression, Expression, Expression]:
    """Change of the cable lengths and its two time derivatives along the motion, (n,) each."""
    variables = ca.vertcat(instant.time_s, instant.zeta, instant.rates)
    known = ca.SX.zeros(6) if acceleration is None else acceleration
    flow = ca.vertcat(1, instant.rates, known)
    change = ca.SX.zeros(robot.n_cables)
    for effect, values in owned:
        if effect.needs_tension != needs_tension:
            continue
        own = effect.length_change(robot, instant, values)
        lag = effect.length_lag(robot, instant, values)
        change = change if own is None else change + own
        change = change if lag is None else change + along(lag, variables, flow)
    rate = along(change, variables, flow)
    return change, rate, along(rate, variables, flow)
