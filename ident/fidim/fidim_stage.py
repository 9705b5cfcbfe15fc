"""FIDIM on a session's runs: by full poses, by free coordinates, weighted, with the mass."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.regressor import regressor
from freeswing.cdpr.robot import Array
from freeswing.ident.estimate import Estimate, fidim_entry
from freeswing.ident.fidim.bias import noise_bias, smoothing_bias
from freeswing.ident.fidim.calibration_share import calibration_share
from freeswing.ident.fidim.fidim import FidimEstimate, fidim
from freeswing.ident.fidim.length_share import length_share
from freeswing.ident.fidim.payload_mass import LoadedCentre, MassEstimate, mass_from_payloads
from freeswing.ident.fidim.shares import Share, Stack, shares_sentence
from freeswing.ident.fidim.slack_runs import slack_runs, within_reach
from freeswing.ident.fidim.weighted_least_squares import (
    NoisyRegressor,
    noisy_regressor,
    weighted_fidim,
)
from freeswing.ident.judge.consistency import nearest_possible
from freeswing.ident.judge.free_against_full import between_runs
from freeswing.ident.likelihood.between_runs import widened
from freeswing.ident.runs import DroppedRun
from freeswing.ident.signals.derivatives import SignalSettings
from freeswing.ident.signals.prepare import (
    PreparedRun,
    PreparedRuns,
    Progress,
    left_out,
    motion_of,
    signals_used,
    usable,
    without,
)

Weighting = Literal["published", "covariance"]


def fidim_estimates(
    model: Model,
    prepared: PreparedRuns,
    weighting: Weighting,
    progress: Progress | None,
    consistent: bool = False,
    settings: SignalSettings | None = None,
) -> tuple[PreparedRuns, dict[str, Estimate], dict[str, str]]:
    """FIDIM by full poses and by free coordinates; slack runs found with its result leave.

    With `consistent` an inertia that no body can have is replaced by the nearest possible one.
    `settings` made the signals; without them deviations hold the scatter and the calibration
    alone, which is enough where values to start from are wanted.

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
            stack = Stack(equations, raw.essential)
            entry = _completed(model, prepared, raw, stack, full, weighting, settings)
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
    weighting: Weighting,
    settings: SignalSettings | None,
) -> Estimate:
    """The entry of one FIDIM solution: weighting, what moves it beside the scatter, mass."""
    notes: list[str] = []
    unloaded, weighted = usable(prepared, full, None), None
    noisy = _noisy(model, unloaded, full) if weighting == "covariance" or settings else []
    if weighting == "covariance":
        try:
            weighted = weighted_fidim(noisy, raw.values)
        except (ValueError, np.linalg.LinAlgError) as error:
            notes.append(f"as published: the weighted form cannot be had ({error})")
    uneven = noisy if weighted is None else []
    shares = _shares(model, unloaded, stack, full, settings, uneven)
    scatter = raw.solution.covariance if weighted is None else weighted.covariance
    if said := shares_sentence(shares, np.sqrt(np.diag(scatter))):
        notes.append(said)
    entry = fidim_entry(raw, left_out(prepared, full), tuple(notes), weighted, shares)
    entry = entry if weighted is not None else _as_runs_say(entry, raw)
    mass, why = _mass(model, prepared, entry, full, settings)
    names = [run.name for run in unloaded]
    without_run = dict(zip(names, raw.without_run, strict=True)) if weighted is None else {}
    return replace(entry, mass=mass, notes=(*entry.notes, *why), without_run=without_run)


def _equations(model: Model, runs: list[PreparedRun], full: bool) -> list[Array]:
    return [regressor(model, motion_of(run, full)) for run in runs]


def _noisy(model: Model, runs: list[PreparedRun], full: bool) -> list[NoisyRegressor]:
    return [noisy_regressor(model, signals_used(run, full), motion_of(run, full)) for run in runs]


def _shares(
    model: Model,
    runs: list[PreparedRun],
    stack: Stack,
    full: bool,
    settings: SignalSettings | None,
    noisy: list[NoisyRegressor],
) -> list[Share]:
    """What moves a solution beside its equations' scatter; `noisy` where columns count alike."""
    found = [calibration_share(model, runs, full, stack)]
    if settings is not None:
        found.append(None if full else length_share(model, runs, stack))
        found.append(noise_bias(noisy, stack) if noisy else None)
        found.append(smoothing_bias(model, runs, full, settings, stack))
    return [share for share in found if share is not None]


def _as_runs_say(entry: Estimate, raw: FidimEstimate) -> Estimate:
    """The entry with deviations of what runs say apart, where chance does not make them so large.

    Total least squares takes what is left for noise. Where a model's errors make it, they repeat
    with the swings, and its deviations (FIDIM 2022, eq. 33) are too small by several times. What
    the entry's own deviations hold beside the scatter may explain it, and is not counted again.
    """
    between = between_runs(raw.without_run)
    scatter = widened(raw.solution.covariance, between, len(raw.without_run))
    factors = np.maximum(1.0, np.sqrt(np.diag(scatter) / np.diag(entry.covariance)))
    wider = float(factors.max())
    if not wider > 1.0:
        return entry
    covariance = entry.covariance * np.outer(factors, factors)
    note = (
        f"runs say apart up to {wider:.1f} times what the samples' scatter lets expect (FIDIM "
        "2022, eq. 33): standard deviations are those of leaving out one run at a time"
    )
    extra = {**entry.extra, "published_std": raw.std.tolist()}
    return replace(entry, covariance=covariance, notes=(*entry.notes, note), extra=extra)


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
    settings: SignalSettings | None,
) -> tuple[MassEstimate | None, list[str]]:
    """Mass from payload runs, each payload identified by itself (eqs. 23, 24), and why not."""
    payloads = {
        (run.run.payload.mass_kg, tuple(run.run.payload.position_m)): run.run.payload
        for run in prepared.runs
        if run.run.payload is not None and run.run.role == "identify"
    }
    loaded: list[LoadedCentre] = []
    notes: list[str] = []
    for payload in payloads.values():
        runs = usable(prepared, full, payload)
        try:
            equations = _equations(model, runs, full)
            one = fidim(equations)
            noisy = _noisy(model, runs, full) if settings else []
            stack = Stack(equations, one.essential)
            shares = _shares(model, runs, stack, full, settings, noisy)
        except (ValueError, np.linalg.LinAlgError) as error:
            notes.append(f"payload of {payload.mass_kg:g} kg not used: {error}")
            continue
        entry = _as_runs_say(fidim_entry(one, (), (), None, shares), one)
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
