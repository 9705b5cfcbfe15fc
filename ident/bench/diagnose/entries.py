"""Rows of a bench's diagnosis.json: an effect looked for, one that was found, a group of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from freeswing.ident.bench.diagnose.causes import LENGTHS, SAME
from freeswing.ident.bench.diagnose.taken_for_granted import Removed
from freeswing.ident.bench.fit_rounds import Solved
from freeswing.ident.bench.mass_verdict import CHECKING
from freeswing.ident.bench.told.contradicted import payload_reasons, surely_contradicted

FORMAT = "freeswing-diagnosis/1"
NOTHING_LEFT = {"present": False, "signature": "", "evidence": {}}
MASS = "platform_mass"
WIRES_GROUP = ("yielding_clamp", "frame_rate")
WEIGH = (
    "weigh the platform with all that hangs on it, and hang the known mass on opposite sides in "
    "turn; if the declared mass is right, measure the wires' radii and lengths again, then film a "
    "clock"
)
EXCHANGE = (
    "exchange the wires and record again: what goes with a wire is its length, what stays with the "
    "platform its end or the measured frame, what stays above the hook"
)
CLAMPS = (
    "measure the wires from bend to bend, film a clock, and push each hook sideways: one that "
    "gives way under a few newtons is a clamp that yields"
)


def unscaled_document(
    candidates: list[dict[str, Any]], accepted: list[dict[str, Any]], notes: list[str]
) -> dict[str, Any]:
    """A diagnosis.json without `before` and `after`, of which runs have nothing to say."""
    return {
        "format": FORMAT,
        "candidates": candidates,
        "accepted": accepted,
        "ladder": [],
        "unexplained": NOTHING_LEFT,
        "notes": notes,
    }


def told_entry(effect: str, verdict: str, reason: str, **more: Any) -> dict[str, Any]:
    """A row of `candidates`."""
    empty = {"delta_bic": None, "held_out_gain": None, "probability": None, "confounded_with": []}
    return {"effect": effect, "verdict": verdict, **empty, "reason": reason, **more}


def group_entry(others: Sequence[str], experiment: str) -> dict[str, Any]:
    """What a row of `candidates` has where it cannot be told from others."""
    return {"confounded_with": list(others), "experiment": experiment}


def removed_entry(one: Removed) -> dict[str, Any]:
    """What every fit has, among what was looked for."""
    wires = one.effect == LENGTHS and one.accepted
    verdict = "accepted" if one.accepted else "rejected" if one.told else "not_identifiable"
    entry = told_entry(
        one.effect,
        "confounded" if wires else verdict,
        one.reason,
        delta_bic=one.delta_bic,
        held_out_gain=one.gain,
        probability=one.chance,
    )
    if one.part and wires:
        entry["part"] = one.part
    return entry | (group_entry(SAME[LENGTHS], EXCHANGE) if wires else {})


def granted_entry(one: Removed) -> dict[str, Any]:
    """The same as a row of `accepted`."""
    others = SAME[LENGTHS] if one.effect == LENGTHS else ()
    return found_entry(one.effect, one.part, one.names, one.values, one.stds, others)


def mass_group(solved: Solved) -> tuple[str, ...]:
    """What else may be off where runs with a known mass contradict the platform's."""
    return tuple(
        one.name for one in payload_reasons(solved) if one.name != MASS and not one.excluded
    )


def mass_candidate(solved: Solved) -> list[dict[str, Any]]:
    """The declared mass among what was looked for, where runs carry a known one; else no row.

    It is found only where runs exclude it with all counted that may be off: a centre of mass that
    no run shows, or wires that give way. Where they do not, nothing has been found, whichever
    number serves: other readings of the same runs leave the files right.
    """
    mass = solved.mass
    if mass is None:
        return []
    group = group_entry(mass_group(solved), WEIGH)
    if surely_contradicted(solved):
        reason = "runs with a known mass contradict the declared one"
        return [told_entry(MASS, "confounded", reason, **group)]
    told = f"runs with a known mass give {mass.fitted_kg:.4g} +- {mass.fitted_std_kg:.2g} kg"
    if mass.contradicted:
        std = float(solved.solution.std("platform")[0])
        reason = f"{told}, +- {std:.2g} kg with all that may be off: the declared one may be right"
        return [told_entry(MASS, "not_identifiable", reason, **group)]
    if mass.fitted_std_kg > CHECKING * mass.declared_kg:
        return [told_entry(MASS, "not_identifiable", f"{told}: they do not check the declared one")]
    return [told_entry(MASS, "rejected", f"{told}, as declared")]


def mass_found(solved: Solved) -> list[dict[str, Any]]:
    """The platform's mass as runs have it, as a row of `accepted` where they exclude the other."""
    if not surely_contradicted(solved):
        return []
    solution = solved.solution
    value, std = solution.value("platform")[:1], solution.std("platform")[:1]
    return [found_entry(MASS, "", ["mass_kg"], value.tolist(), std.tolist(), mass_group(solved))]


def found_entry(
    effect: str,
    part: str,
    names: Sequence[str],
    values: Sequence[float],
    stds: Sequence[float],
    others: Sequence[str],
) -> dict[str, Any]:
    """A row of `accepted`: its numbers (k,) by name, with what it cannot be told from."""
    rows = [
        {"name": name, "value": float(value), "std": float(std) if np.isfinite(std) else None}
        for name, value, std in zip(names, values, stds, strict=True)
    ]
    entry = {"effect": effect, "parameters": rows, "confounded_with": list(others)}
    return entry | ({"part": part} if part else {})
