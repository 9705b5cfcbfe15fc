"""Entries of results/diagnosis.json: effects that were accepted, and all that were considered."""

from __future__ import annotations

from typing import Any

import numpy as np

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.measured.leaving_out import leaving_out_std
from freeswing.cdpr.robot import INERTIA_NAMES, Array
from freeswing.ident.diagnose.answer.deviations import directions
from freeswing.ident.diagnose.answer.next_swing import NextSwing
from freeswing.ident.diagnose.answer.settled_geometry import settled_places
from freeswing.ident.diagnose.decision import Candidate
from freeswing.ident.diagnose.experiments import separating_experiment
from freeswing.ident.likelihood.blocks import INERTIA
from freeswing.ident.likelihood.fit_swings import LikelihoodFit


def claims(effects: tuple[str, ...]) -> tuple[str, ...]:
    """Those that say something of the robot, without nuisances of the measurement."""
    return tuple(name for name in effects if not effect_named(name).nuisance)


def candidate_entry(one: Candidate, apart: dict[str, NextSwing]) -> dict[str, Any]:
    """One of `candidates` of results/diagnosis.json, with what would part it from its rivals."""
    entry: dict[str, Any] = {
        "effect": one.effect,
        "verdict": one.verdict,
        "delta_bic": one.delta_bic,
        "held_out_gain": one.held_out_gain,
        "probability": one.probability,
        "confounded_with": list(one.confounded_with),
        "reason": one.reason,
    }
    if one.confounded_with:
        entry["experiment"] = separating_experiment((one.effect, *one.confounded_with))
        if one.effect in apart:
            entry["experiment"] += f"; {apart[one.effect]}"
            entry["next_swing"] = apart[one.effect].document()
    return entry


def accepted_entries(
    final: LikelihoodFit,
    covariance: Array,
    groups: dict[str, tuple[str, ...]],
    slowly: dict[str, str],
) -> list[dict[str, Any]]:
    """`accepted` of results/diagnosis.json: values that were estimated, or settled by lengths.

    Args:
        final: the fit with all accepted effects.
        covariance: of the shared unknowns as it is told, (p, p).
        groups: for each effect, those that stand in its group.
        slowly: why effects have their slow part alone, of those that have another.
    """
    settled = settled_places(final.model)
    entries, unknowns = [], final.unknowns
    for name in claims(final.model.effects):
        if name not in groups:  # in the model because lengths cannot tell it from the one named
            continue
        block, columns = unknowns.block(name), unknowns.columns(name)
        together = covariance[np.ix_(columns, columns)]
        where = np.r_[final.model.place_of(name)]
        parameters = [final.model.parameters[k] for k in where]
        own = np.array([one.per_run for one in parameters])
        stds = np.sqrt(np.diag(together))
        stds[own] = std_of_rms(np.array([run.values[where[own]] for run in final.motions]))
        told = block.mask | np.isin(where, settled)
        rows = [
            {"name": parameter.name, "value": float(value), "std": float(std)}
            for parameter, value, std, estimated in zip(
                parameters, block.value, stds, told, strict=True
            )
            if parameter.per_run or estimated
        ]
        group = [other for other in groups.get(name, ()) if other != name]
        seen = directions(final.model, where[told], together[np.ix_(told, told)])
        entry = {"effect": name, "parameters": rows, "confounded_with": group}
        motion = {"motion": _motion(final, name, slowly)} if effect_named(name).fully else {}
        entries.append(entry | motion | ({"directions": seen} if seen else {}))
    return entries


def _motion(final: LikelihoodFit, name: str, slowly: dict[str, str]) -> str:
    """Whether an effect that has a slow part and another was fitted with both."""
    if effect_named(name).fully in final.model.effects:
        return "with vibration"
    return f"quasi-static: {slowly[name]}" if name in slowly else "quasi-static"


def std_of_rms(values: Array) -> Array:
    """Deviations of the root mean squares over runs of values that each has for itself, (o,).

    Args:
        values: of the runs, two of them or more, (r, o).

    Source:
        Efron, Tibshirani 1993, An Introduction to the Bootstrap, ch. 11: the jackknife.
    """
    squares = values**2
    others = np.maximum(squares.sum(axis=0) - squares, 0.0) / (len(values) - 1)
    return leaving_out_std(np.sqrt(others))


def parameter_entries(found: LikelihoodFit, covariance: Array) -> list[dict[str, Any]]:
    """The inertia of results/diagnosis.json, with a covariance of the shared unknowns, (p, p)."""
    stds = np.sqrt(np.diag(covariance))[found.place(INERTIA)]
    return [
        {"name": name, "value": float(value), "std": float(std)}
        for name, value, std in zip(INERTIA_NAMES, found.inertia, stds, strict=True)
    ]


def moved_percent(first: LikelihoodFit, final: LikelihoodFit) -> dict[str, float]:
    """By how much each inertial parameter has moved between two fits, per cent of the first."""
    size = np.maximum(np.abs(first.inertia), 1e-12)
    change = 100.0 * (final.inertia - first.inertia) / size
    return dict(zip(INERTIA_NAMES, change.tolist(), strict=True))


def share_closed(before: dict[str, Any], after: dict[str, Any]) -> float | None:
    """Share of the distance between the prediction error and the noise floor that was closed."""
    error, floor = before["prediction_rmse_m"], before["noise_floor_m"]
    left = after["prediction_rmse_m"]
    if error is None or left is None or error <= floor:
        return None
    return float((error - left) / (error - floor))
