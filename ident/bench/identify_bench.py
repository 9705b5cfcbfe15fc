"""`identify` for benches: every run of a session in one fit, and what it says of each body."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import POSE_COORDINATES, Array, Robot
from freeswing.ident.bench.assemble import EFFECTS, assembled
from freeswing.ident.bench.channels import check_moves
from freeswing.ident.bench.fit_rounds import Solved, solved
from freeswing.ident.bench.noise import left_worst
from freeswing.ident.bench.priors.wire_priors import with_lengths
from freeswing.ident.bench.runs import Bench, BenchRun, Signal, check_swings
from freeswing.ident.bench.told.budget import budget
from freeswing.ident.bench.told.classic_formula import (
    ClassicRun,
    classic_runs,
    held_sentences,
    leaning_sentence,
    unchecked_lengths,
)
from freeswing.ident.bench.told.contradicted import contradictions, exchange_sentence
from freeswing.ident.bench.told.envelope import Envelope, envelopes, law_chances
from freeswing.ident.bench.told.held_out import HeldOut, held_out
from freeswing.ident.bench.told.kinds_doubt import with_kinds_counted
from freeswing.ident.bench.told.report_objects import (
    channels_document,
    objects_document,
    platform_rows,
)
from freeswing.ident.bench.told.rolled import rolled_sentences
from freeswing.ident.bench.told.scatter_by_kind import scatter_sentence
from freeswing.ident.bench.told.wire_ends import UNSCALED, with_ends_counted
from freeswing.ident.bench.two_wires.free_roll import not_freed_sentence
from freeswing.ident.likelihood.cable_ends import GeometryPriors


@dataclass(frozen=True, slots=True)
class BenchResult:
    """What a bench session gives.

    Attributes:
        solved: the fit.
        bench: the session, with the runs as fitted.
        classic: the classic formula beside it, by run.
        validation: held-out runs.
        notes: what a reader must know.
        decay: amplitude of yaw against time, by run.
        ends: how well it is known where the wires end.
    """

    solved: Solved
    bench: Bench
    classic: tuple[ClassicRun, ...]
    validation: tuple[HeldOut, ...]
    notes: tuple[str, ...]
    decay: tuple[Envelope, ...] = ()
    ends: GeometryPriors = field(default_factory=GeometryPriors)

    def document(self) -> dict[str, Any]:
        """results/identification.json."""
        runs = tuple(run for run in self.bench.runs if run.role == "identify")
        robot = self.solved.swings[0].model.robot
        name = "ml_full" if all(run.coordinates == POSE_COORDINATES for run in runs) else "ml_free"
        return {
            "format": "freeswing-identification/1",
            "estimates": {name: self._platform()},
            "comparison": {},
            "validation": [one.document() for one in self.validation],
            "validated": name,
            "free_coordinates": list(robot.free_coordinates or ()),
            "amplification": None,
            "notes": list(self.notes),
            "objects": objects_document(self.solved, self.bench, runs),
            "channels": channels_document(self.solved, self.bench),
            "budgets": self._budgets(),
            "classic": [one.document() for one in self.classic],
            "scatter_between_runs_kg_m2": self.solved.scatter_std,
            "yaw_decay": {
                "laws": law_chances(self.decay),
                "runs": [one.document() for one in self.decay],
            },
        }

    def _budgets(self) -> list[dict[str, Any]]:
        """Where the deviation of every body's Izz about P comes from, largest first."""
        names = [name for name in self.solved.solution.unknowns.names if name.startswith("load.")]
        return [
            {
                "name": name.removeprefix("load."),
                "shares": [share.document() for share in budget(self.solved, name)],
            }
            for name in ("platform", *names)
        ]

    def _platform(self) -> dict[str, Any]:
        """The nine specific numbers of the platform; those that only a prior holds are null."""
        samples = sum(len(swing.times_s) for swing in self.solved.swings)
        return {
            "parameters": platform_rows(self.solved),
            "samples": samples,
            "dropped_runs": [],
            "notes": list(self.notes),
            "stop_reason": self.solved.solution.reason,
        }


def identify_bench(bench: Bench, robot: Robot, ends: GeometryPriors | None = None) -> BenchResult:
    """Fit all runs of a bench session together.

    Args:
        bench: the session.
        robot: as declared.
        ends: how well it is known where the wires end; what it leaves out is as the robot says.

    Raises:
        DataError: when the data cannot give a result, naming run, number and remedy.
    """
    check_runs(bench, robot)
    model = build_model(robot, EFFECTS)
    runs = tuple(with_lengths(model, run) for run in bench.runs)
    bench = replace(bench, runs=tuple(_windowed(run) for run in runs))
    fitted = [run for run in bench.runs if run.role == "identify"]
    try:
        found = with_kinds_counted(solved(model, bench, assembled(model, bench, fitted)))
    except (ValueError, np.linalg.LinAlgError) as error:
        raise DataError(f"the bench's runs cannot be fitted: {error}") from error
    checked = [run for run in bench.runs if run.role == "validate"]
    validation = tuple(held_out(model, bench, found, run) for run in checked)
    classic = tuple(classic_runs(found, robot.platform.mass_kg))
    ends = (ends or GeometryPriors()).or_declared(robot)
    found = with_ends_counted(found, robot, ends)
    rolled = rolled_sentences(found, fitted)
    if ends.stds and not any(run.coordinates for run in fitted):
        rolled.append(UNSCALED)
    sway = any({"x", "y"} & set(run.coordinates) for run in fitted)
    leaning = leaning_sentence(classic, sway)
    notes = [*([leaning] if leaning else []), *_notes(found, bench, robot), *rolled]
    notes += [f"run {run.name}: {note}" for run in bench.runs for note in run.notes]
    return BenchResult(found, bench, classic, validation, tuple(notes), envelopes(found), ends)


