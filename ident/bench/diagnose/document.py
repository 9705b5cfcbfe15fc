"""results/diagnosis.json of a bench."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from freeswing.cdpr.effects import catalogue, effect_named
from freeswing.cdpr.effects.base import EQUILIBRIA, LONG_RUN
from freeswing.cdpr.robot import INERTIA_NAMES
from freeswing.ident.bench.diagnose.causes import ALL_WIRES, ENDS, HOOKS, LENGTHS, SAME, Cause
from freeswing.ident.bench.diagnose.channels_only import ByChannels, channels_document
from freeswing.ident.bench.diagnose.diagnose import BenchDiagnosis, CannotTell
from freeswing.ident.bench.diagnose.entries import (
    CLAMPS,
    EXCHANGE,
    FORMAT,
    MASS,
    WEIGH,
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
from freeswing.ident.bench.diagnose.search import Round, Word
from freeswing.ident.bench.diagnose.shown import Shown
from freeswing.ident.bench.diagnose.unexplained import remaining
from freeswing.ident.bench.fit_rounds import Solved
from freeswing.ident.bench.mass_verdict import MassVerdict
from freeswing.ident.bench.swing import COMMON
from freeswing.ident.bench.told.contradicted import contradictions, group_sentence
from freeswing.ident.bench.told.report_objects import objects_document, platform_rows
from freeswing.ident.bench.told.scatter_by_kind import is_systematic, scatter_sentence
from freeswing.ident.diagnose.decision import RIVAL
from freeswing.ident.diagnose.experiments import separating_experiment

NOT_ON_BENCHES = "it is not looked for on benches: their wires would not show it, or not alone"
STRETCH = "cable_elasticity"
UNSHOWN = "these runs would not show it if it were there"
LEVEL = (
    "hold a plumb line beside the hooks, or a level on their frame; a constant force tilts a "
    "heavier load less, and a tilt does not"
)
LIKELY = 0.5  # probability: more so than all else that was tried, and nothing, together
PULL_HOOKS = (
    "pull each hook sideways by a spring balance with a few newtons and see by how much it gives "
    "way; or record three runs with a known mass as heavy as the platform, at different places, or "
    "all runs anew with twists three times as wide"
)
MORE_RUNS = "record more runs of each kind, and wider swings"
OF_CABLE_ROBOTS = (EQUILIBRIA, LONG_RUN)  # a bench has one equilibrium, and no winches
TELLS = {
    HOOKS: PULL_HOOKS,
    LENGTHS: CLAMPS,
    "gravity_tilt": LEVEL,
    **dict.fromkeys(ENDS, EXCHANGE),
}
CLAMPED_AT = (
    "measure where the wires are clamped from the marks that the recorded frame rests on: no run "
    "tells the two apart"
)
ADVICE = (
    (frozenset({"gravity_tilt", "constant_force"}), LEVEL),
    (frozenset({"gravity_tilt", "anchor_offset"}), LEVEL),
    (frozenset({"attachment_offset", "anchor_offset"}), EXCHANGE),
    (frozenset({"attachment_offset", "marker_offset"}), CLAMPED_AT),
    (frozenset({"torsion_spring", MASS}), WEIGH),
)


def bench_document(found: BenchDiagnosis | ByChannels | CannotTell) -> dict[str, Any]:
    """What `diagnose` writes of a bench."""
    if isinstance(found, CannotTell):
        return _cannot_tell(found)
    if isinstance(found, ByChannels):
        return channels_document(found)
    bench, first, last = found.identified.bench, found.declared, found.solved
    runs = tuple(run for run in bench.runs if run.role == "identify")
    before, after = found.ladder[0].errors.document(), found.ladder[-1].errors.document()
    mass = group_sentence(last)
    entries = [_accepted(found, cause) for cause in found.accepted]
    entries += [granted_entry(one) for one in found.removed if one.accepted]
    entries += mass_found(last)
    notes = [mass] if mass else []
    candidates = _candidates(found)
    notes += [*most_likely(found.rounds), *_unshown(candidates), _basis(found)]
    return {
        "format": FORMAT,
        "before": before,
        "candidates": candidates,
        "accepted": entries,
        "after": after,
        "share_closed": _closed(before, after),
        "parameters_before": _parameters(first),
        "parameters_after": _parameters(last),
        "parameters_moved_percent": _moved(_parameters(first), _parameters(last)),
        "ladder": [
            {"effects": list(step.effects), **step.errors.document()} for step in found.ladder
        ],
        "unexplained": _unexplained(found),
        "objects_before": objects_document(first, bench, runs),
        "objects_after": objects_document(last, bench, runs),
        "notes": notes,
    }


def _cannot_tell(found: CannotTell) -> dict[str, Any]:
    """Every effect untold, and what `identify` says that runs contradict."""
    rows = [told_entry(n, "not_identifiable", found.reason) for n in catalogue()]
    notes = [f"cannot tell: {found.reason}", *contradictions(found.identified.solved)]
    return unscaled_document(rows, [], notes)


def most_likely(rounds: Sequence[Round]) -> list[str]:
    """What is the most probable where a search ended, and not accepted; with what would tell."""
    probable = [
        word for one in rounds if one.unborne for word in one.words if (word.chance or 0.0) > LIKELY
    ]
    return [
        f"most likely (probability {word.chance:.2g} against all else that was tried, and "
        f"nothing): {_plain(word.cause)}. It is not accepted: {word.reason}. What bodies would "
        f"change by with it is in their deviations. To tell: {_tells(word.cause)}"
        for word in probable
    ]


def _plain(cause: Cause) -> str:
    """A cause in words: of which wire, or of all alike."""
    name = cause.effect.replace("_", " ")
    if cause.part not in ("", ALL_WIRES):
        return f"{name}, wire {cause.part}"
    alike = cause.part == ALL_WIRES or cause.effect in (HOOKS, *ENDS)
    return f"{name}, all wires alike" if alike else name


def _tells(cause: Cause) -> str:
    """The measurement that decides on one cause by itself."""
    if cause.effect in TELLS:
        return TELLS[cause.effect]
    named = effect_named(cause.effect).separated_by
    return "; or ".join(one.advice for one in named if one not in OF_CABLE_ROBOTS) or MORE_RUNS


def _unexplained(found: BenchDiagnosis) -> dict[str, Any]:
    """What remains in a coordinate, or between runs that carry different things."""
    left, solved = remaining(found.ladder[-1].fit), found.solved
    if left["present"] or found.accepted or not is_systematic(solved):
        return left
    evidence: dict[str, Any] = {"scatter_kg_m2": solved.scatter_std}
    signature = scatter_sentence(solved)
    words = [word for one in found.rounds for word in one.words if (word.chance or 0.0) > RIVAL]
    if words:
        likeliest = max(words, key=lambda word: word.chance or 0.0)
        evidence["likeliest"] = {likeliest.cause.effect: likeliest.chance}
        signature += (
            f". The likeliest of what was tried is {likeliest.cause.effect} (probability "
            f"{likeliest.chance:.2g}), which too few runs bear out"
        )
    return {"present": True, "signature": signature, "evidence": evidence}


def _basis(found: BenchDiagnosis) -> str:
    held_out = any(run.role == "validate" for run in found.identified.bench.runs)
    if held_out:
        return "before and after are of runs with role validate, over their second halves"
    return "no run has role validate: before and after are of each run left out in turn"


def _candidates(found: BenchDiagnosis) -> list[dict[str, Any]]:
    """The last word on every effect, and on the declared mass."""
    told: dict[str, dict[str, Any]] = {}
    for words in (one.words for one in found.rounds):
        for word in words:
            name, before = word.cause.effect, told.get(word.cause.effect)
            kept = before is not None and before["verdict"] in ("accepted", "confounded")
            better = before is None or _rank(word) > (
                before["probability"] or 0.0,
                before["held_out_gain"],
            )
            if not kept and (better or word.verdict != "rejected"):
                told[name] = _word(word)
    for one in found.removed:
        before = told.get(one.effect)
        if before is None or before["verdict"] == "rejected":
            told[one.effect] = removed_entry(one)
    rows = [_beside_mass(_with_sight(row, found.shown), found.solved.mass) for row in told.values()]
    rows += [
        told_entry(n, "not_identifiable", NOT_ON_BENCHES) for n in catalogue() if n not in told
    ]
    return rows + mass_candidate(found.solved)


def _rank(word: Word) -> tuple[float, float]:
    """By which one of an effect's causes stands for all: how probable, then how much it takes."""
    return word.chance or 0.0, word.gain


