"""The free-swinging platform's equations, stated once; everything else is derived from them.

`build_model(robot, effects)` gives a `Model` whose CasADi functions share one expression graph:
cable lengths and their Jacobian, the constrained acceleration with the specific tensions
(FIDIM 2022, eqs. 8-10 divided by the mass), its derivatives, energies and what is measured.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from cdpr.body import Expression, along, rate_matrix, rotation, symmetric
from cdpr.effects import Effect, Instant, Parameter, effect_named
from cdpr.pulley import CableState, Geometry, cable_state
from cdpr.robot import Array, Robot

Function = Any  # casadi.Function


@dataclass(frozen=True, slots=True)
class Model:
    """One robot with a set of effects, as functions of time t, zeta, rates, inertia and values.

    Attributes:
        robot: what the model was built from.
        effects: names of the effects in the model, in the order of their parameters.
        parameters: the parameters of all effects, in the order of `values`.
        lengths: (zeta, values) -> l (n,).
        cables: (zeta, values) -> l, sigma, psi (n,) each and their Jacobians by zeta (n, 6).
        cable_rates: (zeta, rates, values) -> d/dt of these three Jacobians (n, 6).
        twist_map: (zeta, rates) -> D (6, 6) with twist v = D zeta_dot (eq. 2), and dD/dt (6, 6).
        acceleration: (t, zeta, rates, inertia, values) -> zeta_ddot (6,), tau / m (n,).
        told: (t, zeta, rates, inertia, values) -> the lengths a winch would tell (n,).
        slip: (t, zeta, rates, inertia, values) -> dl/dt of the pose less what the effects impose
            (n,): zero for a state that the cables allow.
        measured: (t, zeta, rates, inertia, values) -> what is measured of the pose (6,).
        lagrangian: (zeta, multipliers, inertia, values) -> potential + multipliers . lengths,
            its gradient (6,) and Hessian (6, 6).
        mass_matrix: (zeta, inertia, values) -> D^T M D / m (6, 6).
        energy: (zeta, rates, inertia, values) -> specific kinetic, potential energy.
    """

    robot: Robot
    effects: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    lengths: Function
    cables: Function
    cable_rates: Function
    twist_map: Function
    acceleration: Function
    told: Function
    slip: Function
    measured: Function
    lagrangian: Function
    mass_matrix: Function
    energy: Function

    @property
    def names(self) -> tuple[str, ...]:
        """`effect.parameter` for each of the values."""
        owners = (n for n in self.effects for _ in effect_named(n).parameters(self.robot))
        return tuple(f"{o}.{p.name}" for o, p in zip(owners, self.parameters, strict=True))

    @property
    def start_values(self) -> Array:
        """Values that leave the declared model as it is, (k,)."""
        return np.array([parameter.start for parameter in self.parameters])


@dataclass(frozen=True, slots=True)
class _Symbols:
    time: Expression
    zeta: Expression
    rates: Expression
    inertia: Expression
    values: Expression

    @classmethod
    def make(cls, n_values: int) -> _Symbols:
        return cls(
            ca.SX.sym("t"),
            ca.SX.sym("zeta", 6),
            ca.SX.sym("rates", 6),
            ca.SX.sym("inertia", 9),
            ca.SX.sym("values", n_values),
        )

    @property
    def all(self) -> list[Expression]:
        return [self.time, self.zeta, self.rates, self.inertia, self.values]


@dataclass(frozen=True, slots=True)
class _Inertia:
    """Specific mass, first moment and inertia about P in the base frame, and the heavy moment."""

    mass: Expression
    moment: Expression
    tensor: Expression
    heavy_mass: Expression
    heavy_moment: Expression


Owned = list[tuple[Effect, Expression]]


def build_model(robot: Robot, effects: tuple[str, ...] = ()) -> Model:
    """The model of `robot` with the named effects.

    Args:
        robot: its declared constants, which are folded into the expressions.
        effects: names out of `cdpr.effects.catalogue()`.

    Raises:
        ValueError: for an unknown or repeated effect.
    """
    if len(set(effects)) != len(effects):
        raise ValueError(f"an effect is named twice in {effects}")
    found = [effect_named(name) for name in effects]
    parameters = [effect.parameters(robot) for effect in found]
    s = _Symbols.make(sum(len(group) for group in parameters))
    owned, used = [], 0
    for effect, group in zip(found, parameters, strict=True):
        owned.append((effect, s.values[used : used + len(group)]))
        used += len(group)
    geometry = Geometry.of(robot)
    for effect, values in owned:
        geometry = effect.geometry(geometry, values)
    functions = _functions(robot, s, geometry, owned)
    return Model(robot, tuple(effects), tuple(p for g in parameters for p in g), **functions)


def _functions(robot: Robot, s: _Symbols, geometry: Geometry, owned: Owned) -> dict[str, Function]:
    turn = rotation(s.zeta[3:])
    states = tuple(cable_state(geometry, i, s.zeta[:3], turn) for i in range(robot.n_cables))
    lengths = ca.vertcat(*[cable.length for cable in states])
    swivels = ca.vertcat(*[cable.swivel for cable in states])
    wraps = ca.vertcat(*[cable.wrap for cable in states])
    spin = rate_matrix(s.zeta[3:])
    jacobians = [
        length_jacobian(states, spin),
        ca.jacobian(swivels, s.zeta),
        ca.jacobian(wraps, s.zeta),
    ]
    instant = Instant(
        s.time, s.zeta, s.rates, turn, spin @ s.rates[3:], turn @ s.inertia[:3], states
    )
    inertia = _inertia(robot, s, instant, owned)
    motion = _constrained(robot, s, instant, geometry, inertia, owned, jacobians[0], spin)
    potential = -ca.dot(geometry.gravity, inertia.heavy_mass * s.zeta[:3] + inertia.heavy_moment)
    mass = _mass_matrix(inertia, spin)
    multipliers = ca.SX.sym("multipliers", robot.n_cables)
    lagrangian = potential + ca.dot(multipliers, lengths)
    hessian, gradient = ca.hessian(lagrangian, s.zeta)
    measured = s.zeta
    for effect, values in owned:
        change = effect.measured(instant, values)
        if change is not None:
            turn_back = ca.solve(spin, change[3:])
            measured = measured + ca.vertcat(change[:3], turn_back)
    twist_map = ca.diagcat(ca.SX.eye(3), spin)
    twist_map_rate = along(twist_map, s.zeta, s.rates)
    rated = [along(j, s.zeta, s.rates) for j in jacobians]

    def function(
        name: str, inputs: dict[str, Expression], outputs: dict[str, Expression]
    ) -> Function:
        dense = [ca.densify(output) for output in outputs.values()]
        options = {"cse": True}
        return ca.Function(name, [*inputs.values()], dense, [*inputs], [*outputs], options)

    pose = {"zeta": s.zeta, "values": s.values}
    moving = {"zeta": s.zeta, "rates": s.rates, "values": s.values}
    everything = {
        "scalar_time": s.time,
        "zeta": s.zeta,
        "rates": s.rates,
        "inertia": s.inertia,
        "values": s.values,
    }
    matrices = ("matrix_lengths", "matrix_swivels", "matrix_wraps")
    columns = {"lengths": lengths, "swivels": swivels, "wraps": wraps}
    held = {"acceleration": motion.acceleration, "tensions": motion.tensions}
    kinetic = ca.dot(s.rates, mass @ s.rates) / 2
    posed = {"zeta": s.zeta, "inertia": s.inertia, "values": s.values}
    return {
        "lengths": function("lengths", pose, {"lengths": lengths}),
        "cables": function("cables", pose, columns | dict(zip(matrices, jacobians, strict=True))),
        "cable_rates": function("cable_rates", moving, dict(zip(matrices, rated, strict=True))),
        "twist_map": function(
            "twist_map",
            {"zeta": s.zeta, "rates": s.rates},
            {"matrix_map": twist_map, "matrix_rate": twist_map_rate},
        ),
        "acceleration": function("acceleration", everything, held),
        "told": function("told", everything, {"told": lengths - motion.change}),
        "slip": function("slip", everything, {"slip": jacobians[0] @ s.rates - motion.change_rate}),
        "measured": function("measured", everything, {"measured": measured}),
        "lagrangian": function(
            "lagrangian",
            {"zeta": s.zeta, "multipliers": multipliers, "inertia": s.inertia, "values": s.values},
            {"scalar_value": lagrangian, "gradient": gradient, "matrix_hessian": hessian},
        ),
        "mass_matrix": function("mass_matrix", posed, {"matrix_mass": mass}),
        "energy": function(
            "energy",
            {"zeta": s.zeta, "rates": s.rates, "inertia": s.inertia, "values": s.values},
            {"scalar_kinetic": kinetic, "scalar_potential": potential},
        ),
    }


def _inertia(robot: Robot, s: _Symbols, instant: Instant, owned: Owned) -> _Inertia:
    """The platform's own inertia (eq. 9 over the mass) and what rides on it."""
    mass, heavy = ca.SX(1), ca.SX(1)
    moment = heavy_moment = instant.com
    tensor = instant.rotation @ symmetric(s.inertia[3:]) @ instant.rotation.T
    for effect, values in owned:
        for lever, inertial, weight in effect.point_masses(robot, instant, values):
            cross = ca.skew(lever)
            mass, heavy = mass + inertial, heavy + weight
            moment, heavy_moment = moment + inertial * lever, heavy_moment + weight * lever
            tensor = tensor - inertial * cross @ cross
    return _Inertia(mass, moment, tensor, heavy, heavy_moment)