def check_runs(bench: Bench, robot: Robot) -> None:
    """Refuse a session whose runs cannot give what is asked of them.

    Raises:
        DataError: naming what is missing, or the run and the column that shows nothing.
    """
    fitted = [run for run in bench.runs if run.role == "identify"]
    if not fitted:
        raise DataError('no run with role = "identify": there is nothing to identify from')
    if bench.loads and all(run.loads for run in fitted) and robot.inertia is None:
        raise DataError(
            "every run carries a load and the platform's inertia is not given: object and platform "
            "cannot be told apart; add a run of the empty platform, or one with a known payload"
        )
    if bench.loads and robot.platform.mass_kg is None and not any(r.payloads for r in fitted):
        raise DataError(
            "loads are to be measured, and neither the platform's mass_kg nor a run with a known "
            "payload is given: weigh the platform, or add a run with a known mass on it"
        )
    for run in bench.runs:
        if run.lengths_m is None and run.coordinates != POSE_COORDINATES:
            raise DataError(
                f"run {run.name}: it measures {', '.join(run.coordinates) or 'channels'} alone and "
                "cable_lengths_m is not given: give the wires' lengths"
            )
        if run.level_std_rad is not None and robot.n_cables != 2:
            raise DataError(
                f"run {run.name}: level_std_rad says how a platform rolls on two wires, and this "
                f"one hangs on {robot.n_cables}: leave it out"
            )
        check_swings(run)
        for signal in run.signals:
            if not signal.is_coordinate:
                check_moves(run.name, signal.column, signal.values)


def _windowed(run: BenchRun) -> BenchRun:
    """The run's stated window alone; without one all of it."""
    if run.window_s is None:
        return run
    inside = (run.times_s >= run.window_s[0]) & (run.times_s <= run.window_s[1])
    if inside.sum() < 20:
        raise DataError(
            f"run {run.name}: {int(inside.sum())} samples in window_s {list(run.window_s)}; it "
            f"lasts from {run.times_s[0]:.10g} to {run.times_s[-1]:.10g} s: correct window_s, or "
            "leave it out"
        )
    return replace(
        run,
        times_s=run.times_s[inside],
        signals=tuple(_part(signal, inside) for signal in run.signals),
    )


def _part(signal: Signal, inside: Array) -> Signal:
    std = None if signal.std is None else signal.std[inside]
    return replace(signal, values=signal.values[inside], std=std)


def _notes(found: Solved, bench: Bench, robot: Robot) -> list[str]:
    fitted = [run for run in bench.runs if run.role == "identify"]
    notes = contradictions(found)
    notes += filter(None, [exchange_sentence(fitted)])
    notes += filter(None, [unchecked_lengths(found, fitted)])
    notes += held_sentences(found)
    scaled = any(run.coordinates for run in fitted)
    notes += filter(None, [not_freed_sentence(found.swings[0].model, found.held, scaled)])
    if bench.loads and found.mass is None and bench.mass_std_kg is None:
        notes.append(
            "no run carries a known payload: the loads' inertia rests on the declared platform "
            "mass (I_load = s m_load + (s - s_tare) m_platform); a run with a known mass far from "
            "the middle, or mass_std_kg, says how well"
        )
    left = left_worst(found.swings, found.solution)
    if left is not None:
        notes.append(
            f"{left.sentence}: something is missing that the fit does not have, or it has lost "
            "count of the swings. Run `freeswing diagnose`; where that finds nothing, do not rely "
            "on the result"
        )
    notes += _gain_notes(found, bench)
    scattered = scatter_sentence(found)
    notes += [scattered] if scattered else []
    if not found.solution.converged:
        notes.append(f"the fit has not converged ({found.solution.reason}): do not rely on it")
    return notes


def _gain_notes(found: Solved, bench: Bench) -> list[str]:
    """What the gains of uncalibrated channels rest on."""
    notes = []
    told = {one["name"]: one["gains"] for one in channels_document(found, bench)}
    for channel in bench.channels:
        main = channel.main_coordinate
        name = f"channel.{channel.name}"
        if main in channel.gains or name not in found.solution.unknowns:
            continue
        if channel.per_run:
            notes.append(f"channel {channel.name}: its gains are new in every run and not reported")
            continue
        if any(main in run.coordinates for run in bench.runs):
            continue
        gain = told[channel.name][channel.coordinates.index(main)]
        rests = f"channel {channel.name}: its gain for {main} is not given and rests on how the "
        if gain["value"] is None:
            notes.append(f"{rests}period depends on amplitude, which these runs do not tell")
        else:
            value, std = gain["value"], gain["std"]
            half = float(f"{std:.2g}")  # 2400, not 2.4e+03
            notes.append(f"{rests}period depends on amplitude alone: {value:.4g} +- {half:g}")
    return notes
