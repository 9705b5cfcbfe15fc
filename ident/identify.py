"""From recorded swings to inertial parameters with their uncertainty: the whole of `identify`."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from freeswing.cdpr.effects import Recorded, catalogue
from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.robot import Robot
from freeswing.cdpr.system.progress import Progress
from freeswing.cdpr.system.threads import side_by_side
from freeswing.ident.estimate import Estimate
from freeswing.ident.fidim.fidim_stage import How, Weighting, fidim_estimates
from freeswing.ident.fitted import Fitted, moved_by_missing, with_missing
from freeswing.ident.inertia_starts import likelihood_starts
from freeswing.ident.judge.far_samples import far_from_prediction
from freeswing.ident.judge.free_against_full import ParameterComparison, between_runs, compare
from freeswing.ident.judge.free_swing_law import LawlessError, fidim_complaint
from freeswing.ident.judge.lawful_runs import best_ml_estimate
from freeswing.ident.judge.prediction import Prediction, fitted_motions
from freeswing.ident.judge.validate import ValidatedRun, validate_run
from freeswing.ident.judge.wrong_geometry import geometry_of, with_doubts
from freeswing.ident.likelihood.cable_ends import GeometryPriors, corrected
from freeswing.ident.likelihood.calibration_modes import freed
from freeswing.ident.likelihood.session_estimates import Asked
from freeswing.ident.runs import SwingRun
from freeswing.ident.signals.derivatives import SignalSettings
from freeswing.ident.signals.usable_runs import (
    LARGEST_AMPLIFICATION,
    PreparedRun,
    PreparedRuns,
    fittable,
    left_out,
    length_differences,
    motion_of,
    prepare_runs,
    usable,
    without,
)

FORMAT = "freeswing-identification/1"


@dataclass(frozen=True, slots=True)
class IdentifySettings:
    """What to do.

    Attributes:
        signals: how samples become signals.
        weighting: of FIDIM: `published`, or `covariance` (the weighted form in its place).
        maximum_likelihood: whether the free motions themselves are fitted too.
        predict: whether validation runs are simulated.
        consistent: whether inertias are held to what a body can have.
        geometry: how well the cables' ends are known; as robot.toml states where it says nothing.
    """

    signals: SignalSettings = field(default_factory=SignalSettings)
    weighting: Weighting = "published"
    maximum_likelihood: bool = True
    predict: bool = True
    consistent: bool = False
    geometry: GeometryPriors = field(default_factory=GeometryPriors)


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
        fitted: runs that the best estimate was fitted to, beside the motions found for them;
            maximum likelihood alone.
    """

    estimates: dict[str, Estimate]
    comparison: dict[str, tuple[ParameterComparison, ...]]
    validation: tuple[ValidatedRun, ...]
    best: str
    free_coordinates: tuple[str, ...]
    amplification: float
    notes: tuple[str, ...]
    prepared: PreparedRuns
    fitted: tuple[Prediction, ...] = ()

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
    try:
        settings = replace(settings, geometry=settings.geometry.or_declared(robot))
    except ValueError as error:
        raise DataError(f"[tolerances] of the robot file, taken for {error}") from error
    model = build_model(robot)
    try:
        prepared = prepare_runs(runs, model, settings.signals, progress)
    except ValueError as error:
        raise DataError(str(error)) from error
    prepared, by_fidim, fitted, failures, lawless = _estimated(
        model, prepared, settings, robot, progress
    )
    meaningless = _meaningless(model, prepared, by_fidim, fitted, lawless)
    failures.update(meaningless)
    estimates = {name: one for name, one in by_fidim.items() if name not in meaningless}
    estimates.update({name: one.estimate for name, one in fitted.items()})
    if not estimates:
        raise DataError(_nothing_sentence(prepared, failures))
    best = next(n for n in ("ml_full", "ml_free", "fidim_full", "fidim_free") if n in estimates)
    comparison = {}
    for method in ("fidim", "ml"):
        if {f"{method}_free", f"{method}_full"} <= estimates.keys():
            comparison[method] = _compared(estimates[f"{method}_free"], estimates[f"{method}_full"])
    truer = fitted[best].robot if best in fitted else robot
    validation = _validated(truer, prepared, estimates[best], best, settings, progress)
    followed = [*fitted[best].motions] if best in fitted else []
    followed += [run.prediction for run in validation if run.prediction]
    far = (far_from_prediction(one) for one in followed)
    return Identification(
        estimates=estimates,
        comparison=comparison,
        validation=validation,
        best=best,
        free_coordinates=prepared.free,
        amplification=prepared.amplification,
        notes=(
            *session_notes(model, prepared, failures),
            *_unseen(prepared, best),
            *filter(None, far),
        ),
        prepared=prepared,
        fitted=fitted[best].motions if best in fitted else (),
    )


