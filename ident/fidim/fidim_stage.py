"""FIDIM on a session's runs: by full poses, by free coordinates, weighted, with the mass."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.regressor import regressor
from freeswing.cdpr.robot import Array
from freeswing.cdpr.system.progress import Progress
from freeswing.ident.estimate import Estimate, fidim_entry
from freeswing.ident.fidim.bias import noise_bias, smoothing_bias
from freeswing.ident.fidim.calibration_share import calibration_share
from freeswing.ident.fidim.ends_share import ends_share, geometry_share, missing_share
from freeswing.ident.fidim.fidim import FidimEstimate, fidim
from freeswing.ident.fidim.length_share import length_share
from freeswing.ident.fidim.payload_mass import LoadedCentre, MassEstimate, mass_from_payloads
from freeswing.ident.fidim.scatter import scattered
from freeswing.ident.fidim.shares import Share, Stack, shares_sentence
from freeswing.ident.fidim.slack_runs import slack_runs, within_reach
from freeswing.ident.fidim.weighted_least_squares import (
    NoisyRegressor,
    noisy_regressor,
    weighing,
    weighted_fidim,
)
from freeswing.ident.judge.free_against_full import between_runs
from freeswing.ident.judge.physical_consistency import nearest_possible
from freeswing.ident.likelihood.between_runs import widened
from freeswing.ident.runs import DroppedRun
from freeswing.ident.signals.derivatives import SignalSettings
from freeswing.ident.signals.usable_runs import (
    PreparedRun,
    PreparedRuns,
    left_out,
    motion_of,
    signals_used,
    usable,
    without,
)

Weighting = Literal["published", "covariance"]
NOT_HELD = (
    "standard deviations hold nothing of the errors of robot.toml that residuals of the motions "
    "ask for: its cables cannot be moved so far"
)


@dataclass(frozen=True, slots=True)
class How:
    """How FIDIM is done and what its deviations hold beside the equations' scatter.

    Attributes:
        weighting: `published`, or `covariance`.
        settings: what made the signals; None: deviations hold the scatter and the calibration
            alone, which is enough where values to start from are wanted.
        ends: the robot with cable ends of known spread
            (`ident.likelihood.cable_ends.GeometryPriors.model`); None where they are exact.
        wrong: the robot with cables' geometry of known spread that errs as a whole, so many times
            as far as that (`ident.judge.wrong_geometry`); None where no residuals say so.
        wrong_size: how many.
        missing: what forces that the motions lack do to the inertia, a row each, by full poses
            (True) and by free coordinates (`ident.judge.missing_forces`).
    """

    weighting: Weighting = "published"
    settings: SignalSettings | None = None
    ends: Model | None = None
    wrong: Model | None = None
    wrong_size: float = 0.0
    missing: Mapping[bool, Array] = field(default_factory=dict)


def fidim_estimates(
    model: Model,
    prepared: PreparedRuns,
    how: How,
    progress: Progress | None,
    consistent: bool = False,
) -> tuple[PreparedRuns, dict[str, Estimate], dict[str, str]]:
    """FIDIM by full poses and by free coordinates; slack runs found with its result leave.

    With `consistent` an inertia that no body can have is replaced by the nearest possible one.

    Returns:
        The runs without the slack ones, `fidim_full` and `fidim_free` as far as they exist, and
        why the others do not, by name.
    """
    found: dict[str, Estimate] = {}
    failures: dict[str, str] = {}
    for full in (True, False):
        name = "fidim_full" if full else "fidim_free"
        if progress:
            progress(f"FIDIM by {'full poses' if full else 'free coordinates'}", 0.5 * (not full))
        unloaded = usable(prepared, full, None)
        if not unloaded:
            failures[name] = _unusable_sentence(left_out(prepared, full))
            continue
        try:
            equations = _equations(model, unloaded, full)
            raw = fidim(equations)
            slack = slack_runs(model, prepared, within_reach(raw), full)
            if slack:
                prepared = without(prepared, slack)
                equations = _equations(model, usable(prepared, full, None), full)
                raw = fidim(equations)
            entry = _completed(model, prepared, raw, Stack(equations, raw.essential), full, how)
            found[name] = _consistent(entry, consistent)
        except (ValueError, np.linalg.LinAlgError) as error:
            failures[name] = str(error)
    # A full-pose problem is quiet where poses were not measured: that is no failure.
    if not any(run.full is not None for run in prepared.runs):
        failures.pop("fidim_full", None)
    return prepared, found, failures


def _completed(
    model: Model,
    prepared: PreparedRuns,
    raw: FidimEstimate,
    stack: Stack,
    full: bool,
    how: How,
) -> Estimate:
    """The entry of one FIDIM solution: weighting, what moves it beside the scatter, mass."""
    entry = _with_deviations(model, usable(prepared, full, None), raw, stack, full, how)
    mass, why = _mass(model, prepared, entry, full, how)
    return replace(entry, mass=mass, notes=(*entry.notes, *why), dropped=left_out(prepared, full))


def _with_deviations(
    model: Model,
    runs: list[PreparedRun],
    raw: FidimEstimate,
    stack: Stack,
    full: bool,
    how: How,
) -> Estimate:
    """The entry of a solution of these runs with all that moves it, weighted where asked for."""
    notes: list[str] = []
    weighted = None
    noisy = _noisy(model, runs, full) if how.weighting == "covariance" or how.settings else []
    if how.weighting == "covariance":
        try:
            weighted = weighted_fidim(noisy, raw.values)
            stack = Stack([run.W for run in noisy], raw.essential, weighing(noisy, weighted.values))
        except (ValueError, np.linalg.LinAlgError) as error:
            notes.append(f"as published: the weighted form cannot be had ({error})")
    own = raw.solution.covariance if weighted is None else weighted.covariance
    scatter = scattered(own, stack, [motion_of(run, full).times_s for run in runs])
    std = np.sqrt(np.diag(scatter))
    uneven = noisy if weighted is None else []
    shares = _shares(model, runs, stack, full, how, uneven, std)
    if how.wrong is not None:
        try:
            shares.append(geometry_share(how.wrong, how.wrong_size, runs, full, stack))
        except (ValueError, np.linalg.LinAlgError) as error:
            notes.append(f"{NOT_HELD} ({error})")
    if full in how.missing:
        shares.append(missing_share(how.missing[full], stack))
    if said := shares_sentence(shares, std):
        notes.append(said)
    entry = fidim_entry(raw, (), tuple(notes), weighted, shares, scatter)
    without = raw.without_run if weighted is None else stack.without_each(stack.rows)
    entry = _as_runs_say(entry, own, without)
    if weighted is None:
        extra = {**entry.extra, "published_std": raw.std.tolist()}
        entry = replace(entry, extra=extra)
    names = [run.name for run in runs]
    return replace(entry, without_run=dict(zip(names, without, strict=True)))


def _equations(model: Model, runs: list[PreparedRun], full: bool) -> list[Array]:
    return [regressor(model, motion_of(run, full)) for run in runs]


def _noisy(model: Model, runs: list[PreparedRun], full: bool) -> list[NoisyRegressor]:
    return [noisy_regressor(model, signals_used(run, full), motion_of(run, full)) for run in runs]


def _shares(
    model: Model,
    runs: list[PreparedRun],
    stack: Stack,
    full: bool,
    how: How,
    noisy: list[NoisyRegressor],
    scatter: Array,
) -> list[Share]:
    """What moves a solution beside its equations' scatter; `noisy` where columns count alike."""
    found = [calibration_share(model, runs, full, stack)]
    if how.ends is not None:
        found.append(ends_share(how.ends, runs, full, stack))
    if how.settings is not None:
        found.append(None if full else length_share(model, runs, stack))
        uneven = noise_bias(noisy, stack) if noisy else None
        noise = None if uneven is None else uneven.changes[0, :9]
        smoothing = smoothing_bias(model, runs, full, how.settings, stack, scatter, noise)
        found += [uneven, smoothing]
    return [share for share in found if share is not None]


