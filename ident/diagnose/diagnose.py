"""The loop closed: find the residual, trace it to an effect, add it, report before and after."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any, NamedTuple

from freeswing.cdpr.effects import catalogue, effect_named
from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import POSE_COORDINATES, Array, Robot
from freeswing.cdpr.system.progress import Progress
from freeswing.ident.diagnose.answer.decay import swing_decay
from freeswing.ident.diagnose.answer.deviations import honest_covariance, with_ways
from freeswing.ident.diagnose.answer.entries import (
    accepted_entries,
    candidate_entry,
    claims,
    moved_percent,
    parameter_entries,
    share_closed,
)
from freeswing.ident.diagnose.answer.final_verdicts import final_verdicts, rivals_of
from freeswing.ident.diagnose.answer.next_swing import NextSwing, next_swing
from freeswing.ident.diagnose.answer.not_the_cause import (
    all_settled,
    before_forces,
    gravity_instead,
    gravity_unasked,
    removing_little,
    suspected,
    unless_validated,
    without_forces,
)
from freeswing.ident.diagnose.answer.open_exchanges import open_exchanges
from freeswing.ident.diagnose.answer.parted_places import parted, retold, shown
from freeswing.ident.diagnose.answer.settled_geometry import cut, settled_places, with_settled
from freeswing.ident.diagnose.answer.still_missing import still_missing
from freeswing.ident.diagnose.answer.taken_back import taken_back, unshown
from freeswing.ident.diagnose.answer.unmet_validation import with_unmet
from freeswing.ident.diagnose.answer.unseen_vibration import unseen_vibration
from freeswing.ident.diagnose.decision import (
    LARGEST_EXCESS_LEFT,
    LEAST_SHARE_EXPLAINED,
    Candidate,
    excess_of,
    left_out,
)
from freeswing.ident.diagnose.declared_model import (
    barred_effects,
    base_fit,
    refuse_few,
    white_noise_scales,
    with_frames,
)
from freeswing.ident.diagnose.heldout import HeldOut, held_out
from freeswing.ident.diagnose.lengths.wrong_places import Kinematics
from freeswing.ident.diagnose.refit import Refit
from freeswing.ident.diagnose.search import Round, Search
from freeswing.ident.diagnose.sets.exchange import sentence
from freeswing.ident.diagnose.unexplained import Unexplained, unexplained
from freeswing.ident.diagnose.variants import effect_of
from freeswing.ident.fidim.fidim_stage import How, fidim_estimates
from freeswing.ident.identify import session_notes
from freeswing.ident.inertia_starts import likelihood_starts
from freeswing.ident.judge.prediction import Stage
from freeswing.ident.likelihood.calibration_modes import amplitudes_of, with_calibration
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_swings import FreeSwing, LikelihoodFit
from freeswing.ident.runs import SwingRun
from freeswing.ident.signals.derivatives import SignalSettings
from freeswing.ident.signals.usable_runs import PreparedRun, prepare_runs

FORMAT = "freeswing-diagnosis/1"
NOTHING_TO_CHECK = (
    "no usable run has role validate: before and after are measured on such runs alone; "
    "give at least one run that role"
)
KEPT_FROM_DYNAMICS = (
    "something that follows the motion is still missing: the geometry is what cable lengths say, "
    "not what the forces found would make of it; what lengths leave open widens all else"
)


@dataclass(frozen=True, slots=True)
class Rung:
    """One step of the ladder: the model after an effect was added, on the validation runs."""

    effects: tuple[str, ...]
    held_out: HeldOut


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """The result of `diagnose`.

    Attributes:
        ladder: the declared model first, then one rung an effect.
        candidates: the last word on every effect of the catalogue.
        groups: for each effect of the final model, those that stand in its group.
        first: the fit without effects.
        final: the fit with all accepted effects.
        spreads: covariances of the shared unknowns of both fits as they are told.
        kinematics: what cable lengths along the runs say; None where poses were not measured.
        unexplained: what remains.
        notes: sentences about the session.
        apart: for each effect of the final model that has rivals, the swing that would part it
            from the likeliest.
        slowly: for effects of the final model that have their slow part alone, why.
        reliance: that the values are not to be relied on, or how far; empty where they are.
    """

    ladder: tuple[Rung, ...]
    candidates: tuple[Candidate, ...]
    groups: dict[str, tuple[str, ...]]
    first: LikelihoodFit
    final: LikelihoodFit
    spreads: tuple[Array, Array]
    kinematics: Kinematics | None
    unexplained: Unexplained
    notes: tuple[str, ...]
    apart: dict[str, NextSwing]
    slowly: dict[str, str]
    reliance: str = ""

    def document(self) -> dict[str, Any]:
        """results/diagnosis.json."""
        before, after = (self.ladder[k].held_out.document() for k in (0, -1))
        return {
            "format": FORMAT,
            "before": before,
            "candidates": [candidate_entry(one, self.apart) for one in self.candidates],
            "accepted": accepted_entries(self.final, self.spreads[1], self.groups, self.slowly),
            "after": after,
            "share_closed": share_closed(before, after),
            "parameters_before": parameter_entries(self.first, self.spreads[0]),
            "parameters_after": parameter_entries(self.final, self.spreads[1]),
            "parameters_moved_percent": moved_percent(self.first, self.final),
            "ladder": [
                {"effects": list(rung.effects), **rung.held_out.document()} for rung in self.ladder
            ],
            "unexplained": {
                "present": self.unexplained.present,
                "signature": self.unexplained.signature,
                "evidence": self.unexplained.evidence,
                **({"reliance": self.reliance} if self.reliance else {}),
            },
            "decay": swing_decay(self.first, self.final),
            **({} if self.kinematics is None else {"lengths": self.kinematics.document()}),
            "notes": list(self.notes),
        }


def diagnose(
    runs: list[SwingRun],
    robot: Robot,
    progress: Progress | None = None,
    workers: int = 2,
    candidates: tuple[str, ...] | None = None,
    executor: Executor | None = None,
) -> Diagnosis:
    """Find the effects that the model of a session lacks.

    Args:
        runs: all runs; those with role `validate` serve the final before and after alone.
        robot: declared geometry.
        progress: told a label and a fraction.
        workers: processes that fit candidates side by side.
        candidates: effects to consider; None for the whole catalogue.
        executor: fits candidates instead of processes of this machine, such as a cluster's.

    Raises:
        DataError: when fewer than three runs can be fitted, or no validation run is usable.
    """
    model = build_model(robot)
    first_part = _part(progress, 0.0, 0.05)
    try:
        prepared = prepare_runs(runs, model, SignalSettings(), first_part)
    except ValueError as error:
        raise DataError(str(error)) from error
    taut, by_fidim, _ = fidim_estimates(model, prepared, How(), first_part)
    # Where most cables seem slack, the declared robot is at fault, not the runs.
    prepared = taut if 2 * len(taut.runs) > len(prepared.runs) else prepared
    full = all(set(run.signals.coordinates) == set(POSE_COORDINATES) for run in prepared.runs)
    free = None if full else prepared.free
    fitted, checked = (_of_role(prepared.runs, role) for role in ("identify", "validate"))
    refuse_few(fitted)
    if not checked:
        raise DataError(NOTHING_TO_CHECK)
    noise_scales = white_noise_scales([*fitted, *checked], free)
    barred = barred_effects(fitted, robot)
    nuisances = tuple(n for n, one in catalogue().items() if one.nuisance and n not in barred)
    names = tuple(catalogue()) if candidates is None else candidates
    names = tuple(name for name in names if not effect_named(name).nuisance)
    considered = tuple(name for name in names if name not in barred)
    starts = likelihood_starts(model, prepared, tuple(one.values for one in by_fidim.values()))
    base, fitted, dropped = base_fit(
        with_frames(robot, nuisances if full else ()),
        fitted,
        free,
        starts,
        noise_scales,
        _part(progress, 0.05, 0.2),
    )
    search = Search(noise_scales, considered, workers, executor, _part(progress, 0.2, 0.85))
    last = search.run(base)
    notes = [*session_notes(model, prepared, {}), *dropped]
    notes += search.kinematics.notes() if search.kinematics else []
    _tell(progress, "before and after", 0.85)
    found = _told(search, last, fitted, checked, free, notes)
    accepted = found.accepted
    _tell(progress, "diagnosis", 1.0)
    return Diagnosis(
        found.ladder,
        final_verdicts(search.rounds, found.last.effects if accepted else (), barred, names),
        rivals_of(accepted),
        found.first,
        found.final,
        found.spreads,
        search.kinematics,
        found.rest,
        tuple(notes),
        _next_swings(accepted, noise_scales),
        {effect_of(one.decision.key): one.after.slowly for one in accepted if one.after.slowly},
        found.reliance,
    )


class _Told(NamedTuple):
    """What is left of a search once its answer was doubted."""

    last: Refit
    accepted: list[Round]
    rest: Unexplained
    ladder: tuple[Rung, ...]
    first: LikelihoodFit
    final: LikelihoodFit
    spreads: tuple[Array, Array]
    reliance: str


def _told(
    search: Search,
    last: Refit,
    fitted: list[PreparedRun],
    checked: list[PreparedRun],
    free: tuple[str, ...] | None,
    notes: list[str],
) -> _Told:
    """The rounds that count, with the fits that are told of them; `notes` say what does not."""
    full, scales = free is None, search.noise_scales
    last, accepted, rest = _believed(search, last, fitted, full, notes)
    check = ""
    with search.pool_of() as pool:
        while True:
            last, held = _kept_from_dynamics(last, rest, scales, notes)
            ladder = _ladder(search, accepted, last, checked, free, pool)
            # Held-out runs are on their way in other processes.
            final = _with_own_noise(last.fit)
            spread = honest_covariance(final, last)
            fewer = taken_back(accepted, last, final, spread, scales)
            if fewer is None and (instead := gravity_instead(accepted, last, scales)):
                fewer, check = instead
            if fewer is None:
                rungs = ladder()
                seen = [rung.held_out for rung in rungs]
                fewer = unless_validated(accepted, seen, rest)
                fewer = fewer or unshown(accepted, last, seen, scales)
                if fewer is None:
                    break
            last, accepted, note = fewer
            notes.append(note)
            rest = unexplained(last.fit, fitted, full, scales)
        begun = search.rounds[0].before if accepted else last
        first = _with_own_noise(begun.fit) if accepted else final
    last_round = search.rounds[-1] if search.rounds else None
    if rest.present and last_round and last_round.decision.winner is None and last_round.stand_in:
        rest = suspected(rest, last_round.stand_in)
    # A force that won and was taken back stood in for something, however little is left.
    won = not all_settled([one for one in search.rounds if one.decision.winner is not None])
    is_missing = won or _follows_badly(last, rest)
    check = check or gravity_unasked(accepted, last, is_missing, scales)
    rest = with_unmet(suspected(rest, check) if check else rest, rungs[-1].held_out)
    if not held and not _follows_badly(last, rest):
        told_apart = parted(accepted, last, final, spread, scales)
        search.rounds, accepted = retold(search.rounds, accepted, told_apart)
    for exchange in open_exchanges(search.rounds, accepted, scales):
        spread = with_ways(spread, final, exchange)
        notes += filter(None, [sentence(exchange)])
    if vibration := unseen_vibration(last, scales):
        spread = with_ways(spread, final, vibration.exchange)
        notes.append(vibration.note)
    spread = with_settled(spread, last) if held else spread
    by_lengths = search.kinematics is not None
    left = still_missing(final, not all_settled(accepted), by_lengths, search.candidates)
    notes += filter(None, [left.note(spread)])
    before = still_missing(first, False, False) if accepted else left
    spreads = before.widened(honest_covariance(first, begun)), left.widened(spread)
    said = shown(accepted, final, spreads[1])
    search.rounds, accepted = retold(search.rounds, accepted, said)
    return _Told(last, accepted, rest, rungs, first, final, spreads, left.reliance(spread))


def _kept_from_dynamics(
    last: Refit, rest: Unexplained, noise_scales: Array, notes: list[str]
) -> tuple[Refit, bool]:
    """The last fit, its geometry held at what lengths say where forces are still missing."""
    if not len(settled_places(last.fit.model)) or not _follows_badly(last, rest):
        return last, False
    if KEPT_FROM_DYNAMICS not in notes:
        notes.append(KEPT_FROM_DYNAMICS)
    return cut(last, noise_scales), True


def _next_swings(accepted: list[Round], noise_scales: Array) -> dict[str, NextSwing]:
    """The swing that parts each accepted effect from its best rival, where there is one."""
    swings = {
        effect_of(one.decision.key): next_swing(one.after, one.decision.rival, noise_scales)
        for one in accepted
        if one.decision.rival is not None
    }
    return {name: one for name, one in swings.items() if one is not None}


def _believed(
    search: Search, last: Refit, fitted: list[PreparedRun], full: bool, notes: list[str]
) -> tuple[Refit, list[Round], Unexplained]:
    """The last fit, the rounds that count and what remains, without what is but the nearest.

    Effects that leave much of what follows the motion are not the cause; a note says which.
    """
    share = _share_explained(search, last)
    rest = unexplained(last.fit, fitted, full, search.noise_scales)
    accepted = [one for one in search.rounds if one.decision.winner is not None]
    follows_badly = _follows_badly(last, rest)
    if all_settled(accepted) or not follows_badly or share >= LEAST_SHARE_EXPLAINED:
        return last, accepted, rest
    last, settled, note = without_forces(accepted, removing_little(share, "excess"))
    notes.append(note)
    return last, settled, unexplained(last.fit, fitted, full, search.noise_scales)


def _follows_badly(last: Refit, rest: Unexplained) -> bool:
    """Whether something that follows the motion is still missing."""
    return rest.present or excess_of(last) > LARGEST_EXCESS_LEFT


def _tell(progress: Progress | None, label: str, fraction: float) -> None:
    if progress:
        progress(label, fraction)


def _part(progress: Progress | None, low: float, high: float) -> Progress | None:
    if progress is None:
        return None
    return lambda label, fraction: progress(label, low + (high - low) * fraction)


def _of_role(runs: tuple[PreparedRun, ...] | list[PreparedRun], role: str) -> list[PreparedRun]:
    return [run for run in runs if run.run.role == role and run.run.payload is None]


def _with_own_noise(found: LikelihoodFit) -> LikelihoodFit:
    """The same fit for honest standard deviations.

    Its scales follow its residuals, and errors of the cameras' calibration are unknowns too.
    """
    return with_calibration(fit(found.swings, found.unknowns, FreeSwing(grow=False)))


def _share_explained(search: Search, last: Refit) -> float:
    """Share of what forces had to explain, once lengths had settled the geometry."""
    return left_out(before_forces(search.rounds), search.noise_scales).share(last.score)


def _ladder(
    search: Search,
    accepted: list[Round],
    last: Refit,
    runs: list[PreparedRun],
    free: tuple[str, ...] | None,
    pool: Executor | None,
) -> Callable[[], tuple[Rung, ...]]:
    """Each model of the search on the validation runs: begun, and waited for later.

    Its inertia belongs to samples without the errors that its fit has found in all runs.
    """
    stages: list[Refit] = [search.rounds[0].before, *(one.after for one in accepted[:-1])]
    stages += [last] if accepted else []
    fits = [stage.fit for stage in stages]
    models = [Stage(one.model, one.inertia, one.values, amplitudes_of(one.samples)) for one in fits]
    seen = held_out(models, runs, free, pool)
    return lambda: tuple(
        Rung(claims(one.effects), held) for one, held in zip(stages, seen(), strict=True)
    )
