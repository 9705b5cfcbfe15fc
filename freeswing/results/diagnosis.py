"""results/diagnosis.json: what the model lacked, judged on runs that were never fitted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from freeswing.results.codec import Document, Entry, Numbers, absent, empty, entry
from freeswing.results.common import FoundEffect, Parameter
from freeswing.results.identification import Body


@entry
class HeldOutRun(Entry):
    """One held-out run under one model."""

    run: str
    sigma_perp: float | None = None
    prediction_rmse_m: float | None = None
    prediction_rmse_rad: float | None = None
    noise_floor_m: float | None = None


@entry
class HeldOut(Entry):
    """All held-out runs under one model: root mean squares, medians, and each run.

    Attributes:
        effects: of the model, on the ladder.
        sigma_perp: error of the internal dynamics (FIDIM 2022, eq. 50), m/s2.
        prediction_rmse_m: of positions, a coordinate.
        noise_floor_m: what the samples' own noise leaves.
        prediction_rmse_rad: of angles.
        sigma_perp_median: over the runs.
        prediction_median_m: over the runs.
        runs: each.
    """

    effects: tuple[str, ...] | None = absent(default=None)
    sigma_perp: float | None = None
    prediction_rmse_m: float | None = None
    noise_floor_m: float | None = None
    prediction_rmse_rad: float | None = None
    sigma_perp_median: float | None = None
    prediction_median_m: float | None = None
    runs: tuple[HeldOutRun, ...] = ()


@entry
class NextSwing(Entry):
    """The swing that would part two models: like which run, how far, how long, how much better."""

    like: str
    reach_m: float
    duration_s: float
    times_better: float | None


@entry
class Candidate(Entry):
    """An effect that was considered.

    Attributes:
        effect: its name.
        part: of one cable or motor, its name.
        verdict: accepted, rejected, confounded or not_identifiable.
        delta_bic: change of the Bayesian information criterion.
        held_out_gain: share of the excess error that it takes away on held-out runs.
        confounded_with: what the data cannot tell it from.
        reason: why.
        experiment: that would tell them apart.
        next_swing: the swing that would, in numbers.
        probability: that the effect is in the model, where a posterior was computed.
    """

    effect: str
    part: str = absent(default="")
    verdict: str = ""
    delta_bic: float | None = None
    held_out_gain: float | None = None
    probability: float | None = None
    confounded_with: tuple[str, ...] = ()
    reason: str = ""
    experiment: str = absent(default="")
    next_swing: NextSwing | None = absent(default=None)


@entry
class Unexplained(Entry):
    """What no candidate explains: which coordinate, which frequency, how large.

    Attributes:
        present: whether a structured residual remains.
        signature: what it looks like.
        evidence: the numbers behind it.
        reliance: that the values are not to be relied on, or how far.
    """

    present: bool = False
    signature: str = ""
    evidence: Mapping[str, Any] = empty(default_factory=dict)
    reliance: str = absent(default="")


@entry
class Decay(Entry):
    """How one swing dies away: root mean square speeds in parts of the run, m/s.

    Attributes:
        run: its name.
        times_s: middles of the parts, from the start of the swing.
        measured_m_s: of a point mass of the measured kinetic energy.
        before_m_s: of the declared model.
        after_m_s: of the one that was found.
    """

    run: str
    times_s: Numbers = ()
    measured_m_s: Numbers = ()
    before_m_s: Numbers = ()
    after_m_s: Numbers = ()


@entry
class LengthWitness(Entry):
    """What the places where the platform hangs say of a displacement, without any length."""

    values: Numbers = ()
    std: Numbers = ()
    agrees: bool = False
    agreement: float | None = None


@entry
class LengthWay(Entry):
    """A part of the geometry that may be off: by how much, and how probably."""

    part: str
    probability: float
    values: Numbers = ()
    std: Numbers = ()


@entry
class WrongLengths(Entry):
    """A part of the geometry that is off, or one of several that may be; lengths in rms.

    Attributes:
        part: an effect, or one cable's part of it; the likeliest.
        probability: that at least one of the parts is off.
        values: of its parameters.
        std: their deviations.
        rivals: the other parts that may be it.
        before_m: along the runs, by the declared geometry.
        after_m: by the joint one.
        equilibria: what the resting places say.
    """

    part: str
    probability: float
    values: Numbers = ()
    std: Numbers = ()
    rivals: tuple[LengthWay, ...] = ()
    before_m: float | None = absent(default=None)
    after_m: float | None = absent(default=None)
    equilibria: LengthWitness | None = absent(default=None)


@entry
class RunLengths(Entry):
    """How a run's lengths vary along it, before and after, and its slow errors over the usual."""

    run: str
    before_m: float | None = None
    after_m: float | None = None
    slow_errors: float | None = None


@entry
class LengthValues(Entry):
    """Values of an effect that makes lengths vary, and their deviations."""

    values: Numbers = ()
    std: Numbers = ()


@entry
class Lengths(Entry):
    """What the constancy of cable lengths says without any dynamics.

    Attributes:
        wrong: parts of the geometry that are off, the surest first.
        probabilities: of each part to be off.
        runs: each.
        besides: effects that were fitted with them and are left to the dynamics to accept.
    """

    wrong: tuple[WrongLengths, ...] = ()
    probabilities: Mapping[str, float] = empty(default_factory=dict)
    runs: tuple[RunLengths, ...] = ()
    besides: Mapping[str, LengthValues] = empty(default_factory=dict)


@entry
class Diagnosis(Document):
    """What `freeswing diagnose` found.

    Attributes:
        before: the declared model on the held-out runs.
        candidates: the last word on every effect of the catalogue.
        accepted: the effects that the model lacked.
        after: the model with them.
        share_closed: of the way from the prediction error to the noise floor.
        parameters_before: inertia without them.
        parameters_after: inertia with them.
        parameters_moved_percent: by name.
        ladder: the models in between.
        unexplained: what remains.
        decay: how each fitted swing dies away.
        lengths: what the constancy of cable lengths says without any dynamics.
        objects_before: of a bench, its bodies without the effects.
        objects_after: likewise with them.
        notes: sentences about the session.
    """

    kind: ClassVar[str] = "diagnosis"

    before: HeldOut | None = None
    candidates: tuple[Candidate, ...] = ()
    accepted: tuple[FoundEffect, ...] = ()
    after: HeldOut | None = None
    share_closed: float | None = None
    parameters_before: tuple[Parameter, ...] = ()
    parameters_after: tuple[Parameter, ...] = ()
    parameters_moved_percent: Mapping[str, float | None] = empty(default_factory=dict)
    ladder: tuple[HeldOut, ...] = ()
    unexplained: Unexplained | None = None
    decay: tuple[Decay, ...] = absent(default=())
    lengths: Lengths | None = absent(default=None)
    objects_before: tuple[Body, ...] | None = absent(default=None)
    objects_after: tuple[Body, ...] | None = absent(default=None)
    notes: tuple[str, ...] = ()
