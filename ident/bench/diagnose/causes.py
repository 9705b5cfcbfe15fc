"""What may be missing on a bench: effects of the catalogue in the few forms that its wires show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.effects import Effect, Parameter, effect_named
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import Array, Robot
from freeswing.ident.bench.assemble import EFFECTS
from freeswing.ident.bench.swing import COMMON, Acting, BenchSwing
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown, Unknowns

# Numbers of an effect that runs on one bench may tell, by their places among its parameters; the
# others stay where they start. Vertical forces are weight, damping of stretch is drag.
PARTLY = {
    "quadratic_drag": (0,),
    "gravity_tilt": (0, 1),
    "cable_elasticity": (0,),
    "cable_mass": (0,),
    "torsion_spring": (0, 1),
    "constant_force": (0, 1),
}
ENDS = ("attachment_offset", "anchor_offset")
HOOKS = "yielding_clamp"
LENGTHS = "cable_length_bias"
ALL_WIRES = "all wires"
# What no run of any bench tells from a cause: the same equations in other words.
SAME = {
    "attachment_offset": ("marker_offset",),
    "torsion_spring": ("platform_mass",),
    LENGTHS: ("attachment_offset", "anchor_offset", "platform_frame"),
}


@dataclass(frozen=True, slots=True)
class Cause:
    """One candidate.

    Attributes:
        effect: of the catalogue.
        part: the cable that it is of, or "".
        parameters: its numbers, each along one row of `directions`.
        directions: from these numbers to the effect's own parameters, (k, size).
    """

    effect: str
    part: str
    parameters: tuple[Parameter, ...]
    directions: Array

    @property
    def block(self) -> str:
        """Name of its unknowns."""
        if self.part == ALL_WIRES:
            return COMMON
        return f"missing.{self.effect}" + (f":{self.part}" if self.part else "")

    def unknown(self) -> Unknown:
        """Its block, at zero."""
        zero = np.zeros(len(self.parameters))
        spread = np.array([parameter.prior_std for parameter in self.parameters])
        scale = np.array([parameter.scale for parameter in self.parameters])
        prior = Gaussian(zero, spread, "plausible size")
        low = np.where([one.low < 0.0 for one in self.parameters], -np.inf, 0.0)
        return Unknown(self.block, zero, scale, prior, low=low)

    def of_run(self, share: float) -> Array:
        """The same in a run that weighs `share` times what the numbers are told for, (k, size)."""
        return self.directions * share ** mass_power(effect_named(self.effect))


def mass_power(effect: Effect) -> int:
    """How specific numbers of an effect go with the mass that hangs: forces over it, stretch with.

    Source:
        FIDIM 2022, eqs. (8) to (10) divided by the mass; Hooke's law over it.
    """
    if effect.stage != "force":
        return 0
    return 1 if type(effect).length_change is not Effect.length_change else -1


def causes_of(robot: Robot, only: Sequence[str] | None = None) -> tuple[Cause, ...]:
    """All candidates beside linear drag and the wires' lengths, which every fit has."""
    found = []
    for name, places in PARTLY.items():
        own = effect_named(name).parameters(robot)
        directions = np.eye(len(own))[:, list(places)]
        found.append(Cause(name, "", tuple(own[k] for k in places), directions))
    for name in ENDS:
        found += _ends(robot, name)
    found += _hooks(robot)
    longer = Parameter("bias_m", -0.1, 0.1, 0.005)
    found.append(Cause(LENGTHS, ALL_WIRES, (longer,), np.zeros((0, 1))))
    return tuple(one for one in found if only is None or one.effect in only)


def _ends(robot: Robot, name: str) -> list[Cause]:
    """All ends shifted sideways alike, and each one by itself; up and down is a wire's length."""
    own = effect_named(name).parameters(robot)
    eye, found = np.eye(len(own)), []
    flat = [
        [k for k, one in enumerate(own) if one.part == cable.name][:2] for cable in robot.cables
    ]
    together = np.stack([eye[:, list(places)].sum(axis=1) for places in zip(*flat, strict=True)], 1)
    alike = tuple(replace(own[flat[0][k]], name=f"offset_{axis}_m") for k, axis in enumerate("xy"))
    found.append(Cause(name, "", alike, together))
    for cable, places in zip(robot.cables, flat, strict=True):
        found.append(Cause(name, cable.name, tuple(own[k] for k in places), eye[:, places]))
    return found


def _hooks(robot: Robot) -> list[Cause]:
    """All hooks that yield alike, and each one by itself."""
    own = effect_named(HOOKS).parameters(robot)
    alike = replace(own[0], name="mass_over_stiffness_s2", part="")
    found = [Cause(HOOKS, "", (alike,), np.ones((len(own), 1)))]
    for k, one in enumerate(own):
        found.append(Cause(HOOKS, one.part, (one,), np.eye(len(own))[:, [k]]))
    return found


def dressed(
    swings: Sequence[BenchSwing], causes: Sequence[Cause], shares: Array
) -> tuple[BenchSwing, ...]:
    """The swings in a model that has some causes.

    Args:
        swings: the runs.
        causes: all that it has beside drag.
        shares: of the mass that the causes' numbers are told for, by run, (r,).
    """
    robot = swings[0].model.robot
    causes = [cause for cause in causes if cause.block != COMMON]  # every bench has its block
    names = tuple(dict.fromkeys(cause.effect for cause in causes))
    model = build_model(robot, (*EFFECTS, *names))
    own = len(build_model(robot, EFFECTS).parameters)
    found = []
    for swing, share in zip(swings, shares, strict=True):
        acting = []
        for cause in causes:
            matrix = np.zeros((len(model.parameters) - own, len(cause.parameters)))
            place = model.place_of(cause.effect)
            matrix[place.start - own : place.stop - own] = cause.of_run(float(share))
            acting.append(Acting(cause.block, matrix))
        chart = replace(swing.chart, model=model)
        found.append(replace(swing, model=model, chart=chart, acting=tuple(acting)))
    return tuple(found)


def wanting(unknowns: Unknowns, causes: Sequence[Cause]) -> Unknowns:
    """The unknowns with an estimated block for every cause."""
    if any(cause.block == COMMON for cause in causes):
        unknowns = unknowns.estimating(COMMON, np.ones(1, dtype=bool))
    more = [cause.unknown() for cause in causes if cause.block not in unknowns]
    return unknowns.joined(*more)
