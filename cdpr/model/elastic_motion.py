"""Cables as springs with damping: the full elastic motion beside the quasi-static one.

A model with the effects `SPRUNG` lets the cables pull with the tension of their stretch instead of
holding their length. `simulate`, `linearise` and `Motion.tensions` take it as they take any other;
every state is admissible. `cable_elasticity` alone is its slow, quasi-static limit.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.model.constrained import Owned
from freeswing.cdpr.robot import Array

if TYPE_CHECKING:
    from freeswing.cdpr.model.equations import Model

SPRUNG = ("cable_elasticity", "cable_vibration")
Functions = dict[str, Any]
PLUCKED_M_S2 = 9.81  # a cable plucked by 1 pulls by the whole weight more than it would
EASED = 5  # steps, each of which leaves the strain's share of the last one


def springs_of(owned: Owned) -> tuple[Expression, ...]:
    """Compliance, its product with the relaxation, and what vibration has; () without springs.

    Raises:
        ValueError: for vibration without elasticity.
    """
    values = {effect.name: its for effect, its in owned}
    elastic, vibrating = (values.get(name) for name in SPRUNG)
    if vibrating is None:
        return ()
    if elastic is None:
        raise ValueError(f"{SPRUNG[1]} without {SPRUNG[0]}: rigid cables do not vibrate")
    return elastic[0], elastic[1], vibrating


def held_by(owned: Owned) -> Owned:
    """What a model is made of whose cables are held where others are springs."""
    return [one for one in owned if one[0].name not in SPRUNG] if springs_of(owned) else owned


def sprung(held: Functions, s: dict[str, Expression], springs: tuple[Expression, ...]) -> Functions:
    """What springs change of a model whose cables are held.

    Tension = EA (strain + relaxation strain rate), never pushing.

    Args:
        held: its functions, without stretch.
        s: all inputs by name.
        springs: of `springs_of`.

    Returns:
        `acceleration`, `told` (the unstretched lengths), `slip` (zero), `plucked` and `energy`,
        which holds the stretch's too.
    """
    compliance, damping, vibration = springs
    plucked, rest = vibration[0], vibration[1:]
    everything = [*s.values()]
    _, zeta, rates, inertia, values = everything
    stretch = held["told"](*everything) - rest
    slip = held["slip"](*everything)
    stiffness = 1 / (compliance * (held["lengths"](zeta, values) - stretch))
    tensions = ca.fmax(0, stiffness * (stretch + damping / compliance * slip))
    acceleration = held["pulled"](*everything[:3], tensions, inertia, values)
    kinetic, potential = held["energy"](zeta, rates, inertia, values)
    stored = ca.sum1(stiffness * ca.fmax(0, stretch) ** 2) / 2
    stored = ca.substitute(stored, ca.vertcat(s["scalar_time"], rates), ca.SX.zeros(7))
    slow = ca.SX.zeros(rest.numel())
    if isinstance(held["acceleration"], ca.Function):  # held by six cables there is no such motion
        slow = held["acceleration"](*everything)[1]
    excess = ca.vertcat(stiffness * stretch - slow, ca.sqrt(stiffness) * slip)
    moving = {name: s[name] for name in ("zeta", "rates", "inertia", "values")}
    energies = {"scalar_kinetic": kinetic, "scalar_potential": potential + stored}
    outputs = {
        "acceleration": {"acceleration": acceleration, "tensions": tensions},
        "told": {"told": rest},
        "slip": {"slip": ca.SX.zeros(rest.numel())},
        "plucked": {"plucked": excess / (PLUCKED_M_S2 * plucked)},
        "energy": energies,
    }
    return {
        name: _function(name, moving if name == "energy" else s, told)
        for name, told in outputs.items()
    }


def at_ease(
    model: Model, zeta: Array, rates: Array, inertia: Array, values: Array, time_s: float = 0.0
) -> Array:
    """The values with unstretched lengths that a state does not pluck, (k,).

    As they are in a model without springs.

    Args:
        model: with or without springs.
        zeta: pose, (6,).
        rates: their rates, (6,).
        inertia: `INERTIA_NAMES` values, (9,).
        values: effect values, (k,).
        time_s: time of the state.

    Source:
        Meirovitch 2001, Fundamentals of Vibrations, ch. 1: a spring at rest bears its static load.
    """
    if model.plucked is None:
        return values
    own, values = lengths_of(model), values.copy()
    compliance = values[model.place_of(SPRUNG[0])][0]
    lengths = evaluate(model.lengths, zeta, values)[0]
    values[own] = lengths
    usual = PLUCKED_M_S2 * values[own.start - 1]
    for _ in range(EASED):
        state = (time_s, zeta, rates, inertia, values)
        excess = usual * evaluate(model.plucked, *state)[0][: model.robot.n_cables]
        values[own] += compliance * values[own] * excess
    return values


def lengths_of(model: Model) -> slice:
    """Where the unstretched lengths of a model with springs stand among its values."""
    where = model.place_of(SPRUNG[1])
    return slice(where.start + 1, where.stop)


def elastic_values(
    model: Model,
    mass_over_stiffness_s2_m: float,
    unstretched_m: Array,
    relaxation_s: float = 1e-3,
    values: Array | None = None,
) -> Array:
    """Values (k,) of a model with springs.

    Args:
        model: with the effects `SPRUNG`.
        mass_over_stiffness_s2_m: the platform's mass over EA.
        unstretched_m: (n,); those that keep the start free of vibration are what `at_ease` gives.
        relaxation_s: damping of the material.
        values: the others, (k,); None for those that leave the declared model as it is.

    Raises:
        ValueError: when the compliance or a length is not above zero, or the damping is negative.

    Source:
        Meirovitch 2001, Fundamentals of Vibrations, ch. 1: springs and dashpots in parallel.
    """
    unstretched = np.asarray(unstretched_m, dtype=np.float64)
    n = model.robot.n_cables
    if not mass_over_stiffness_s2_m > 0.0:
        raise ValueError(
            f"mass_over_stiffness_s2_m is {mass_over_stiffness_s2_m}, must be above 0; for rigid "
            "cables use build_model"
        )
    if not relaxation_s >= 0.0:
        raise ValueError(f"relaxation_s is {relaxation_s}, must be 0 or above")
    if unstretched.shape != (n,) or not (unstretched > 0.0).all():
        raise ValueError(f"unstretched_m is {unstretched}: {n} lengths above 0 are needed")
    found = model.start_values if values is None else np.array(values, dtype=np.float64)
    found[model.place_of(SPRUNG[0])] = (
        mass_over_stiffness_s2_m,
        mass_over_stiffness_s2_m * relaxation_s,
    )
    found[lengths_of(model)] = unstretched
    return found


def _function(name: str, inputs: dict[str, Expression], outputs: dict[str, Expression]) -> Any:
    dense = [ca.densify(output) for output in outputs.values()]
    return ca.Function(name, [*inputs.values()], dense, [*inputs], [*outputs], {"cse": True})
