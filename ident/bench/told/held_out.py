"""Held-out runs of a bench: started from their first half, predicted over the second."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array
from freeswing.ident.bench.assemble import assembled
from freeswing.ident.bench.fit_rounds import Solved
from freeswing.ident.bench.modal import CREEP
from freeswing.ident.bench.noise import column_residuals
from freeswing.ident.bench.runs import Bench, BenchRun
from freeswing.ident.bench.swing import BenchSwing, Column
from freeswing.ident.likelihood.fit import Solution, fit
from freeswing.ident.likelihood.fit_blocks import Dense
from freeswing.ident.likelihood.unknowns import Mask, Unknowns


@dataclass(frozen=True, slots=True)
class HeldOut:
    """How one held-out run was predicted.

    Attributes:
        run: its name.
        column: the first of its columns, of which the error is told.
        rmse: predicted minus measured over the second half, in the column's unit; None: failed.
        floor: what was left over the first half, to which start and zero were fitted.
        note: why it failed, or empty.
    """

    run: str
    column: str
    rmse: float | None
    floor: float | None
    note: str = ""

    def document(self) -> dict[str, Any]:
        """The entry of `validation`."""
        entry = {
            "run": self.run,
            "column": self.column,
            "prediction_rmse": self.rmse,
            "noise_floor": self.floor,
        }
        return {**entry, "note": self.note} if self.note else entry


@dataclass(frozen=True, slots=True)
class Confronted:
    """What is left of a run that was not fitted, started from its first half.

    Attributes:
        columns: that it measured.
        off: predicted minus measured of each column's known samples, in its unit.
        later: which of them lie in the second half.
    """

    columns: tuple[Column, ...]
    off: tuple[Array, ...]
    later: tuple[Mask, ...]

    def rmse(self, place: int, later: bool = True) -> float:
        """Of one column over the second half, or the first."""
        which = self.later[place] if later else ~self.later[place]
        return float(np.sqrt(np.mean(self.off[place][which] ** 2)))


def held_out(model: Model, bench: Bench, found: Solved, run: BenchRun) -> HeldOut:
    """Predict a run that was not fitted, all shared unknowns held."""
    name = run.signals[0].column
    try:
        seen = confronted(model, bench, found.solution, run)
    except (ValueError, np.linalg.LinAlgError) as error:
        return HeldOut(run.name, name, None, None, str(error))
    return HeldOut(run.name, name, seen.rmse(0), seen.rmse(0, later=False))


def confronted(
    model: Model,
    bench: Bench,
    found: Solution,
    run: BenchRun,
    dress: Callable[[BenchSwing], BenchSwing] = lambda swing: swing,
) -> Confronted:
    """Predict a run that was not fitted over its second half.

    Args:
        model: the robot with its drag.
        bench: the session.
        found: the fit, whose shared unknowns are held.
        run: which.
        dress: gives the run the effects that the fit has beside drag.

    Raises:
        ValueError: where it cannot be followed, naming it.
    """
    start = assembled(model, replace(bench, loads=_loads(bench, run)), [run])
    swing = dress(start.swings[0])
    unknowns = _known(start.unknowns, found, swing)
    half = swing.times_s[len(swing.times_s) // 2]
    first = swing.until(half)
    fitted = fit([first], unknowns, Dense(steps=15, tolerance=0.1))
    values = fitted.unknowns.of_run(0)
    white = swing.residuals(values, swing.simulated(values))
    parts = column_residuals(swing, white)
    columns = swing.columns
    return Confronted(
        columns,
        tuple(p * (c.factor * c.std)[c.known] for c, p in zip(columns, parts, strict=False)),
        tuple(swing.times_s[column.known] > half for column in columns),
    )


def _loads(bench: Bench, run: BenchRun) -> tuple:
    return tuple(load for load in bench.loads if any(one.load == load.name for one in run.loads))


def _known(unknowns: Unknowns, found: Solution, swing: BenchSwing) -> Unknowns:
    """The run's own start and zero free; what the fit found of all else held."""
    told = {}
    for block in unknowns.blocks:
        if block.name in found.unknowns and not block.each_run:
            told[block.name] = found.value(block.name)
    effects = np.median(found.value("effects"), axis=0)
    told["effects"] = np.tile(effects, (1, 1))
    held = [block.name for block in unknowns.shared] + ["effects", "wires_each"]
    held += [CREEP] if CREEP in unknowns else []  # it says nothing of the second half
    acting = [one.block for one in swing.acting]
    more = [found.unknowns.block(name) for name in acting]
    return unknowns.moved(told).held(*held).joined(*more).held(*acting)