def _as_runs_say(entry: Estimate, scatter: Array, without: Array) -> Estimate:
    """The entry with deviations of what runs say apart, where chance does not make them so large.

    Total least squares takes what is left for noise. Where a model's errors make it, they repeat
    with the swings, and its deviations (FIDIM 2022, eq. 33) are too small by several times. What
    the entry's own deviations hold beside the scatter may explain it, and is not counted again.

    Args:
        entry: of a solution.
        scatter: its covariance by its equations' scatter, (9, 9).
        without: the solution without each run, (r, 9).
    """
    between = widened(scatter, between_runs(without), len(without))
    factors = np.maximum(1.0, np.sqrt(np.diag(between) / np.diag(entry.covariance)))
    wider = float(factors.max())
    if not wider > 1.0:
        return entry
    covariance = entry.covariance * np.outer(factors, factors)
    note = (
        f"runs say apart up to {wider:.1f} times what the samples' scatter lets expect (FIDIM "
        "2022, eq. 33): standard deviations are those of leaving out one run at a time"
    )
    return replace(entry, covariance=covariance, notes=(*entry.notes, note))


def _consistent(entry: Estimate, enforced: bool) -> Estimate:
    """The entry with a word where no body can have its inertia, or held to one that can."""
    if enforced and not entry.consistency.is_possible:
        values = nearest_possible(entry.values, entry.covariance)
        off = values - entry.values
        cost = float(off @ np.linalg.solve(entry.covariance, off))
        entry = replace(entry, values=values, held_cost=cost)
    said = entry.consistency.sentence()
    return replace(entry, notes=(*entry.notes, said)) if said else entry


def _mass(
    model: Model,
    prepared: PreparedRuns,
    unloaded: Estimate,
    full: bool,
    how: How,
) -> tuple[MassEstimate | None, list[str]]:
    """Mass from payload runs, each payload identified by itself (eqs. 23, 24), and why not."""
    payloads = {
        (run.run.payload.mass_kg, tuple(run.run.payload.position_m)): run.run.payload
        for run in prepared.runs
        if run.run.payload is not None and run.run.role == "identify"
    }
    loaded: list[LoadedCentre] = []
    notes: list[str] = []
    alike = replace(how, weighting="published")
    for payload in payloads.values():
        runs = usable(prepared, full, payload)
        try:
            equations = _equations(model, runs, full)
            one = fidim(equations)
            stack = Stack(equations, one.essential)
            entry = _with_deviations(model, runs, one, stack, full, alike)
        except (ValueError, np.linalg.LinAlgError) as error:
            notes.append(f"payload of {payload.mass_kg:g} kg not used: {error}")
            continue
        notes += [f"payload of {payload.mass_kg:g} kg: {n}" for n in entry.notes if NOT_HELD in n]
        loaded.append(LoadedCentre(payload, one.values[:3], entry.covariance[:3, :3]))
    if not loaded:
        return None, notes
    try:
        found = mass_from_payloads(unloaded.values[:3], unloaded.covariance[:3, :3], loaded)
    except ValueError as error:
        return None, [*notes, str(error)]
    return found, notes


def _unusable_sentence(dropped: tuple[DroppedRun, ...]) -> str:
    if not dropped:
        return "no usable run"
    return f"no usable run; {dropped[-1].run}, for one: {dropped[-1].why}"
