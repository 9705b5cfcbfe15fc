"""A driven robot with a set of effects as functions that share one graph of expressions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.drive import LEAST_DRIVEN, Drive
from freeswing.cdpr.driven.equations import rotation_of
from freeswing.cdpr.driven.parameters import Numbers, declared_numbers
from freeswing.cdpr.driven.scene import Premises, Scene, premises, scene
from freeswing.cdpr.effects import Parameter, effect_named
from freeswing.cdpr.robot import Robot

Array = NDArray[np.float64]
Function = Any
Expression = Any

N_STATE = 13  # pose 7 (position, quaternion w x y z) and twist 6


@dataclass(frozen=True, slots=True, eq=False)
class DrivenModel:
    """One driven robot with a set of effects.

    A state is [position of P 3; quaternion w x y z 4; velocity of P, base frame 3; angular
    velocity, platform frame 3], a twist its last six. `theta` below is every number of the
    robot's file (`numbers.values`) followed by the effects' values.

    Attributes:
        robot: what the model was built from.
        numbers: the file's numbers.
        effects: names of the effects, in the order of their values.
        parameters: the effects' parameters, in the order of their values.
        names: names of all of theta: `numbers.names`, then `effect.parameter`.
        declared: theta as declared, effects at their start values, (len(names),).
        premises: the constants as expressions, for those who derive more functions.
        lengths: (pose 7, theta) -> L (n,).
        drums: (theta) -> drum radii (n,).
        decays: (theta) -> the fastest that friction can stop each motor alone, 1/s (n,).
        motion: (state, currents, theta) -> acceleration of the twist (6,), tensions (n,), smoothed
            signs of unwinding (n,).
        needed: (state, acceleration, theta) -> the left side of (10), (6,): what the currents'
            wrench W_I I must be; force in the base frame, moment about P in the platform frame.
        wrench_matrix: (pose 7, theta) -> W_I (6, n) of (13), in the same frames as `needed`.
        lags: (theta) -> time constant of each current loop (n,).
        energy: (state, currents, theta) -> kinetic energy with the motors', potential energy of
            weight, springs and held currents.
    """

    robot: Robot
    numbers: Numbers
    effects: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    names: tuple[str, ...]
    declared: Array
    premises: Premises
    lengths: Function
    drums: Function
    decays: Function
    motion: Function
    needed: Function
    wrench_matrix: Function
    lags: Function
    energy: Function

    @property
    def drive(self) -> Drive:
        """The robot's drive.

        Raises:
            ValueError: for a robot whose cables nothing drives.
        """
        if self.robot.drive is None:
            raise ValueError(f"robot {self.robot.name} has no [drive]")
        return self.robot.drive

    @property
    def n_cables(self) -> int:
        """Number of cables n."""
        return self.robot.n_cables

    def index(self, name: str) -> int:
        """Where a name stands in theta.

        Raises:
            ValueError: when it is not there, naming what is.
        """
        if name not in self.names:
            raise ValueError(f"{name!r} is not one of {', '.join(self.names)}")
        return self.names.index(name)

    def theta(self, changes: dict[str, float]) -> Array:
        """The declared numbers with some of them changed, (len(names),)."""
        values = self.declared.copy()
        for name, value in changes.items():
            values[self.index(name)] = value
        return values


def build_driven(robot: Robot, effects: tuple[str, ...] = ()) -> DrivenModel:
    """The model of a driven robot with the named effects.

    Raises:
        ValueError: for an effect unknown, repeated or without a meaning here, fewer than
            `LEAST_DRIVEN` cables, a robot without [drive], mass or inertia.
    """
    if robot.n_cables < LEAST_DRIVEN:
        raise ValueError(
            f"robot {robot.name} has {robot.n_cables} driven cables: the direct dynamics of a "
            f"driven robot need n >= {LEAST_DRIVEN}"
        )
    if len(set(effects)) != len(effects):
        raise ValueError(f"an effect is named twice in {effects}")
    found = tuple(effect_named(name) for name in effects)
    for effect in found:
        if not effect.on_driven:
            raise ValueError(f"effect {effect.name} has no meaning for a driven robot")
    numbers = declared_numbers(robot)
    groups = [effect.parameters(robot) for effect in found]
    parameters = tuple(parameter for group in groups for parameter in group)
    names = [f"{e.name}.{p.name}" for e, g in zip(found, groups, strict=True) for p in g]
    given = premises(robot, numbers, found)
    return DrivenModel(
        robot,
        numbers,
        effects,
        parameters,
        (*numbers.names, *names),
        np.concatenate([numbers.values, [parameter.start for parameter in parameters]]),
        given,
        **_functions(given),
    )


def function(name: str, inputs: dict[str, Expression], outputs: dict[str, Expression]) -> Function:
    """A CasADi function with dense outputs, common subexpressions computed once."""
    dense = [ca.densify(output) for output in outputs.values()]
    return ca.Function(name, [*inputs.values()], dense, [*inputs], [*outputs], {"cse": True})


def _functions(given: Premises) -> dict[str, Function]:
    n, motors = given.robot.n_cables, given.terms.motors
    state, currents = ca.SX.sym("state", N_STATE), ca.SX.sym("currents", n)
    acceleration = ca.SX.sym("acceleration", 6)
    now = scene(given, state[:3], rotation_of(state[3:7]), state[7:], currents)
    solved = now.balanced.solved(now.balanced.effort)
    tensions = now.pulled.loose + now.pulled.reflected * (now.rows @ solved)
    unpowered = ca.substitute(now.balanced.effort, currents, ca.SX.zeros(n))
    gains = -now.rows.T @ ca.diag(motors.torque_constant / motors.drum_radius)
    posed = {"pose": state[:7], "theta": given.theta}
    moving = {"state": state, "currents": currents, "theta": given.theta}
    asked = {"state": state, "acceleration": acceleration, "theta": given.theta}
    left = {"needed": now.balanced.whole @ acceleration - unpowered}
    fastest = (motors.coulomb / motors.coulomb_width + motors.viscous) / motors.inertia
    outputs = {"acceleration": solved, "tensions": tensions, "signs": now.pulled.signs}
    return {
        "lengths": function("lengths", posed, {"lengths": now.lengths}),
        "drums": function("drums", {"theta": given.theta}, {"drums": motors.drum_radius}),
        "decays": function("decays", {"theta": given.theta}, {"decays": fastest}),
        "lags": function("lags", {"theta": given.theta}, {"lags": motors.time_constant}),
        "motion": function("motion", moving, outputs),
        "needed": function("needed", asked, left),
        "wrench_matrix": function("wrench_matrix", posed, {"matrix_wrench": gains}),
        "energy": function("energy", moving, _energy(given, now, state, currents)),
    }


def _energy(
    given: Premises, now: Scene, state: Expression, currents: Expression
) -> dict[str, Expression]:
    motors, body, twist = given.terms.motors, now.body, state[7:]
    turn = rotation_of(state[3:7])
    wound = now.lengths / motors.drum_radius
    rates = ca.vertcat(*[one.rate for one in now.lines]) / motors.drum_radius
    kinetic = ca.dot(twist, body.matrix(turn) @ twist) + ca.dot(motors.inertia, rates**2)
    potential = -ca.dot(given.terms.geometry.gravity, body.mass * state[:3] + turn @ body.moment)
    potential += ca.dot(motors.spring, wound**2) / 2 + ca.dot(
        motors.torque_constant * currents, wound
    )
    return {"scalar_kinetic": kinetic / 2, "scalar_potential": potential}
