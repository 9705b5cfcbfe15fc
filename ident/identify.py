"""From recorded swings to inertial parameters with their uncertainty: the whole of `identify`."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from cdpr.documents import DataError
from cdpr.model import Model, build_model
from cdpr.robot import Array, Robot
from ident.comparison import ParameterComparison, compare
from ident.estimate import Estimate, fidim_entry
from ident.fidim import FidimEstimate, fidim
from ident.maximum_likelihood import ml_estimate
from ident.motion import SwingMotion, lowest_tension, regressor
from ident.payload import LoadedCentre, MassEstimate, mass_from_payloads
from ident.prepare import (
    PreparedRun,
    PreparedRuns,
    Progress,
    length_differences,
    prepare_runs,
    without,
)
from ident.runs import DroppedRun, Payload, SwingRun
from ident.signals import SignalSettings
from ident.validate import ValidatedRun, validate_run
from ident.weighted import UNEVEN, noisy_regressor, unevenness, weighted_fidim

FORMAT = "freeswing-identification/1"
_THINNED = 10  # samples skipped where only an impression of the regressor's noise is wanted


@dataclass(frozen=True, slots=True)
class IdentifySettings:
    """What to do.

    Attributes:
        signals: how samples become signals.
        weighting: of FIDIM: `published`, or `covariance` (the weighted form in its place).
        maximum_likelihood: whether the free motions themselves are fitted too.
        predict: whether validation runs are simulated.
    """

    signals: SignalSettings = field(default_factory=SignalSettings)
    weighting: Literal["published", "covariance"] = "published"
    maximum_likelihood: bool = True
    predict: bool = True


@dataclass(frozen=True, slots=True)
class Identification:
    """The result of `identify`.

    Attributes:
        estimates: by name: `fidim_free`, `fidim_full`, `ml_free`, `ml_full`, those that exist.
        comparison: free against full, by method.
        validation: of the best estimate, one entry a validation run.
        best: name of the best estimate.
        free_coordinates: those used.
        amplification: how many times more the pose moves than they do, at worst.
        notes: sentences about the session as a whole.
        prepared: the runs as they were used, for further analysis.
    """

    estimates: dict[str, Estimate]
    comparison: dict[str, tuple[ParameterComparison, ...]]
    validation: tuple[ValidatedRun, ...]
    best: str
    free_coordinates: tuple[str, ...]
    amplification: float
    notes: tuple[str, ...]
    prepared: PreparedRuns

    def document(self) -> dict[str, Any]:
        """results/identification.json."""
        return {
            "format": FORMAT,
            "estimates": {name: one.document() for name, one in self.estimates.items()},
            "comparison": {
                method: [
                    {
                        "name": row.name,
                        "difference_percent": _finite(row.difference_percent),
                        "std_percent": _finite(row.std_percent),
                        "z": _finite(row.z),
                    }
                    for row in rows
                ]
                for method, rows in self.comparison.items()
            },
            "validation": [run.document() for run in self.validation],
            "validated": self.best,
            "free_coordinates": list(self.free_coordinates),
            "amplification": _finite(self.amplification),
            "notes": list(self.notes),
        }


def identify(
    runs: list[SwingRun],
    robot: Robot,
    settings: IdentifySettings | None = None,
    progress: Progress | None = None,
) -> Identification:
    """Identify the platform's inertia from its free swings.

    Args:
        runs: all runs of the session; those with role `validate` are never fitted.
        robot: its geometry, and nominal inertia where known.
        settings: what to do.
        progress: told a label and a fraction.

    Raises:
        DataError: when the runs cannot give the inertial parameters, with the reasons.
    """
    settings = settings or IdentifySettings()
    if not any(run.role == "identify" and run.payload is None for run in runs):
        raise DataError(
            'no run with role = "identify" and without payload: there is nothing to identify from'
        )
    model = build_model(robot)
    try:
        prepared = prepare_runs(runs, model, settings.signals, progress)
    except ValueError as error:
        raise DataError(str(error)) from error
    prepared, by_fidim, failures = _fidim_estimates(model, prepared, settings, progress)
    if not by_fidim:
        raise DataError(_nothing_sentence(prepared, failures))
    estimates = dict(by_fidim)
    if settings.maximum_likelihood:
        added, more = _likelihood_estimates(model, prepared, by_fidim, progress)
        estimates.update(added)
        failures.update(more)
    best = next(n for n in ("ml_full", "ml_free", "fidim_full", "fidim_free") if n in estimates)
    comparison = {}
    for method in ("fidim", "ml"):
        if {f"{method}_free", f"{method}_full"} <= estimates.keys():
            comparison[method] = _compared(estimates[f"{method}_free"], estimates[f"{method}_full"])
    validation = _validated(model, prepared, estimates[best], best, settings, progress)
    return Identification(
        estimates=estimates,
        comparison=comparison,
        validation=validation,
        best=best,
        free_coordinates=prepared.free,
        amplification=prepared.amplification,
        notes=tuple(_session_notes(model, prepared, failures)),
        prepared=prepared,
    )


def _fidim_estimates(
    model: Model, prepared: PreparedRuns, settings: IdentifySettings, progress: Progress | None
) -> tuple[PreparedRuns, dict[str, Estimate], dict[str, str]]:
    """FIDIM by full poses and by free coordinates; slack runs found with its result leave."""
    found: dict[str, Estimate] = {}
    failures: dict[str, str] = {}
    for full in (True, False):
        name = "fidim_full" if full else "fidim_free"
        if progress:
            progress(f"FIDIM by {'full poses' if full else 'free coordinates'}", 0.5 * (not full))
        unloaded = _usable(prepared, full, None)
        if not unloaded:
            failures[name] = _unusable_sentence(_dropped(prepared, full))
            continue
        try:
            raw = fidim([regressor(model, _motion(run, full)) for run in unloaded])
            slack = _slack_runs(model, prepared, raw.values, full)
            if slack:
                prepared = without(prepared, slack)
                unloaded = _usable(prepared, full, None)
                raw = fidim([regressor(model, _motion(run, full)) for run in unloaded])
            found[name] = _completed(model, prepared, unloaded, raw, full, settings)
        except (ValueError, np.linalg.LinAlgError) as error:
            failures[name] = str(error)
    # A full-pose problem is quiet where poses were not measured: that is no failure.
    if not any(run.full is not None for run in prepared.runs):
        failures.pop("fidim_full", None)
    return prepared, found, failures


def _completed(
    model: Model,
    prepared: PreparedRuns,
    unloaded: list[PreparedRun],
    raw: FidimEstimate,
    full: bool,
    settings: IdentifySettings,
) -> Estimate:
    """The entry of one FIDIM solution: weighting, noise check, mass."""
    notes: list[str] = []
    weighted = None
    asked = settings.weighting == "covariance"
    noisy = [
        noisy_regressor(model, _signals(run, full), _motion(run, full), 1 if asked else _THINNED)
        for run in (unloaded if asked else unloaded[:3])
    ]
    if asked:
        weighted = weighted_fidim(noisy, raw.values)
    elif (ratio := unevenness(noisy)) > UNEVEN:
        notes.append(
            f"plain total least squares takes the regressor's columns to be equally noisy; theirs "
            f"differs up to {ratio:.0f} times, so values and standard deviations may be off; "
            'weighting = "covariance" gives the weighted form'
        )
    mass = _mass(model, prepared, raw, full, notes)
    entry = fidim_entry(raw, _dropped(prepared, full), tuple(notes), weighted)
    return replace(entry, mass=mass)


def _mass(
    model: Model, prepared: PreparedRuns, raw: FidimEstimate, full: bool, notes: list[str]
) -> MassEstimate | None:
    """Mass from payload runs, each payload identified by itself (eqs. 23, 24)."""
    payloads = {
        (run.run.payload.mass_kg, tuple(run.run.payload.position_m)): run.run.payload
        for run in prepared.runs
        if run.run.payload is not None and run.run.role == "identify"
    }
    loaded: list[LoadedCentre] = []
    for payload in payloads.values():
        runs = _usable(prepared, full, payload)
        try:
            one = fidim([regressor(model, _motion(run, full)) for run in runs])
        except (ValueError, np.linalg.LinAlgError) as error:
            notes.append(f"payload of {payload.mass_kg:g} kg not used: {error}")
            continue
        covariance = one.solution.covariance[:3, :3]
        loaded.append(LoadedCentre(payload, one.values[:3], covariance))
    if not loaded:
        return None
    try:
        return mass_from_payloads(raw.values[:3], raw.solution.covariance[:3, :3], loaded)
    except ValueError as error:
        notes.append(str(error))
        return None


def _likelihood_estimates(
    model: Model,
    prepared: PreparedRuns,
    by_fidim: dict[str, Estimate],
    progress: Progress | None,
) -> tuple[dict[str, Estimate], dict[str, str]]:
    """Maximum likelihood, started from FIDIM's result."""
    found: dict[str, Estimate] = {}
    failures: dict[str, str] = {}
    for full in (True, False):
        name = "ml_full" if full else "ml_free"
        runs = _fittable(prepared, full)
        start = by_fidim.get("fidim_full") or by_fidim.get("fidim_free")
        if not runs or start is None:
            continue
        free = None if full else prepared.free
        try:
            entry, _ = ml_estimate(model, runs, free, start.values, prepared.dropped, progress)
        except (ValueError, np.linalg.LinAlgError) as error:
            failures[name] = str(error)
            continue
        same_way = by_fidim.get("fidim_full" if full else "fidim_free")
        found[name] = replace(entry, mass=None if same_way is None else same_way.mass)
    return found, failures