def _mass_matrix(inertia: _Inertia, spin: Expression) -> Expression:
    """D^T M D over the platform's mass (eqs. 2, 9)."""
    coupling = -ca.skew(inertia.moment) @ spin
    top = ca.horzcat(inertia.mass * ca.SX.eye(3), coupling)
    return ca.vertcat(top, ca.horzcat(coupling.T, spin.T @ inertia.tensor @ spin))


def length_jacobian(cables: tuple[CableState, ...], spin: Expression) -> Expression:
    """dl/dzeta = Xi D, rows [t^T, (a' x t)^T H] (FIDIM eq. 4; self-calibration eq. 23)."""
    rows = [ca.horzcat(c.direction.T, ca.cross(c.lever, c.direction).T @ spin) for c in cables]
    return ca.vertcat(*rows)


def _drift(s: _Symbols, instant: Instant, spin: Expression) -> Expression:
    """Second derivative of the lengths at zero zeta_ddot, (n,)."""
    spin_rate = along(spin @ s.rates[3:], s.zeta, s.rates)
    rows = []
    for cable in instant.cables:
        velocity = s.rates[:3] + ca.cross(instant.omega, cable.lever)
        bias = ca.cross(spin_rate, cable.lever) + ca.cross(
            instant.omega, ca.cross(instant.omega, cable.lever)
        )
        turning = ca.dot(velocity, cable.bend @ velocity)
        rows.append(ca.dot(cable.direction, bias) + turning)
    return ca.vertcat(*rows)


