"""The free-swinging platform's equations, stated once; everything else is derived from them.

`build_model(robot, effects)` gives a `Model` whose CasADi functions share one expression graph:
cable lengths and their Jacobian, the constrained acceleration with the specific tensions
(FIDIM 2022, eqs. 8-10 divided by the mass), its derivatives, energies and what is measured.
"""

from __future__ import annotations

import pickle
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.effects import Effect, Instant, Parameter, effect_named
from freeswing.cdpr.model.body import Expression, Spin, along, rate_matrix, rotation
from freeswing.cdpr.model.constrained import (
    Inertia,
    Owned,
    Platform,
    applied_wrench,
    held_motion,
    length_change,
    length_rates,
    stretches,
    total_inertia,
)
from freeswing.cdpr.model.elastic_motion import held_by, springs_of, sprung
from freeswing.cdpr.model.pulley import CableState, Geometry, cable_state
from freeswing.cdpr.model.refused_function import Refused
from freeswing.cdpr.robot import Array, Robot

Function = Any  # casadi.Function
IntArray = NDArray[np.intp]
LARGEST_SWINGING = 5


@dataclass(frozen=True, slots=True)
class Model:
    """One robot with a set of effects, as functions of time t, zeta, rates, inertia and values.

    Lengths, cables, energies and what follows from the pose alone serve any number of cables.
    With six cables or more held there is no free motion: `acceleration`, and with cables stretched
    by their tension `told` and `slip`, raise a ValueError when they are used.

    Attributes:
        robot: what the model was built from.
        effects: names of the effects in the model, in the order of their parameters.
        parameters: the parameters of all effects, in the order of `values`.
        names: `effect.parameter` for each of the values.
        lengths: (zeta, values) -> l (n,).
        cables: (zeta, values) -> l, sigma, psi (n,) each and their Jacobians by zeta (n, 6).
        cable_rates: (zeta, rates, values) -> d/dt of these three Jacobians (n, 6).
        domain: (zeta, values) -> distances of A from the swivel axes (n,), squares of the straight
            lengths (n,), negative inside a pulley, and radii (n,): `cdpr.model.undefined_poses`.
        twist_map: (zeta, rates) -> D (6, 6) with twist v = D zeta_dot (eq. 2), and dD/dt (6, 6).
        acceleration: (t, zeta, rates, inertia, values) -> zeta_ddot (6,), tau / m (n,).
        pulled: (t, zeta, rates, tensions, inertia, values) -> zeta_ddot (6,) under given specific
            tensions (n,), whatever the lengths do.
        told: (t, zeta, rates, inertia, values) -> the lengths a winch would tell (n,).
        slip: (t, zeta, rates, inertia, values) -> dl/dt of the pose less what the effects impose
            (n,): zero for a state that the cables allow.
        measured: (t, zeta, rates, inertia, values) -> what is measured of the pose (6,).
        lagrangian: (zeta, multipliers, inertia, values) -> weight's potential + multipliers .
            lengths; minus the generalised force at rest, effects included and tensions being the
            multipliers, (6,); its derivative by zeta, made symmetric, (6, 6).
        mass_matrix: (zeta, inertia, values) -> D^T M D / m (6, 6).
        energy: (zeta, rates, inertia, values) -> specific kinetic, potential energy of the weight.
        plucked: as `told` -> pull and slip of springs over held cables, of usual size (2 n,); None.
        correlations: of what is known beforehand of the values, (k, k); None: independent.
    """

    robot: Robot
    effects: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    names: tuple[str, ...]
    lengths: Function
    cables: Function
    cable_rates: Function
    domain: Function
    twist_map: Function
    acceleration: Function
    pulled: Function
    told: Function
    slip: Function
    measured: Function
    lagrangian: Function
    mass_matrix: Function
    energy: Function
    plucked: Function | None = None
    correlations: Array | None = None

    @property
    def own_values(self) -> IntArray:
        """Which of the values each run has for itself, (o,)."""
        return np.flatnonzero([parameter.per_run for parameter in self.parameters])

    @property
    def held(self) -> int:
        """How many cables hold their length: so many of a state's rates are not free."""
        return self.robot.n_cables if self.plucked is None else 0

    def place_of(self, effect: str) -> slice:
        """Where an effect's values stand among `values`.

        Raises:
            ValueError: when it is not in the model.
        """
        where = [k for k, name in enumerate(self.names) if name.partition(".")[0] == effect]
        if not where:
            raise ValueError(f"{effect} is not among {self.effects}")
        return slice(where[0], where[-1] + 1)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled as what it was built from: whoever has built the same has its functions."""
        built = build_model(self.robot, self.effects)
        told = {"robot", "effects", "parameters", "names", "correlations"}
        names = [field.name for field in fields(self)]
        if all(getattr(self, name) is getattr(built, name) for name in names if name not in told):
            return _rebuilt, (self.robot, self.effects, self.parameters, self.correlations)
        return Model, tuple(getattr(self, name) for name in names)

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
    def named(self) -> dict[str, Expression]:
        """All inputs; `cdpr.model.batch` reads the shapes from their names."""
        return {
            "scalar_time": self.time,
            "zeta": self.zeta,
            "rates": self.rates,
            "inertia": self.inertia,
            "values": self.values,
        }

    def some(self, *names: str) -> dict[str, Expression]:
        """Some of the inputs."""
        return {name: self.named[name] for name in names}


def build_model(robot: Robot, effects: tuple[str, ...] = ()) -> Model:
    """The model of `robot` with the named effects.

    Args:
        robot: its declared constants, which are folded into the expressions.
        effects: names out of `cdpr.effects.catalogue()`.

    Raises:
        ValueError: for an unknown or repeated effect, or a robot without cables.
    """
    if isinstance(effects, str):
        raise ValueError(f"effects is the text {effects!r}; give a tuple of names")
    if robot.n_cables < 1:
        raise ValueError(f"robot {robot.name} has no cables; a model needs 1 or more")
    if len(set(effects)) != len(effects):
        raise ValueError(f"an effect is named twice in {effects}")
    found = tuple(effect_named(name) for name in effects)
    parameters = [effect.parameters(robot) for effect in found]
    pairs = [(e, p) for e, group in zip(found, parameters, strict=True) for p in group]
    return Model(
        robot,
        tuple(effects),
        parameters=tuple(p for _, p in pairs),
        names=tuple(f"{e.name}.{p.name}" for e, p in pairs),
        **_built(pickle.dumps(robot), found),
    )


def _rebuilt(
    robot: Robot,
    effects: tuple[str, ...],
    parameters: tuple[Parameter, ...],
    correlations: Array | None,
) -> Model:
    return replace(build_model(robot, effects), parameters=parameters, correlations=correlations)


@lru_cache(maxsize=64)
def _built(pickled: bytes, effects: tuple[Effect, ...]) -> dict[str, Function]:
    """The functions of a robot with effects, which a session asks for again and again."""
    robot: Robot = pickle.loads(pickled)
    sizes = [len(effect.parameters(robot)) for effect in effects]
    s = _Symbols.make(sum(sizes))
    ends = np.cumsum([0, *sizes])
    owned = [(e, s.values[ends[k] : ends[k + 1]]) for k, e in enumerate(effects)]
    geometry = Geometry.of(robot)
    for effect, values in owned:
        geometry = effect.geometry(geometry, values)
    return _functions(robot, s, geometry, owned)


def _functions(robot: Robot, s: _Symbols, geometry: Geometry, owned: Owned) -> dict[str, Function]:
    springs, owned = springs_of(owned), held_by(owned)
    turn = rotation(s.zeta[3:])
    states = tuple(cable_state(geometry, i, s.zeta[:3], turn) for i in range(robot.n_cables))
    matrix = rate_matrix(s.zeta[3:])
    com = turn @ s.inertia[:3]
    instant = Instant(s.time, s.zeta, s.rates, turn, matrix @ s.rates[3:], com, states)
    spin = Spin.of(s.zeta[3:], s.rates[3:])
    inertia = total_inertia(robot, s.inertia, instant, owned)
    jacobian = length_jacobian(states, matrix)
    twist_map = ca.diagcat(ca.SX.eye(3), matrix)
    maps = {"matrix_map": twist_map, "matrix_rate": along(twist_map, s.zeta, s.rates)}
    held = _kinematics(robot, s, states, geometry, jacobian)
    held |= _energies(s, geometry, inertia, spin, turn)
    held |= _dynamics(robot, s, instant, spin, geometry, inertia, owned)
    held |= sprung(held, s.named, springs) if springs else {}
    measured = {"measured": _measured(s, instant, matrix, owned, held["acceleration"])}
    return {
        **held,
        "twist_map": _function("twist_map", s.some("zeta", "rates"), maps),
        "measured": _function("measured", s.named, measured),
        "lagrangian": _lagrangian(robot, s, instant, spin, geometry, inertia, owned, jacobian),
    }


def _function(name: str, inputs: dict[str, Expression], outputs: dict[str, Expression]) -> Function:
    dense = [ca.densify(output) for output in outputs.values()]
    options = {"cse": True}
    return ca.Function(name, [*inputs.values()], dense, [*inputs], [*outputs], options)


def length_jacobian(cables: tuple[CableState, ...], spin: Expression) -> Expression:
    """dl/dzeta = Xi D, rows [t^T, (a' x t)^T H] (FIDIM eq. 4; self-calibration eq. 23)."""
    rows = [ca.horzcat(c.direction.T, ca.cross(c.lever, c.direction).T @ spin) for c in cables]
    return ca.vertcat(*rows)


def _kinematics(
    robot: Robot,
    s: _Symbols,
    states: tuple[CableState, ...],
    geometry: Geometry,
    jacobian: Expression,
) -> dict[str, Function]:
    """What follows from the pose and its rates alone."""
    lengths = ca.vertcat(*[cable.length for cable in states])
    columns = {
        "lengths": lengths,
        "swivels": ca.vertcat(*[cable.swivel for cable in states]),
        "wraps": ca.vertcat(*[cable.wrap for cable in states]),
    }
    matrices = {
        "matrix_lengths": jacobian,
        "matrix_swivels": ca.jacobian(columns["swivels"], s.zeta),
        "matrix_wraps": ca.jacobian(columns["wraps"], s.zeta),
    }
    rates = {name: along(by_zeta, s.zeta, s.rates) for name, by_zeta in matrices.items()}
    reach = {
        "arms": ca.vertcat(*[cable.arm for cable in states]),
        "squares": ca.vertcat(*[cable.square for cable in states]),
        "radii": ca.vertcat(*geometry.radii),
    }
    pose = s.some("zeta", "values")
    return {
        "lengths": _function("lengths", pose, {"lengths": lengths}),
        "cables": _function("cables", pose, columns | matrices),
        "cable_rates": _function("cable_rates", s.some("zeta", "rates", "values"), rates),
        "domain": _function("domain", pose, reach),
    }


def _measured(
    s: _Symbols, instant: Instant, matrix: Expression, owned: Owned, acceleration: ca.Function
) -> Expression:
    measured, measuring = s.zeta, [one for one in owned if one[0].changes_measurement]
    if not measuring:
        return measured
    swings = isinstance(acceleration, ca.Function)  # held by six cables it may as well be still
    second_rates = acceleration(*s.named.values())[0] if swings else ca.SX.zeros(6)
    instant = replace(instant, second_rates=second_rates)
    for effect, values in measuring:
        change = effect.measured(instant, values)
        if change is not None:
            measured = measured + ca.vertcat(change[:3], ca.solve(matrix, change[3:]))
    return measured


def _weight_potential(s: _Symbols, geometry: Geometry, inertia: Inertia) -> Expression:
    return -ca.dot(geometry.gravity, inertia.heavy_mass * s.zeta[:3] + inertia.heavy_moment)


def _energies(
    s: _Symbols, geometry: Geometry, inertia: Inertia, spin: Spin, turn: Expression
) -> dict[str, Function]:
    """D^T M D over the platform's mass (eqs. 2, 9), kinetic and potential energy."""
    coupling = -turn @ ca.skew(ca.mtimes(turn.T, inertia.moment)) @ spin.matrix
    top = ca.horzcat(inertia.mass * ca.SX.eye(3), coupling)
    rotary = spin.matrix.T @ inertia.tensor @ spin.matrix
    mass = ca.vertcat(top, ca.horzcat(coupling.T, rotary))
    energies = {
        "scalar_kinetic": ca.dot(s.rates, mass @ s.rates) / 2,
        "scalar_potential": _weight_potential(s, geometry, inertia),
    }
    posed, moving = s.some("zeta", "inertia", "values"), s.some("zeta", "rates")
    return {
        "mass_matrix": _function("mass_matrix", posed, {"matrix_mass": mass}),
        "energy": _function("energy", moving | s.some("inertia", "values"), energies),
    }


def _lagrangian(
    robot: Robot,
    s: _Symbols,
    instant: Instant,
    spin: Spin,
    geometry: Geometry,
    inertia: Inertia,
    owned: Owned,
    jacobian: Expression,
) -> Function:
    """Forces at rest rather than a gradient: effects such as springs need not state energies."""
    force, moment = applied_wrench(instant, spin, geometry.gravity, inertia, owned)
    driving = ca.vertcat(force, spin.matrix.T @ moment)
    still = ca.vertcat(s.time, s.rates)
    driving = ca.substitute(driving, still, ca.SX.zeros(7))
    multipliers = ca.SX.sym("multipliers", robot.n_cables)
    gradient = jacobian.T @ multipliers - driving
    hessian = ca.jacobian(gradient, s.zeta)
    lengths = ca.vertcat(*[cable.length for cable in instant.cables])
    outputs = {
        "scalar_value": _weight_potential(s, geometry, inertia) + ca.dot(multipliers, lengths),
        "gradient": gradient,
        "matrix_hessian": (hessian + hessian.T) / 2,
    }
    inputs = {"zeta": s.zeta, "multipliers": multipliers} | s.some("inertia", "values")
    return _function("lagrangian", inputs, outputs)


def _dynamics(
    robot: Robot,
    s: _Symbols,
    instant: Instant,
    spin: Spin,
    geometry: Geometry,
    inertia: Inertia,
    owned: Owned,
) -> dict[str, Function]:
    """Motion under given tensions, and with every cable held."""
    platform = Platform.of(instant, spin, inertia, geometry)
    tensions = ca.SX.sym("tensions", robot.n_cables)
    pulled = platform.under(geometry, owned, tensions)
    inputs = s.some("scalar_time", "zeta", "rates") | {"tensions": tensions}
    inputs |= s.some("inertia", "values")
    functions = {"pulled": _function("pulled", inputs, {"acceleration": pulled})}
    if robot.n_cables > LARGEST_SWINGING:
        return functions | _refused(robot, s, instant, owned)
    held = held_motion(robot, platform, geometry, owned)
    outputs = {"acceleration": held.acceleration, "tensions": held.tensions}
    functions["acceleration"] = _function("acceleration", s.named, outputs)
    return functions | _winch_functions(s, instant, held.change, held.change_rate)


def _winch_functions(
    s: _Symbols, instant: Instant, change: Expression, change_rate: Expression
) -> dict[str, Function]:
    """What the winches would tell, and how fast a state breaks it."""
    lengths = ca.vertcat(*[cable.length for cable in instant.cables])
    return {
        "told": _function("told", s.named, {"told": lengths - change}),
        "slip": _function("slip", s.named, {"slip": length_rates(instant) - change_rate}),
    }


def _refused(robot: Robot, s: _Symbols, instant: Instant, owned: Owned) -> dict[str, Function]:
    n = robot.n_cables
    refused = Refused(
        f"{n} cables hold the platform: with {LARGEST_SWINGING} or fewer it swings freely; use "
        "lengths, cables, lagrangian or pulled (given tensions) instead"
    )
    if stretches(owned):
        return {"acceleration": refused, "told": refused, "slip": refused}
    change, change_rate, _ = length_change(robot, instant, owned, needs_tension=False)
    return {"acceleration": refused} | _winch_functions(s, instant, change, change_rate)