def _estimated(
    model: Model,
    prepared: PreparedRuns,
    settings: IdentifySettings,
    robot: Robot,
    progress: Progress | None,
) -> tuple[PreparedRuns, dict[str, Estimate], dict[str, Fitted], dict[str, str], bool]:
    """Both methods on the runs that are taut and obey the law of a free swing.

    What maximum likelihood cannot explain has no place in FIDIM either; and which runs are slack
    is asked again, since FIDIM's inertia with a lawless run in it may say so of any.

    Returns:
        The runs that serve, FIDIM's estimates, maximum likelihood's, why others are absent, and
        whether it is because no run follows any law.
    """
    ends = settings.geometry.model(robot) if settings.geometry.stds else None
    how = How(settings.weighting, settings.signals, ends), progress, settings.consistent
    taut, by_fidim, failures = fidim_estimates(model, prepared, *how)
    if not settings.maximum_likelihood:
        return taut, by_fidim, {}, failures, False
    while True:
        fitted, more, lawless = _likelihood_estimates(taut, by_fidim, settings, robot, progress)
        left = [drop for one in fitted.values() for drop in one.estimate.dropped if drop.lawless]
        if not left:
            break
        served = {run.name for run in taut.runs}
        prepared = without(prepared, {drop.run: drop.why for drop in left})
        taut, by_fidim, failures = fidim_estimates(model, prepared, *how)
        if served >= {run.name for run in taut.runs}:
            break
    fitted, told = with_missing(fitted), how[0]
    if size := max((one.wrong.size for one in fitted.values()), default=0.0):
        told = replace(told, wrong=geometry_of(robot, settings.geometry), wrong_size=size)
    if moved := moved_by_missing(fitted):
        told = replace(told, missing=moved)
    if told is not how[0]:
        taut, by_fidim, failures = fidim_estimates(model, prepared, told, *how[1:])
    return taut, by_fidim, fitted, {**failures, **more}, lawless


def _likelihood_estimates(
    prepared: PreparedRuns,
    by_fidim: dict[str, Estimate],
    settings: IdentifySettings,
    robot: Robot,
    progress: Progress | None,
) -> tuple[dict[str, Fitted], dict[str, str], bool]:
    """Maximum likelihood, started from FIDIM's result or, where that leads nowhere, elsewhere.

    Returns:
        The estimates, why others are absent, and whether it is because no run follows any law.
    """
    found: dict[str, Fitted] = {}
    failures: dict[str, str] = {}
    results = tuple(by_fidim[n].values for n in ("fidim_full", "fidim_free") if n in by_fidim)
    starts = likelihood_starts(build_model(robot), prepared, results)
    masses = [one.mass.mass_kg for one in by_fidim.values() if one.mass is not None]
    asked = Asked(settings.consistent, next(iter(masses), robot.platform.mass_kg))
    lawless = False
    for full in (True, False):
        name = "ml_full" if full else "ml_free"
        runs = fittable(prepared, full)
        if not runs or lawless:
            continue
        free = None if full else prepared.free
        model = settings.geometry.model(robot, _nuisances(robot, runs))
        try:
            entry, fit = best_ml_estimate(
                model, runs, free, starts, prepared.dropped, progress, asked
            )
        except (ValueError, np.linalg.LinAlgError) as error:
            failures[name] = str(error)
            lawless = isinstance(error, LawlessError)
            continue
        starts = [entry.values, *starts]
        told, wrong, missing = with_doubts(entry, fit)
        truer, motions = corrected(robot, fit.model, fit.values), fitted_motions(fit)
        found[name] = Fitted(told, truer, motions, wrong, missing)
    return found, failures, lawless