def _compared(free: Estimate, full: Estimate) -> tuple[ParameterComparison, ...]:
    shown = free.essential | full.essential
    return compare(free.values, free.std, full.values, full.std, shown)


def _validated(
    model: Model,
    prepared: PreparedRuns,
    estimate: Estimate,
    name: str,
    settings: IdentifySettings,
    progress: Progress | None,
) -> tuple[ValidatedRun, ...]:
    full = name.endswith("full")
    runs = [
        run
        for run in prepared.runs
        if run.run.role == "validate"
        and run.run.payload is None
        and (run.full if full else run.free) is not None
    ]
    found = []
    for i, run in enumerate(runs):
        if progress:
            progress("validation", i / len(runs))
        found.append(validate_run(model, run, estimate.values, full, settings.predict))
    return tuple(found)


def _motion(run: PreparedRun, full: bool) -> SwingMotion:
    motion = run.full if full else run.free
    if motion is None:
        raise ValueError(f"run {run.name}: {run.why_not_free or 'full poses were not measured'}")
    return motion


def _signals(run: PreparedRun, full: bool):
    return run.signals if full or run.free_signals is None else run.free_signals


def _usable(prepared: PreparedRuns, full: bool, payload: Payload | None) -> list[PreparedRun]:
    """Runs to identify from, with this payload, that have the motion asked for."""
    return [
        run
        for run in prepared.runs
        if run.run.role == "identify"
        and _same_payload(run.run.payload, payload)
        and (run.full if full else run.free) is not None
    ]


