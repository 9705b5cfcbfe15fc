"""The expressions of one instant of a driven robot, effects included."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from freeswing.cdpr.driven.equations import Balance, Body, Line, Pull, balance, line, pull
from freeswing.cdpr.driven.parameters import Numbers, Terms, terms
from freeswing.cdpr.effects import Effect, Instant
from freeswing.cdpr.robot import Robot

Expression = Any
Owned = tuple[tuple[Effect, Expression], ...]


@dataclass(frozen=True, slots=True)
class Premises:
    """A robot's constants as expressions, with the effects that act at run time.

    Attributes:
        robot: what they are of.
        theta: every number of the file, then every effect's values.
        terms: geometry, motors and body with the effects' changes in them.
        owned: the effects with their values.
    """

    robot: Robot
    theta: Expression
    terms: Terms
    owned: Owned


def premises(robot: Robot, numbers: Numbers, effects: tuple[Effect, ...]) -> Premises:
    """Symbols for everything that is a number, and what follows from them alone."""
    counts = [len(effect.parameters(robot)) for effect in effects]
    used = len(numbers.names)
    theta = ca.SX.sym("theta", used + sum(counts))
    declared, owned = terms(robot, numbers, theta[:used]), []
    for effect, count in zip(effects, counts, strict=True):
        values = theta[used : used + count]
        geometry = effect.geometry(declared.geometry, values)
        motors = effect.motors(declared.motors, values)
        declared = replace(declared, geometry=geometry, motors=motors)
        owned.append((effect, values))
        used += count
    return Premises(robot, theta, declared, tuple(owned))


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything at a pose, twist and currents.

    Attributes:
        body: what moves.
        lines: the cables.
        pulled: tensions as a function of the acceleration.
        outer: weight and effects, (6,).
        balanced: the equations of motion.
        rows: lengthening of a unit twist, (n, 6).
        lengths: L, (n,).
    """

    body: Body
    lines: tuple[Line, ...]
    pulled: Pull
    outer: Expression
    balanced: Balance
    rows: Expression
    lengths: Expression


def scene(
    given: Premises,
    position: Expression,
    turn: Expression,
    twist: Expression,
    currents: Expression,
) -> Scene:
    """The expressions at a position, rotation matrix, twist and currents."""
    body = Body.of(given.terms.body)
    for effect, values in given.owned:
        for mass, place in effect.payloads(values):
            body = body.with_point(mass, place)
    n = given.robot.n_cables
    lines = tuple(line(given.terms, i, position, turn, twist) for i in range(n))
    pulled = pull(given.terms.motors, lines, currents)
    outer = body.weight(turn, given.terms.geometry.gravity)
    outer += _effect_wrench(given, lines, position, turn, twist)
    return Scene(
        body,
        lines,
        pulled,
        outer,
        balance(body, lines, pulled, turn, twist, outer),
        rows=ca.horzcat(*[one.row for one in lines]).T,
        lengths=ca.vertcat(*[one.state.length for one in lines]),
    )


def _effect_wrench(
    given: Premises,
    lines: tuple[Line, ...],
    position: Expression,
    turn: Expression,
    twist: Expression,
) -> Expression:
    """Wrenches of the effects, which state them over the mass, about P in the base frame."""
    mass, com = given.terms.body[0], given.terms.body[1:4]
    instant = Instant(
        time_s=ca.SX(0),
        zeta=ca.vertcat(position, ca.SX.nan(3)),
        rates=ca.vertcat(twist[:3], ca.SX.nan(3)),
        rotation=turn,
        omega=turn @ twist[3:],
        com=turn @ com,
        cables=tuple(one.state for one in lines),
    )
    total = ca.SX.zeros(6)
    for effect, values in given.owned:
        wrench = effect.wrench(instant, values)
        if wrench is not None:
            total += mass * ca.vertcat(wrench[:3], turn.T @ wrench[3:])
    return total