def _nuisances(robot: Robot, runs: list[PreparedRun]) -> tuple[str, ...]:
    """Effects of no interest that these runs' poses may have: each has a frame of its own."""
    recorded = Recorded(slow_errors=any(run.run.trajectory.slow is not None for run in runs))
    nuisances = (effect for effect in catalogue().values() if effect.nuisance)
    return tuple(one.name for one in nuisances if not one.cannot_show(robot, recorded))


def _meaningless(
    model: Model,
    prepared: PreparedRuns,
    by_fidim: dict[str, Estimate],
    fitted: dict[str, Fitted],
    lawless: bool,
) -> dict[str, str]:
    """FIDIM's results that say nothing of a platform, by name, with the reason."""
    found = {}
    for name, one in by_fidim.items():
        full = name == "fidim_full"
        motions = [motion_of(run, full) for run in usable(prepared, full, None)]
        complaint = fidim_complaint(model, motions, one, bool(fitted), lawless and not fitted)
        if complaint:
            found[name] = complaint
    return found


def _compared(free: Estimate, full: Estimate) -> tuple[ParameterComparison, ...]:
    shown = free.essential | full.essential
    between = np.zeros(9)
    both = [name for name in free.without_run if name in full.without_run]
    if both:
        pairs = [(free.without_run[name], full.without_run[name]) for name in both]
        between = between_runs(np.array([after - before for before, after in pairs]))
    return compare(free.values, free.std, full.values, full.std, shown, between)


def _validated(
    robot: Robot,
    prepared: PreparedRuns,
    estimate: Estimate,
    name: str,
    settings: IdentifySettings,
    progress: Progress | None,
) -> tuple[ValidatedRun, ...]:
    """The held-out runs confronted with an estimate, and with the robot that goes with it.

    Errors of the cameras' calibration that the estimate was freed of leave these runs too.
    """
    full, model = name.endswith("full"), build_model(robot)
    held_out = [one for one in prepared.runs if one.run.role == "validate" and not one.run.payload]
    found_geometry = settings.geometry.stds and name.startswith("ml")
    if held_out and (found_geometry or len(estimate.calibration)):
        told = replace(robot, free_coordinates=prepared.free)
        swings = [freed(one.run, estimate.calibration) for one in held_out]
        again = prepare_runs(swings, build_model(told), settings.signals)
        held_out = list(again.runs)
    runs = [run for run in held_out if (run.full if full else run.free) is not None]
    if progress and runs:
        progress("validation", 0.0)

    def confronted(run: PreparedRun) -> ValidatedRun:
        return validate_run(model, run, estimate.values, full, settings.predict)

    return tuple(side_by_side(confronted, runs))


def _unseen(prepared: PreparedRuns, best: str) -> list[str]:
    """Why runs that were held out are not among those that the best estimate is shown on."""
    if best.endswith("full"):
        return []
    runs = [run for run in prepared.runs if run.run.role == "validate" and run.free is None]
    return [f"run {run.name} is held out, and not compared: {run.why_not_free}" for run in runs]


def session_notes(model: Model, prepared: PreparedRuns, failures: dict[str, str]) -> list[str]:
    """Sentences on what a reader of the numbers must know, the failures first."""
    notes = [f"{name} is absent: {why}" for name, why in failures.items()]
    if prepared.amplification > LARGEST_AMPLIFICATION:
        notes.append(
            f"the free coordinates {', '.join(prepared.free)} do not settle the pose everywhere: "
            f"it moves up to {prepared.amplification:.3g} times more than they do; full poses "
            'projected on them (fidim_full, sigma_perp) suffer too; free_coordinates = "auto" '
            "chooses better ones"
        )
    differences = [length_differences(model, run) for run in prepared.runs]
    known = np.array([d for d in differences if d is not None])
    if len(known) and np.abs(known).max() > 0.002:
        notes.append(
            f"stated cable lengths differ from those of the poses by up to "
            f"{1e3 * np.abs(known).max():.1f} mm: geometry, poses or lengths are off"
        )
    return notes


def _nothing_sentence(prepared: PreparedRuns, failures: dict[str, str]) -> str:
    lines = [f"{name}: {why}" for name, why in failures.items()]
    lines += [f"run {run.run}: {run.why}" for run in left_out(prepared, False)]
    return "\n  ".join(["no inertial parameter can be identified from these runs", *lines])


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