def _fittable(prepared: PreparedRuns, full: bool) -> list[PreparedRun]:
    """Runs whose samples can be fitted: a singularity of the free coordinates is no obstacle."""
    return [
        run
        for run in prepared.runs
        if run.run.role == "identify"
        and run.run.payload is None
        and (run.full is not None if full else set(prepared.free) <= set(run.signals.coordinates))
    ]


def _same_payload(one: Payload | None, other: Payload | None) -> bool:
    if one is None or other is None:
        return one is other
    return one.mass_kg == other.mass_kg and bool((one.position_m == other.position_m).all())


def _slack_runs(model: Model, prepared: PreparedRuns, inertia: Array, full: bool) -> dict[str, str]:
    """Runs along which a cable pushes, by the estimated inertia: name and sentence."""
    slack = {}
    for run in prepared.runs:
        motion = run.full if full else run.free
        if motion is None or run.run.payload is not None:
            continue
        lowest, cable = lowest_tension(model, motion, inertia)
        if lowest < 0.0:
            slack[run.name] = (
                f"cable {cable} goes slack: its tension falls to {lowest:.2f} N per kg of platform"
            )
    return slack


def _dropped(prepared: PreparedRuns, full: bool) -> tuple[DroppedRun, ...]:
    """Runs left out of an estimate, those included that lack its motion."""
    if full:
        return prepared.dropped
    own = tuple(DroppedRun(r.name, r.why_not_free) for r in prepared.runs if r.free is None)
    return prepared.dropped + own


def _session_notes(model: Model, prepared: PreparedRuns, failures: dict[str, str]) -> list[str]:
    notes = [f"{name} is absent: {why}" for name, why in failures.items()]
    differences = [length_differences(model, run) for run in prepared.runs]
    known = np.array([d for d in differences if d is not None])
    if len(known) and np.abs(known).max() > 0.002:
        notes.append(
            f"stated cable lengths differ from those of the poses by up to "
            f"{1e3 * np.abs(known).max():.1f} mm: geometry, poses or lengths are off"
        )
    return notes


def _unusable_sentence(dropped: tuple[DroppedRun, ...]) -> str:
    if not dropped:
        return "no usable run"
    return f"no usable run; {dropped[-1].run}, for one: {dropped[-1].why}"


def _nothing_sentence(prepared: PreparedRuns, failures: dict[str, str]) -> str:
    lines = [f"{name}: {why}" for name, why in failures.items()]
    lines += [f"run {run.run}: {run.why}" for run in _dropped(prepared, False)]
    return "\n  ".join(["no inertial parameter can be identified from these runs", *lines])


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
