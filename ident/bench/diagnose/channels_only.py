"""What a bench of uncalibrated channels alone lacks: little can be told, and the rest is said so.

How far the platform swung is not known there: only what acts on frequencies and on decay shows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from freeswing.cdpr.effects import catalogue
from freeswing.ident.bench.assemble import EFFECTS
from freeswing.ident.bench.diagnose.causes import ALL_WIRES, LENGTHS
from freeswing.ident.bench.diagnose.entries import (
    CLAMPS,
    WIRES_GROUP,
    found_entry,
    granted_entry,
    group_entry,
    mass_candidate,
    mass_found,
    removed_entry,
    told_entry,
    unscaled_document,
)
from freeswing.ident.bench.diagnose.search import Ground
from freeswing.ident.bench.diagnose.taken_for_granted import Removed, removals
from freeswing.ident.bench.diagnose.weigh import Fit
from freeswing.ident.bench.fit_rounds import WiresVerdict
from freeswing.ident.bench.identify_bench import BenchResult
from freeswing.ident.bench.told.contradicted import contradictions
from freeswing.ident.bench.told.held_out import HeldOut

CHANNELS_ONLY = (
    "nothing but uncalibrated channels was recorded: how far the platform swung, and what an "
    "effect would do to it, is not known, so that none can be told from another; add one run with "
    "poses, or with yaw by a calibrated sensor"
)


@dataclass(frozen=True, slots=True)
class ByChannels:
    """What can be told without a scale.

    Attributes:
        identified: what `identify` says.
        removed: drag, in turning and in moving, each taken away; what `identify` has always.
    """

    identified: BenchResult
    removed: tuple[Removed, ...]


def by_channels(identified: BenchResult) -> ByChannels:
    """Judge drag on runs that are left out; all else that channels tell `identify` has."""
    solved = identified.solved
    unknowns = solved.solution.unknowns
    masses = [swing.total(unknowns.of_run(k))[0] for k, swing in enumerate(solved.swings)]
    shares = np.array(masses) / solved.solution.value("platform")[0]
    ground = Ground(solved.swings, shares, solved.fastest_hz)
    fit = Fit(solved.swings, solved.solution)
    return ByChannels(identified, removals(ground, fit, identified.bench, EFFECTS))


def channels_document(found: ByChannels) -> dict[str, Any]:
    """What `diagnose` writes of it: without `before` and `after`, which need a scale."""
    solved = found.identified.solved
    rows = [removed_entry(one) for one in found.removed]
    accepted = [granted_entry(one) for one in found.removed if one.accepted]
    rows += mass_candidate(solved)
    accepted += mass_found(solved)
    if solved.wires is not None:
        rows.append(_wires_row(solved.wires))
        accepted += [_wires_found(solved.wires)] if solved.wires.contradicted else []
    looked_for = {row["effect"] for row in rows}
    rows += [
        told_entry(name, "not_identifiable", CHANNELS_ONLY)
        for name in catalogue()
        if name not in looked_for
    ]
    predicted = filter(None, map(_predicted, found.identified.validation))
    notes = [f"cannot tell more: {CHANNELS_ONLY}", *contradictions(solved), *predicted]
    return unscaled_document(rows, accepted, notes)


def _wires_row(wires: WiresVerdict) -> dict[str, Any]:
    told = f"{1e3 * wires.shift_m:+.1f} +- {1e3 * wires.std_m:.1f} mm"
    if wires.contradicted:
        reason = f"sway's period is that of wires of other lengths: {told}"
        group = group_entry(WIRES_GROUP, CLAMPS)
        return told_entry(LENGTHS, "confounded", reason, part=ALL_WIRES, **group)
    reason = (
        f"all wires together are as stated, by sway: {told}; what each is by itself is not told"
    )
    return told_entry(LENGTHS, "not_identifiable", reason)


def _wires_found(wires: WiresVerdict) -> dict[str, Any]:
    values, stds = [wires.shift_m], [wires.std_m]
    return found_entry(LENGTHS, ALL_WIRES, ["bias_m"], values, stds, WIRES_GROUP)


def _predicted(one: HeldOut) -> str:
    """How far a held-out run was predicted, in the column's own unit."""
    if one.rmse is None or one.floor is None:
        return ""
    return (
        f"run {one.run} was not fitted: its second half is predicted to {one.rmse:.2g} in "
        f"{one.column}, noise {one.floor:.2g}"
    )
