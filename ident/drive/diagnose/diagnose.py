"""What a driven robot's model lacks: the screen proposes, fits and held-out runs decide."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace

import numpy as np

from freeswing.cdpr.system.progress import Progress
from freeswing.ident.drive.asked_session import DriveSession
from freeswing.ident.drive.diagnose.candidates import Candidate, candidates
from freeswing.ident.drive.diagnose.refit import Fitted, fitted, refitted, settled, with_candidate
from freeswing.ident.drive.diagnose.screen import Screened, jump_start, screen
from freeswing.ident.drive.identify import geometry, possible, premise_of, step_1
from freeswing.ident.drive.inverse_dynamics import inverse_dynamics
from freeswing.ident.drive.joint import Problem
from freeswing.ident.drive.records.slack import before_slack
from freeswing.ident.drive.trust import ABOVE_NOISE

REFITTED = 4  # a round: the screen orders them well, and each takes seconds
# A candidate must be worth this much BIC, as must a lead over its rivals.
LEAST_BIC = 10.0
CONFOUNDED = 12.0
MOST_EFFECTS = 4
# Where something is left over for good, a cause must at least halve the residual and leave half of
# what any rival leaves: the nearest candidate does neither.
HALVED = 0.5
LEAD = 2.0


@dataclass(frozen=True, slots=True)
class Verdict:
    """What became of one candidate.

    Attributes:
        candidate: which.
        verdict: accepted, rejected, confounded or not_identifiable.
        delta_bic: of the model with it.
        held_out_gain: share of the held-out excess over the noise that it takes away.
        confounded_with: labels of what the data cannot tell it from.
        reason: a sentence.
        fit: with it, where the data cannot tell it from others: what it would be.
    """

    candidate: Candidate
    verdict: str
    delta_bic: float
    held_out_gain: float
    confounded_with: tuple[str, ...] = ()
    reason: str = ""
    fit: Fitted | None = None


@dataclass(frozen=True, slots=True)
class DriveDiagnosis:
    """The answer.

    Attributes:
        before: the declared robot with its asked numbers fitted.
        after: the same with what was accepted.
        verdicts: the last word on every candidate.
        accepted: candidates, in the order in which they were found.
        ladder: all models from `before` to `after`.
        unexplained: whether something remains that no candidate explains.
    """

    before: Fitted
    after: Fitted
    verdicts: tuple[Verdict, ...]
    accepted: tuple[Candidate, ...]
    ladder: tuple[Fitted, ...]
    unexplained: bool


@dataclass(slots=True)
class _Search:
    """The ladder under way."""

    session: DriveSession
    ladder: list[Fitted]
    verdicts: dict[str, Verdict] = field(default_factory=dict)
    leads: list[float] = field(default_factory=list)

    @property
    def top(self) -> Fitted:
        return self.ladder[-1]

    def say(
        self, one: Candidate, verdict: str, reason: str, *figures: float, beside=(), fit=None
    ) -> None:
        bic, gain = figures or (0.0, 0.0)
        self.verdicts[one.label] = Verdict(one, verdict, bic, gain, tuple(beside), reason, fit)


def diagnose_drive(
    session: DriveSession, progress: Progress, only: Collection[str] | None = None
) -> DriveDiagnosis:
    """Find what is missing.

    Args:
        session: the recordings, with runs kept apart.
        progress: told how far it is.
        only: effects to consider; None: the whole catalogue.

    Raises:
        ValueError: when the runs cannot be simulated from where the search begins.
    """
    progress("the model as it is declared", 0.05)
    base = _base(session)
    session = _clear_of_slack(session, base)
    search = _Search(session, [refitted(session, base)])
    for round_ in range(MOST_EFFECTS):
        progress(f"candidates, round {round_ + 1}", 0.2 + 0.2 * round_)
        if not _climb(search, only):
            break
    _drop_what_became_idle(search)
    return _judged(search)


def _base(session: DriveSession) -> Fitted:
    model, asked, runs = session.model, session.asked, session.of("identify")
    theta, offsets = geometry(session, step_1(session)[1])
    try:
        regression = inverse_dynamics(model, theta, asked.dynamic, list(runs), offsets)
        theta = asked.dynamic.put(model, theta, possible(session, regression))
    except ValueError:  # angles that fit no pose: something is missing, which is the question
        pass
    return fitted(session, premise_of(session, theta, offsets), asked)


def _clear_of_slack(session: DriveSession, base: Fitted) -> DriveSession:
    """The session with every run up to its first slack cable, so that all models see the same."""
    found = base.found
    runs = before_slack(base.given.model, found.theta, session.runs, found.offsets, at_least=True)
    return replace(session, runs=runs)


def _climb(search: _Search, only: Collection[str] | None) -> bool:
    """One effect more on the ladder, if any is worth it."""
    base = search.top
    problem = Problem(base.given, base.found.asked)
    problem.normal(_point(problem, base))
    starts = jump_start(problem.seen, ("encoder_jump.after_s",))
    chosen = candidates(base.given.model, base.found.asked, only)
    told = screen(base.given, base.found, chosen, starts)
    worth = _worth(search, base, told)
    tried = []
    for one in worth[:REFITTED]:
        try:
            tried.append(with_candidate(search.session, base, one, starts))
        except ValueError as error:
            search.say(one.candidate, "rejected", f"cannot be followed: {error}")
    tried = [fit for fit in tried if np.isfinite(fit.chi_square)]
    if not tried:
        return False
    tried.sort(key=lambda fit: fit.bic_beside(base))
    tried[0] = settled(search.session, tried[0])
    best, others = tried[0], tried[1:]
    for fit in tried:
        told_bic, gain = fit.bic_beside(base), share_closed(base, fit)
        search.say(_of(fit), "rejected", "another explains more", told_bic, gain)
    if best.bic_beside(base) > -LEAST_BIC or best.times_noise >= base.times_noise:
        search.say(_of(best), "rejected", "held-out runs do not gain", best.bic_beside(base), 0.0)
        return False
    like = [fit for fit in others if fit.bic_beside(base) - best.bic_beside(base) < CONFOUNDED]
    if like:
        group = [_of(fit) for fit in (best, *like)]
        for one, fit in zip(group, (best, *like), strict=True):
            names = [other.label for other in group if other is not one]
            figures = fit.bic_beside(base), share_closed(base, fit)
            reason = f"these recordings cannot tell it from {', '.join(names)}"
            search.say(one, "confounded", reason, *figures, beside=names, fit=fit)
        return False
    search.ladder.append(best)
    search.leads.append(min((fit.times_noise for fit in others), default=np.inf))
    return True


def _point(problem: Problem, base: Fitted) -> np.ndarray:
    x = base.found.found.values.copy()
    x[: problem.k] = base.found.values
    return x


def _worth(search: _Search, base: Fitted, told: tuple[Screened, ...]) -> list[Screened]:
    """Candidates whose linear gain pays for their numbers, best first."""
    scale = max(1.0, base.chi_square / base.n)
    found = []
    for one in told:
        if one.why:
            search.say(one.candidate, "rejected", f"cannot be followed: {one.why}")
            continue
        bic = -one.gain / scale + len(one.candidate.groups) * np.log(base.n)
        if not one.seen:
            reason = "these recordings do not tell it from the numbers that are asked for"
            search.say(one.candidate, "not_identifiable", reason)
        elif bic > -LEAST_BIC:
            search.say(one.candidate, "rejected", "explains nothing", float(bic), 0.0)
        else:
            search.say(one.candidate, "rejected", "others explain more", float(bic), 0.0)
            found.append((bic, one))
    return [one for _, one in sorted(found, key=lambda pair: pair[0])]


def _of(fit: Fitted) -> Candidate:
    if fit.candidate is None:
        raise ValueError("the ladder's foot has no candidate")
    return fit.candidate


def share_closed(base: Fitted, fit: Fitted) -> float:
    """Share of the held-out residual above its noise that goes away."""
    excess = base.times_noise - 1.0
    return float((base.times_noise - fit.times_noise) / excess) if excess > 0.0 else 0.0


def _drop_what_became_idle(search: _Search) -> None:
    """What a later effect has made needless leaves the ladder."""
    for fit in search.ladder[1:-1]:
        one, top = _of(fit), search.top
        names = {group.name for group in one.groups}
        places = [k for k, name in enumerate(top.found.asked.names) if name in names]
        values, std = top.found.values[places], top.found.std[places]
        if np.abs(values / std).max() < 3.0:
            search.say(one, "rejected", "another effect explains it as well")
            search.ladder.remove(fit)


def _judged(search: _Search) -> DriveDiagnosis:
    before, after = search.ladder[0], search.top
    explained = after.times_noise <= ABOVE_NOISE
    accepted = []
    below = before
    for fit, lead in zip(search.ladder[1:], search.leads, strict=False):
        one, figures = _of(fit), (fit.bic_beside(below), share_closed(below, fit))
        clear = fit.times_noise <= HALVED * below.times_noise
        clear = clear and fit.times_noise * LEAD <= lead
        if not (explained or clear):
            reason = (
                f"the nearest candidate, and held-out angles still are {after.times_noise:.1f} "
                "times their noise: something else is missing"
            )
            search.say(one, "rejected", reason, *figures)
            break
        search.say(one, "accepted", "held-out runs need it", *figures)
        accepted.append(one)
        below = fit
    ladder = search.ladder[: len(accepted) + 1]
    confounded = any(v.verdict == "confounded" for v in search.verdicts.values())
    unexplained = not confounded and ladder[-1].times_noise > ABOVE_NOISE
    verdicts = tuple(search.verdicts.values())
    return DriveDiagnosis(before, ladder[-1], verdicts, tuple(accepted), tuple(ladder), unexplained)