def _beside_mass(row: dict[str, Any], mass: MassVerdict | None) -> dict[str, Any]:
    """Stretch beside a mass that was freed: it may be what the payload runs want instead."""
    if row["effect"] != STRETCH or row["verdict"] != "rejected":
        return row
    if mass is None or not (mass.contradicted and mass.is_small):
        return row
    reason = f"{row['reason']}, the mass being free: it may be what the payload runs want instead"
    return told_entry(STRETCH, "not_identifiable", reason)


def _with_sight(row: dict[str, Any], shown: Sequence[Shown]) -> dict[str, Any]:
    """A rejected effect with how well it would be told; not identifiable where it would not be."""
    mine = [one for one in shown if one.cause.effect == row["effect"]]
    if row["verdict"] != "rejected" or not mine:
        return row
    worst = max(mine, key=lambda one: float(one.std[one.worst] / one.usual[one.worst]))
    if worst.told.all():
        return {**row, "reason": f"{row['reason']}; {worst.words}"}
    return told_entry(row["effect"], "not_identifiable", f"{UNSHOWN}: {worst.words}")


def _unshown(rows: Sequence[dict[str, Any]]) -> list[str]:
    """A note on what was looked for and would not show."""
    mine = [row for row in rows if row["reason"].startswith(UNSHOWN)]
    if not mine:
        return []
    each = [f"{row['effect']} ({row['reason'].removeprefix(UNSHOWN)[2:]})" for row in mine]
    return [
        f"cannot tell whether these are there, which the runs would not show: {'; '.join(each)}"
    ]