@dataclass(frozen=True, slots=True)
class _Motion:
    acceleration: Expression
    tensions: Expression
    change: Expression
    change_rate: Expression


def _constrained(
    robot: Robot,
    s: _Symbols,
    instant: Instant,
    geometry: Geometry,
    inertia: _Inertia,
    owned: Owned,
    jacobian: Expression,
    spin: Expression,
) -> _Motion:
    """Accelerations and tensions with every cable held at its length.

    Effects that need tensions (friction under load, stretch) are added in a second pass with the
    tensions of the first: exact to first order in the effect, on the slow motion.
    """
    drift = _drift(s, instant, spin)
    change, change_rate, change_acceleration = _length_change(robot, s, instant, owned, False)
    force = _generalised_force(s, instant, geometry, inertia, spin, owned)
    blocks = _factors(inertia, spin, jacobian)
    rigid = _held(blocks, jacobian, force, change_acceleration - drift)
    if not any(effect.needs_tension for effect, _ in owned):
        return _Motion(*rigid, change, change_rate)
    loaded = Instant(
        s.time,
        s.zeta,
        s.rates,
        instant.rotation,
        instant.omega,
        instant.com,
        instant.cables,
        rigid[1],
    )
    force = force + _effect_forces(loaded, spin, owned, True)
    extra = _length_change(robot, s, loaded, owned, True, rigid[0])
    total = _held(blocks, jacobian, force, change_acceleration + extra[2] - drift)
    return _Motion(*total, change + extra[0], change_rate + extra[1])


