"""Cables as springs with damping: the full elastic motion beside the quasi-static one.

`elastic_model` gives a `Model` whose acceleration lets the cables pull with the tension of their
stretch instead of holding their length, from the same expressions. `simulate`, `linearise` and
`Motion.tensions` take it as they take any other; every state is admissible. The effect
`cable_elasticity` is its slow, quasi-static limit, three to four times faster to simulate.
"""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np

from freeswing.cdpr.effects import Parameter
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.robot import Array, Robot

QUASI_STATIC = "cable_elasticity"


def elastic_model(robot: Robot, effects: tuple[str, ...] = ()) -> Model:
    """The model of `robot` on elastic cables, for any number of cables.

    Its values are those of the effects, then `elastic_cables.mass_over_stiffness_s2_m` (the
    platform's mass over EA), `elastic_cables.relaxation_s` (damping: tension = EA (strain +
    relaxation strain rate), never pushing) and the unstretched length of each cable from D.
    `acceleration` gives specific tensions as well; `told` the unstretched lengths; `slip` zero;
    `energy` holds the stretch's energy too.

    Args:
        robot: its declared constants.
        effects: names of effects, without `cable_elasticity`.

    Raises:
        ValueError: for an unknown or repeated effect, or `cable_elasticity` among them.
    """
    if QUASI_STATIC in effects:
        raise ValueError(f"elastic cables replace the effect {QUASI_STATIC}: leave it out")
    held = build_model(robot, effects)
    own = (
        Parameter("mass_over_stiffness_s2_m", 1e-7, 0.01, 2e-4, start=1e-5),
        Parameter("relaxation_s", 0.0, 0.05, 1e-3, start=1e-3),
        *(Parameter(f"unstretched_{c.name}_m", 0.01, 100.0, 0.01, start=1.0) for c in robot.cables),
    )
    return replace(
        held,
        parameters=(*held.parameters, *own),
        names=(*held.names, *(f"elastic_cables.{parameter.name}" for parameter in own)),
        **_functions(held, robot.n_cables),
    )


def elastic_values(
    model: Model,
    mass_over_stiffness_s2_m: float,
    unstretched_m: Array,
    relaxation_s: float = 1e-3,
    values: Array | None = None,
) -> Array:
    """Values (k + 2 + n,) of an elastic model.

    Args:
        model: of `elastic_model`.
        mass_over_stiffness_s2_m: the platform's mass over EA.
        unstretched_m: (n,); those that keep the start free of vibration are what `told` of the
            model with `cable_elasticity` gives at the start.
        relaxation_s: damping of the material.
        values: of the effects, (k,); None for those that leave the declared model as it is.

    Raises:
        ValueError: when the compliance or a length is not above zero, or the damping is negative.
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
    own = model.start_values[: -2 - n] if values is None else np.asarray(values)
    return np.concatenate([own, [mass_over_stiffness_s2_m, relaxation_s], unstretched])


def _functions(held: Model, n: int) -> dict[str, ca.Function]:
    time, zeta, rates = ca.SX.sym("t"), ca.SX.sym("zeta", 6), ca.SX.sym("rates", 6)
    inertia, k = ca.SX.sym("inertia", 9), len(held.parameters)
    values = ca.SX.sym("values", k + 2 + n)
    own, compliance, relaxation, rest = values[:k], values[k], values[k + 1], values[k + 2 :]
    told = held.told(time, zeta, rates, inertia, own)
    slip = held.slip(time, zeta, rates, inertia, own)
    stretch = told - rest
    paid_out = held.lengths(zeta, own) - stretch
    stiffness = 1 / (compliance * paid_out)
    tensions = ca.fmax(0, stiffness * (stretch + relaxation * slip))
    acceleration = held.pulled(time, zeta, rates, tensions, inertia, own)
    kinetic, potential = held.energy(zeta, rates, inertia, own)
    stored = ca.sum1(stiffness * ca.fmax(0, stretch) ** 2) / 2
    stored = ca.substitute(stored, ca.vertcat(time, rates), ca.SX.zeros(7))
    everything = {
        "scalar_time": time,
        "zeta": zeta,
        "rates": rates,
        "inertia": inertia,
        "values": values,
    }
    pose = {"zeta": zeta, "values": values}
    posed = {"zeta": zeta, "inertia": inertia, "values": values}
    moving = {"zeta": zeta, "rates": rates, "values": values}
    pulled = everything | {"tensions": ca.SX.sym("tensions", n)}
    pulled = {name: pulled[name] for name in held.pulled.name_in()}

    def function(
        name: str, inputs: dict[str, ca.SX], results: list[ca.SX], names: list[str]
    ) -> ca.Function:
        dense = [ca.densify(result) for result in results]
        return ca.Function(name, [*inputs.values()], dense, [*inputs], names, {"cse": True})

    def same(name: str, inputs: dict[str, ca.SX]) -> ca.Function:
        """A function that does not see the cables' own values."""
        before = getattr(held, name)
        arguments = [own if key == "values" else symbol for key, symbol in inputs.items()]
        return function(name, inputs, before.call(arguments), before.name_out())

    state = {"zeta": zeta, "rates": rates} | {"inertia": inertia, "values": values}
    multipliers = {"zeta": zeta, "multipliers": ca.SX.sym("multipliers", n)} | posed
    return {
        "acceleration": function(
            "acceleration", everything, [acceleration, tensions], ["acceleration", "tensions"]
        ),
        "told": function("told", everything, [rest], ["told"]),
        "slip": function("slip", everything, [ca.SX.zeros(n)], ["slip"]),
        "energy": function(
            "energy", state, [kinetic, potential + stored], ["scalar_kinetic", "scalar_potential"]
        ),
        "lengths": same("lengths", pose),
        "cables": same("cables", pose),
        "domain": same("domain", pose),
        "cable_rates": same("cable_rates", moving),
        "mass_matrix": same("mass_matrix", posed),
        "lagrangian": same("lagrangian", multipliers),
        "measured": same("measured", everything),
        "pulled": same("pulled", pulled),
    }
