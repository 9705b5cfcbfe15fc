"""How far runs that were not fitted are predicted: held-out ones, else each left out in turn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import Array
from freeswing.ident.bench.assemble import EFFECTS
from freeswing.ident.bench.diagnose.causes import dressed
from freeswing.ident.bench.diagnose.search import Ground
from freeswing.ident.bench.diagnose.weigh import Fit
from freeswing.ident.bench.noise import column_residuals
from freeswing.ident.bench.runs import Bench, BenchRun
from freeswing.ident.bench.told.held_out import confronted
from freeswing.ident.diagnose.answer.averages import known_number, median, rms

SECOND_DIFFERENCES = np.sqrt(6.0)  # times white noise


@dataclass(frozen=True, slots=True)
class Errors:
    """Prediction errors.

    Attributes:
        runs: names, (r,).
        metres: rms of each over its positions; NaN: it measures none, or cannot be followed.
        radians: over its angles.
        floor_m: what neighbouring samples differ by at random, all runs together.
    """

    runs: tuple[str, ...]
    metres: Array
    radians: Array
    floor_m: float

    def document(self) -> dict[str, Any]:
        """An entry of `ladder`."""
        return {
            "sigma_perp": None,
            "prediction_rmse_m": rms(self.metres),
            "prediction_rmse_rad": rms(self.radians),
            "noise_floor_m": known_number(self.floor_m),
            "sigma_perp_median": None,
            "prediction_median_m": median(self.metres),
            "runs": [
                {
                    "run": name,
                    "sigma_perp": None,
                    "prediction_rmse_m": known_number(metres),
                    "prediction_rmse_rad": known_number(radians),
                    "noise_floor_m": known_number(self.floor_m),
                }
                for name, metres, radians in zip(self.runs, self.metres, self.radians, strict=True)
            ],
        }


def errors_of(bench: Bench, ground: Ground, one: Fit) -> Errors:
    """Of held-out runs over their second halves; without any, of each run left out in turn."""
    floor = _floor(one)
    checked = [run for run in bench.runs if run.role == "validate"]
    if not checked:
        metres, radians = one.left_out()
        return Errors(tuple(swing.name for swing in one.swings), metres, radians, floor)
    seen = np.array([_predicted(bench, ground, one, run) for run in checked])
    return Errors(tuple(run.name for run in checked), seen[:, 0], seen[:, 1], floor)


def _predicted(bench: Bench, ground: Ground, one: Fit, run: BenchRun) -> tuple[float, float]:
    model = build_model(ground.swings[0].model.robot, EFFECTS)
    platform = float(one.solution.value("platform")[0])

    def dress(swing):
        share = swing.total(_bodies(one))[0] / platform
        return dressed([swing], one.causes, np.array([share]))[0]

    try:
        seen = confronted(model, bench, one.solution, run, dress)
    except (ValueError, np.linalg.LinAlgError):
        return np.nan, np.nan
    squares: tuple[list[Array], list[Array]] = ([], [])
    for column, off, later in zip(seen.columns, seen.off, seen.later, strict=True):
        if column.coordinate is not None:
            squares[column.coordinate // 3].append(off[later] ** 2)
    metres, radians = (
        float(np.sqrt(np.mean(np.concatenate(part)))) if part else np.nan for part in squares
    )
    return metres, radians


def _bodies(one: Fit) -> dict[str, Array]:
    return {
        block.name: block.value for block in one.solution.unknowns.shared if block.name != "scatter"
    }


def _floor(one: Fit) -> float:
    """White noise of positions in metres, by how neighbouring residuals differ."""
    found: list[float] = []
    for swing, white in zip(one.swings, one.solution.residuals, strict=True):
        for column, part in zip(swing.columns, column_residuals(swing, white), strict=False):
            if column.coordinate is not None and column.coordinate < 3:
                off = part * (column.factor * column.std)[column.known]
                noise = np.std(np.diff(off, 2)) / SECOND_DIFFERENCES
                found.append(float(noise) ** 2)
    return float(np.sqrt(np.mean(found))) if found else np.nan
