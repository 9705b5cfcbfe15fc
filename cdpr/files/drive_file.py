"""[shape], [drive] and expressions of robot.toml to and from `Drive`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.drive import LEAST_DRIVEN, MOTOR_NUMBERS, Drive, Motor, Shape
from freeswing.cdpr.driven.formula import FUNCTIONS, Formula
from freeswing.cdpr.files.table_reader import Reader
from freeswing.cdpr.robot import LARGEST_FRAME_M

Array = NDArray[np.float64]

LARGEST_DRUM_M = 0.5  # a drum of 17.5 written in mm is 35 times this, one of 0.6 m drives a crane
LIMITS = ("current_limits_A", "tension_limits_N")
# Width of the smoothed sign of Coulomb friction, tanh(rate / width), where a file states none:
# 0.1 rad/s is 1.7 mm/s on a 17.5 mm drum, a hundredth of what excites a robot.
COULOMB_WIDTH_RAD_S = 0.1
OPTIONAL = {
    "spring_drum_radius_m": 0.0,
    "spring_N_m": 0.0,
    "viscous_N_m_s": 0.0,
    "coulomb_N_m": 0.0,
    "coulomb_width_rad_s": COULOMB_WIDTH_RAD_S,
}
MAY_BE_ZERO = ("spring_drum_radius_m", "spring_N_m", "viscous_N_m_s", "coulomb_N_m")
RESERVED = frozenset({*MOTOR_NUMBERS, *LIMITS, *FUNCTIONS, "mass_kg", "pi"})


@dataclass(frozen=True, slots=True)
class Named:
    """The shape of a file with its values.

    Attributes:
        shape: as the file has it.
        values: every name's number.
    """

    shape: Shape
    values: Mapping[str, float]

    def number(self, reader: Reader, key: str, source: object) -> tuple[Formula, float]:
        """A formula and its value; what is wrong is recorded under `key`."""
        nothing = Formula("0.0", ()), math.nan
        if not isinstance(source, str):
            value = reader.finite(key, source)
            return Formula(repr(value), ()), value
        try:
            formula = Formula.of(source)
        except ValueError as error:
            reader.add(key, str(error))
            return nothing
        unknown = [name for name in formula.names if name not in self.values]
        if unknown:
            known = ", ".join(self.values) or "none: the file has no [shape]"
            reader.add(key, f"{formula.text!r} names {', '.join(unknown)}; [shape] has {known}")
            return nothing
        return formula, _value(reader, key, formula, self.values)

    def point(self, reader: Reader, key: str) -> tuple[tuple[Formula, ...], Array]:
        """Three numbers or formulas and their values."""
        source = reader.raw(key)
        nothing = (Formula("0.0", ()),) * 3, np.full(3, np.nan)
        if source is None:
            return nothing
        if not isinstance(source, list):
            reader.add(key, "must be a list of 3 numbers or expressions")
            return nothing
        if len(source) != 3:
            reader.add(key, f"{len(source)} entries, must be 3 numbers")
            return nothing
        pairs = [self.number(reader, f"{key}[{i}]", entry) for i, entry in enumerate(source)]
        point = np.array([value for _, value in pairs])
        if np.abs(point).max() > LARGEST_FRAME_M:
            reader.add(
                key,
                f"{np.abs(point).max():g} m from the origin, more than {LARGEST_FRAME_M:g} m: "
                "this looks like mm or cm; write metres",
            )
        return tuple(formula for formula, _ in pairs), point


def read_shape(reader: Reader | None) -> Named:
    """[shape]: names in an order in which each needs earlier ones alone."""
    if reader is None:
        return Named(Shape(), {})
    waiting: dict[str, Formula] = {}
    for name in reader.table:
        source = reader.raw(name)
        if not name.isidentifier() or name in RESERVED:
            reader.add(name, "is not a name that an expression can use: letters, digits, _ ")
            continue
        try:
            waiting[name] = Formula.of(source)
        except ValueError as error:
            reader.add(name, str(error))
    ordered: dict[str, Formula] = {}
    values: dict[str, float] = {}
    while waiting:
        ready = [name for name, formula in waiting.items() if set(formula.names) <= set(values)]
        if not ready:
            _complain(reader, waiting, values)
            break
        for name in ready:
            ordered[name] = waiting.pop(name)
            values[name] = _value(reader, name, ordered[name], values)
    return Named(Shape(tuple(ordered), tuple(ordered.values())), values)


def _complain(reader: Reader, waiting: dict[str, Formula], values: dict[str, float]) -> None:
    """Names that are nowhere, or else a circle."""
    unknown = {
        name: [n for n in formula.names if n not in values and n not in waiting]
        for name, formula in waiting.items()
    }
    for name, missing in unknown.items():
        if missing:
            reader.add(name, f"{waiting[name].text!r} names {', '.join(missing)}, not in [shape]")
    if not any(unknown.values()):
        circle = ", ".join(waiting)
        first = next(iter(waiting))
        reader.add(first, f"{circle} are defined by each other; give one of them a number")


def _value(reader: Reader, key: str, formula: Formula, values: Mapping[str, float]) -> float:
    try:
        value = float(formula.at(values))
    except ValueError as error:
        reader.add(key, f"{formula.text!r}: {error}")
        return math.nan
    if not math.isfinite(value):
        reader.add(key, f"{formula.text!r} is {value}, must be finite")
        return math.nan
    return value


def read_motors(reader: Reader, cables: tuple[Reader, ...], named: Named) -> tuple[Motor, ...]:
    """[drive] with the overrides of every [cables.drive]."""
    if len(cables) < LEAST_DRIVEN:
        reader.add(
            "drum_radius_m",
            f"{len(cables)} driven cables: a driven robot needs n >= {LEAST_DRIVEN} (the direct "
            "dynamics hold for full poses alone); take [drive] away for one that swings freely",
        )
    common = {key: reader.raw(key, required=False) for key in (*MOTOR_NUMBERS, *LIMITS)}
    reader.finish()
    motors = []
    for cable in cables:
        own_reader = cable.child("drive", required=False)
        own = {} if own_reader is None else dict(own_reader.table)
        if own_reader is not None:
            for key in (*MOTOR_NUMBERS, *LIMITS):
                own_reader.raw(key, required=False)
            own_reader.finish()
        stated = reader if own_reader is None else own_reader
        where = {key: stated if key in own else reader for key in common}
        motors.append(_motor(where, {**common, **own}, frozenset(own), named))
    return tuple(motors)


def _motor(
    where: Mapping[str, Reader], sources: Mapping[str, object], own: frozenset[str], named: Named
) -> Motor:
    formulas, values = [], {}
    for key in MOTOR_NUMBERS:
        source = sources.get(key)
        source = OPTIONAL.get(key) if source is None else source
        if source is None:
            where[key].add(key, "missing")
            source = 1.0
        formula, values[key] = named.number(where[key], key, source)
        formulas.append(formula)
    _check_motor(where, sources, values)
    limits = [_limits(where[key], key, sources.get(key)) for key in LIMITS]
    return Motor(tuple(formulas), own & frozenset(MOTOR_NUMBERS), *limits)


def _check_motor(
    where: Mapping[str, Reader], sources: Mapping[str, object], values: Mapping[str, float]
) -> None:
    """Signs, sizes, and a spring with its drum."""
    for key, value in values.items():
        positive = key not in MAY_BE_ZERO
        if value < 0.0 or (positive and value == 0.0):
            where[key].add(key, f"{value:g} must be {'> 0' if positive else '>= 0'}")
        if key.endswith("radius_m") and value > LARGEST_DRUM_M:
            where[key].add(key, f"{value:g} m is no drum (limit {LARGEST_DRUM_M:g} m): mm? write m")
    if values["spring_drum_radius_m"] > 0.0 and not values["spring_N_m"] > 0.0:
        where["spring_drum_radius_m"].add(
            "spring_drum_radius_m", "a drum without a spring; give spring_N_m or leave both out"
        )
    if values["spring_N_m"] > 0.0 and not values["spring_drum_radius_m"] > 0.0:
        where["spring_N_m"].add(
            "spring_N_m", "a spring without its drum; give spring_drum_radius_m or leave both out"
        )


def _limits(reader: Reader, key: str, source: object) -> tuple[float, float]:
    if source is None:
        reader.add(key, "missing")
        return (math.nan, math.nan)
    reader = Reader({key: source}, reader.problems, reader.where)
    low, high = reader.vector(key, 2)
    if not low < high and math.isfinite(low) and math.isfinite(high):
        reader.add(key, f"[{low:g}, {high:g}] is the wrong way round: the least comes first")
    if key.startswith("tension") and low < 0.0:
        reader.add(key, f"{low:g} N: a cable cannot push; the least must be >= 0")
    return float(low), float(high)


def drive_table(drive: Drive) -> dict[str, object]:
    """[shape] and [drive] of a file; what differs of a cable is left to `cable_table`."""
    common = {}
    for index, key in enumerate(MOTOR_NUMBERS):
        shared = [motor.formulas[index] for motor in drive.motors if key not in motor.own]
        if shared:
            common[key] = _written(shared[0])
    common |= {key: list(getattr(drive.motors[0], key)) for key in LIMITS}
    shape = zip(drive.shape.names, drive.shape.formulas, strict=True)
    return {"shape": {name: _written(formula) for name, formula in shape} or None, "drive": common}


def cable_table(drive: Drive, index: int) -> dict[str, object]:
    """Points and own numbers of one cable as its file has them."""
    motor, first = drive.motors[index], drive.motors[0]
    own: dict[str, object] = {
        key: _written(formula)
        for key, formula in zip(MOTOR_NUMBERS, motor.formulas, strict=True)
        if key in motor.own
    }
    own |= {
        key: list(getattr(motor, key))
        for key in LIMITS
        if getattr(motor, key) != getattr(first, key)
    }
    return {
        "entry_m": [_written(formula) for formula in drive.entries[index]],
        "attachment_m": [_written(formula) for formula in drive.attachments[index]],
        "drive": own or None,
    }


def _written(formula: Formula) -> object:
    return float(formula.at({})) if formula.is_number else formula.text
