"""Held-out runs of a bench: started from their first half, predicted over the second."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.ident.bench.assemble import assembled
from freeswing.ident.bench.noise import column_residuals
from freeswing.ident.bench.runs import Bench, BenchRun
from freeswing.ident.bench.solve import Solved
from freeswing.ident.bench.swing import BenchSwing, Column
from freeswing.ident.likelihood.fit_blocks import How, fit
from freeswing.ident.likelihood.unknowns import Unknowns


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


def held_out(model: Model, bench: Bench, found: Solved, run: BenchRun) -> HeldOut:
    """Predict a run that was not fitted, all shared unknowns held."""
    name = run.signals[0].column
    try:
        start = assembled(model, replace(bench, loads=_loads(bench, run)), [run])
        swing = start.swings[0]
        unknowns = _known(start.unknowns, found, swing)
        half = swing.times_s[len(swing.times_s) // 2]
        first = _until(swing, half)
        fitted = fit([first], unknowns, How(steps=15, tolerance=0.1))
        values = fitted.unknowns.of_run(0)
        white = swing.residuals(values, swing.simulated(values))
    except (ValueError, np.linalg.LinAlgError) as error:
        return HeldOut(run.name, name, None, None, str(error))
    column, part = swing.columns[0], column_residuals(swing, white)[0]
    off = part * column.factor * column.std[column.known]
    later = swing.times_s[column.known] > half
    rmse, floor = (float(np.sqrt(np.mean(off[which] ** 2))) for which in (later, ~later))
    return HeldOut(run.name, name, rmse, floor)


def _loads(bench: Bench, run: BenchRun) -> tuple:
    return tuple(load for load in bench.loads if any(one.load == load.name for one in run.loads))


def _known(unknowns: Unknowns, found: Solved, swing: BenchSwing) -> Unknowns:
    """The run's own start and zero free; what the fit found of all else held."""
    told = {}
    for block in unknowns.blocks:
        if block.name in found.solution.unknowns and not block.each_run:
            told[block.name] = found.solution.value(block.name)
    effects = np.median(found.solution.value("effects"), axis=0)
    told["effects"] = np.tile(effects, (1, 1))
    held = [block.name for block in unknowns.shared] + ["effects", "wires_each"]
    return unknowns.moved(told).held(*held)


def _until(swing: BenchSwing, end_s: float) -> BenchSwing:
    inside = swing.times_s <= end_s
    columns = tuple(_part(column, inside) for column in swing.columns)
    return replace(swing, times_s=swing.times_s[inside], columns=columns)


def _part(column: Column, inside: np.ndarray) -> Column:
    return replace(column, values=column.values[inside], std=column.std[inside])