def _generalised_force(
    s: _Symbols,
    instant: Instant,
    geometry: Geometry,
    inertia: _Inertia,
    spin: Expression,
    owned: Owned,
) -> Expression:
    """D^T (phi - C v - M Ddot zeta_dot) over the mass, and the effects' forces (eq. 8)."""
    omega = instant.omega
    spin_rate = along(spin @ s.rates[3:], s.zeta, s.rates)
    inner = ca.cross(omega, ca.cross(omega, inertia.moment)) + ca.cross(spin_rate, inertia.moment)
    gyration = ca.cross(omega, inertia.tensor @ omega) + inertia.tensor @ spin_rate
    top = inertia.heavy_mass * geometry.gravity - inner
    turning = ca.cross(inertia.heavy_moment, geometry.gravity) - gyration
    return ca.vertcat(top, spin.T @ turning) + _effect_forces(instant, spin, owned, False)


def _effect_forces(
    instant: Instant, spin: Expression, owned: Owned, needs_tension: bool
) -> Expression:
    total = ca.SX.zeros(6)
    for effect, values in owned:
        if effect.needs_tension != needs_tension:
            continue
        wrench = effect.wrench(instant, values)
        if wrench is not None:
            total += ca.vertcat(wrench[:3], spin.T @ wrench[3:])
        force = effect.generalised_force(instant, values)
        if force is not None:
            total += force
    return total


def _length_change(
    robot: Robot,
    s: _Symbols,
    instant: Instant,
    owned: Owned,
    needs_tension: bool,
    acceleration: Expression | None = None,
) -> tuple[Expression, Expression, Expression]:
    """Change of the cable lengths and its two time derivatives along the motion."""
    change = ca.SX.zeros(robot.n_cables)
    for effect, values in owned:
        if effect.needs_tension == needs_tension:
            own = effect.length_change(robot, instant, values)
            change = change if own is None else change + own
    variables = ca.vertcat(s.time, s.zeta, s.rates)
    known = ca.SX.zeros(6) if acceleration is None else acceleration
    flow = ca.vertcat(1, s.rates, known)
    rate = along(change, variables, flow)
    return change, rate, along(rate, variables, flow)


@dataclass(frozen=True, slots=True)
class _Factors:
    mass: Expression
    coupling: Expression
    rotary_inverse: Expression
    unit_accelerations: Expression
    yielding_inverse: Expression


def _factors(inertia: _Inertia, spin: Expression, jacobian: Expression) -> _Factors:
    """Block elimination: translation first (its mass is a scalar), then three angles, then tau."""
    coupling = -ca.skew(inertia.moment) @ spin
    rotary = spin.T @ inertia.tensor @ spin - coupling.T @ coupling / inertia.mass
    inverse = ca.inv(rotary)
    factors = _Factors(inertia.mass, coupling, inverse, None, None)
    accelerations = _unheld(factors, jacobian.T)
    yielding = ca.inv(jacobian @ accelerations)
    return _Factors(inertia.mass, coupling, inverse, accelerations, yielding)


def _unheld(factors: _Factors, force: Expression) -> Expression:
    """Accelerations that generalised forces give to the platform without cables."""
    angular = factors.rotary_inverse @ (
        force[3:, :] - factors.coupling.T @ force[:3, :] / factors.mass
    )
    return ca.vertcat((force[:3, :] - factors.coupling @ angular) / factors.mass, angular)


def _held(
    factors: _Factors, jacobian: Expression, force: Expression, demanded: Expression
) -> tuple[Expression, Expression]:
    """Acceleration and tensions under dl/dzeta zeta_ddot = demanded."""
    loose = _unheld(factors, force)
    tensions = factors.yielding_inverse @ (jacobian @ loose - demanded)
    return loose - factors.unit_accelerations @ tensions, tensions
