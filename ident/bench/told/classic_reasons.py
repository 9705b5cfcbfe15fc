"""Why the classic formula is off: what each thing that it leaves out does to it, one by one.

The fitted bench is made the formula's bench in steps: wires alike, the centre of mass in the
middle, nothing that rolls along. What the squared period changes by in each step is that step's
share; with those of the mass, of the stated length, of the amplitude and of what the fit leaves,
they multiply to all that the formula is off by.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.statics import modes
from freeswing.cdpr.robot import INERTIA_NAMES, Array
from freeswing.ident.bench.modal import stable_rest
from freeswing.ident.bench.objects import specific
from freeswing.ident.bench.swing import BenchSwing

MASS = "declared mass"
LENGTH = "stated wire length"
UNEQUAL = "unequal wires"
BESIDE = "centre of mass beside the middle"
ROLLS = "rolling along"
LEAN = "wires that lean"
AMPLITUDE = "amplitude and sway"
LEFT = "what the fit leaves"
IZZ_SPECIFIC = INERTIA_NAMES.index("Izz_m2")
PRODUCTS = tuple(INERTIA_NAMES.index(name) for name in ("Ixy_m2", "Ixz_m2", "Iyz_m2"))
CHI = 5


@dataclass(frozen=True, slots=True)
class Measured:
    """What the formula makes of a run.

    Attributes:
        mass_kg: that it takes.
        izz_kg_m2: that it gives.
        period_s: of the samples.
        simulated_s: period of the fitted swing, by the same sine; None: not to be had.
    """

    mass_kg: float
    izz_kg_m2: float
    period_s: float
    simulated_s: float | None


def yaw_period(model: Model, lengths_m: Array, rest: Array, inertia: Array) -> float:
    """Period of the small oscillation that turns most about the vertical, s.

    Args:
        model: the robot.
        lengths_m: of the wires, (n,).
        rest: a pose near, (6,).
        inertia: specific, (9,).

    Raises:
        ValueError: where there is no stable rest pose, or the inertia is no body's.

    Source:
        FIDIM 2022, eqs. (38), (39).
    """
    found = stable_rest(model, rest, lengths_m, inertia)
    told = modes(model, found, inertia)  # shapes have unit modal mass: yaw's is the largest turn
    return float(1.0 / told.frequencies_hz[int(np.argmax(np.abs(told.shapes[CHI])))])


def reasons_of(
    swing: BenchSwing, values: Mapping[str, Array], measured: Measured
) -> tuple[tuple[str, float], ...]:
    """Shares of the difference in per cent: 1 + off is the product of 1 + share of all of them.

    Args:
        swing: the run.
        values: as fitted.
        measured: by the formula.

    Source:
        du Bois, Lieven, Adhikari 2009, Error analysis in trifilar inertia measurements, sec. 3.
    """
    total = swing.total(values)
    fitted, stated = swing.lengths(values), float(np.mean(swing.lengths_m))
    mean = float(np.mean(fitted))
    factors: dict[str, float] = {MASS: measured.mass_kg / float(total[0]), LENGTH: mean / stated}
    with suppress(ValueError, np.linalg.LinAlgError):  # a plainer bench that hangs nowhere
        factors |= _by_steps(swing, fitted, specific(total), measured)
    off = measured.izz_kg_m2 / float(total[6])
    factors[LEFT] = off / float(np.prod(list(factors.values())))
    return tuple((name, 100.0 * (factor - 1.0)) for name, factor in factors.items())


def _by_steps(
    swing: BenchSwing, lengths_m: Array, inertia: Array, measured: Measured
) -> dict[str, float]:
    """Squared periods over those of the next plainer bench, and of the plainest over the formula.

    Raises:
        ValueError: where one of the benches has no rest.
    """
    model, robot = swing.model, swing.model.robot
    alike = np.full(len(lengths_m), float(np.mean(lengths_m)))
    middle = np.array(inertia)
    middle[:2] = robot.attachments_m.mean(axis=0)[:2]
    plain = np.array(middle)
    plain[list(PRODUCTS)] = 0.0
    benches = [(lengths_m, inertia), (alike, inertia), (alike, middle), (alike, plain)]
    squares = [yaw_period(model, wires, swing.rest, body) ** 2 for wires, body in benches]
    top, bottom = (spread_of(ends) for ends in (robot.entries_m, robot.attachments_m))
    gravity = float(np.linalg.norm(robot.gravity_m_s2))
    spring = gravity * top * bottom / float(alike[0])  # over the mass
    squares.append(4.0 * np.pi**2 * float(inertia[IZZ_SPECIFIC]) / spring)
    names = (UNEQUAL, BESIDE, ROLLS, LEAN)
    ratios = np.divide(squares[:-1], squares[1:]).tolist()
    found: dict[str, float] = dict(zip(names, ratios, strict=True))
    if measured.simulated_s is not None:
        found[AMPLITUDE] = measured.simulated_s**2 / squares[0]
    return found


def spread_of(points_m: Array) -> float:
    """Root mean square distance of points (n, 3) from their middle, m.

    Source:
        du Bois, Lieven, Adhikari 2009, eq. 1: its radii, for ends that are not on a circle.
    """
    off = points_m - points_m.mean(axis=0)
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))