def _others(cause: Cause, others: Sequence[Cause]) -> tuple[str, ...]:
    """Effects that cannot be told from a cause, on these data or on any."""
    if cause.block == COMMON:
        same: tuple[str, ...] = WIRES_GROUP
    else:
        same = SAME.get(cause.effect, ()) if not cause.part else ()
    names = (*(one.effect for one in others), *same)
    return tuple(dict.fromkeys(name for name in names if name != cause.effect))


def experiment_of(names: Sequence[str]) -> str:
    """What would tell a group of effects apart on a bench."""
    for pair, advice in ADVICE:
        if pair <= set(names):
            return advice
    known = tuple(name for name in names if name in catalogue())
    return separating_experiment(known, without=OF_CABLE_ROBOTS, otherwise=MORE_RUNS)


def _word(word: Word) -> dict[str, Any]:
    others = _others(word.cause, word.others) if word.verdict != "rejected" else ()
    verdict = "confounded" if others else word.verdict
    verdict = "accepted" if word.verdict == "confounded" and not others else verdict
    entry = told_entry(
        word.cause.effect,
        verdict,
        word.reason,
        delta_bic=word.delta_bic,
        held_out_gain=word.gain,
        probability=word.chance,
    )
    if word.cause.part and word.verdict != "rejected":
        entry["part"] = word.cause.part
    if others:
        common = word.cause.block == COMMON
        entry |= group_entry(
            others, CLAMPS if common else experiment_of((word.cause.effect, *others))
        )
    return entry


def _accepted(found: BenchDiagnosis, cause: Cause) -> dict[str, Any]:
    solution = found.solved.solution
    values, stds = solution.value(cause.block), solution.std(cause.block)
    word = next(
        word
        for one in found.rounds
        for word in one.words
        if word.cause == cause and word.verdict != "rejected"
    )
    return found_entry(
        cause.effect,
        cause.part,
        [one.name for one in cause.parameters],
        values.tolist(),
        stds.tolist(),
        _others(cause, word.others),
    )


def _parameters(solved: Solved) -> list[dict[str, Any]]:
    rows = platform_rows(solved)[: len(INERTIA_NAMES)]
    return [{key: row[key] for key in ("name", "value", "std")} for row in rows]


def _moved(first: list[dict[str, Any]], last: list[dict[str, Any]]) -> dict[str, float | None]:
    found: dict[str, float | None] = {}
    for before, after in zip(first, last, strict=True):
        old, new = before["value"], after["value"]
        known = old is not None and new is not None and old != 0.0
        found[before["name"]] = 100.0 * (new - old) / abs(old) if known else None  # type: ignore[operator]
    return found


def _closed(before: dict[str, Any], after: dict[str, Any]) -> float | None:
    """Share of the way from the error before to the noise."""
    old, new, floor = (
        before["prediction_rmse_m"],
        after["prediction_rmse_m"],
        after["noise_floor_m"],
    )
    if old is None or new is None or floor is None or old <= floor:
        return None
    return (old - new) / (old - floor)
