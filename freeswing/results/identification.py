"""results/identification.json: the inertial parameters by every method, and how they do."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from freeswing.results.codec import Document, Entry, Numbers, absent, empty, entry
from freeswing.results.common import InertiaParameter, Pose

ESTIMATE_ORDER = ("ml_full", "ml_free", "fidim_full", "fidim_free")


@entry
class DroppedRun(Entry):
    """A run that was left out."""

    run: str
    why: str = ""


@entry
class Consistency(Entry):
    """Whether a body can have the inertia; see `ident.judge.physical_consistency`."""

    possible: bool = True
    held: bool = False
    least_second_moment_m2: float | None = None
    least_second_moment_std_m2: float | None = None
    cost: float | None = absent(default=None)


@entry
class Reduced(Entry):
    """The essential parameters solved again alone (FIDIM)."""

    parameters: tuple[InertiaParameter, ...] = ()
    sigma_W: float | None = None
    cost_C: float | None = None


@entry
class Estimate(Entry):
    """One method's result.

    Attributes:
        parameters: in the contract's order; mass_kg at the end where payload runs tell it.
        sigma_W: of the regressor (FIDIM only).
        cost_C: excitation cost (FIDIM only).
        samples: time samples that it rests on.
        dropped_runs: runs left out.
        notes: sentences that belong beside the numbers.
        consistency: whether a body can have it.
        correlation: of the nine parameters, in their order, (9, 9).
        reduced: FIDIM's essential parameters alone.
        noise_m: white noise of positions (maximum likelihood).
        noise_rad: white noise of angles (maximum likelihood).
        stop_reason: why the fit ended (maximum likelihood).
        weighting: of FIDIM, where it is not the published one.
        noise_ratio: of FIDIM's weighted form.
        calibration_std: the cameras' calibration's share of the deviations (FIDIM).
        published_std: deviations as published (FIDIM): the samples' scatter alone.
        scatter_std: the same, as stretches of the runs say it where that is more (FIDIM).
        tolerances_std: the share of cable ends known to a stated tolerance (FIDIM).
        geometry_std: the share of a robot file as wrong as the residuals of the motions ask for.
        forces_std: the share of forces that the residuals of the motions ask for.
        lengths_std: the stated cable lengths' share of the deviations (FIDIM).
        noise_bias: foreseen because noise reaches the columns unevenly (FIDIM).
        smoothing_bias: foreseen because smoothing takes some of the swing (FIDIM).
        calibration_modes: calibration errors fitted beside (maximum likelihood).
    """

    parameters: tuple[InertiaParameter, ...] = ()
    sigma_W: float | None = absent(default=None)
    cost_C: float | None = absent(default=None)
    samples: int | None = None
    dropped_runs: tuple[DroppedRun, ...] = ()
    notes: tuple[str, ...] = ()
    consistency: Consistency | None = absent(default=None)
    correlation: tuple[Numbers, ...] = absent(default=())
    reduced: Reduced | None = absent(default=None)
    noise_m: float | None = absent(default=None)
    noise_rad: float | None = absent(default=None)
    stop_reason: str = absent(default="")
    weighting: str = absent(default="")
    noise_ratio: float | None = absent(default=None)
    calibration_std: Numbers | None = absent(default=None)
    published_std: Numbers | None = absent(default=None)
    scatter_std: Numbers | None = absent(default=None)
    tolerances_std: Numbers | None = absent(default=None)
    geometry_std: Numbers | None = absent(default=None)
    forces_std: Numbers | None = absent(default=None)
    lengths_std: Numbers | None = absent(default=None)
    noise_bias: Numbers | None = absent(default=None)
    smoothing_bias: Numbers | None = absent(default=None)
    calibration_modes: Any = absent(default=None)


@entry
class Difference(Entry):
    """Full poses less free coordinates, of one parameter (FIDIM 2022, eqs. 48, 49)."""

    name: str
    difference_percent: float | None = None
    std_percent: float | None = None
    z: float | None = None


@entry
class ValidatedRun(Entry):
    """A held-out run beside the best estimate.

    Attributes:
        run: its name.
        sigma_perp: error of the internal dynamics (FIDIM 2022, eq. 50), m/s2.
        prediction_rmse_m: measured less predicted position, rms a coordinate.
        prediction_rmse_rad: the same of angles.
        prediction_rmse: of partial runs, in the measured column's unit.
        column: of partial runs, which one that is.
        noise_floor: the same unit: what was left where the start was fitted.
        noise_floor_m: what the samples' own noise leaves.
        note: what a reader should know.
    """

    run: str
    sigma_perp: float | None = None
    prediction_rmse_m: float | None = None
    prediction_rmse_rad: float | None = absent(default=None)
    prediction_rmse: float | None = absent(default=None)
    column: str = absent(default="")
    noise_floor: float | None = absent(default=None)
    noise_floor_m: float | None = None
    note: str = absent(default="")


@entry
class SwingPlace(Entry):
    """Where a run took place; the equilibrium is absent where none is near."""

    run: str
    role: str = ""
    equilibrium: Pose | None = absent(default=None)
    frequencies_hz: Numbers | None = absent(default=None)
    conditioning: float | None = absent(default=None)


@entry
class BodyParameter(Entry):
    """A number of one object; what rests only on what was given is not identifiable."""

    name: str
    value: float | None = None
    std: float | None = None
    identifiable: bool = True


PLATFORM = "platform"
"""The body of this name carries the others."""


@entry
class Body(Entry):
    """The platform or a load: inertia in kg m2 about its own centre of mass."""

    name: str
    runs: tuple[str, ...] | None = absent(default=None)
    parameters: tuple[BodyParameter, ...] = ()


@entry
class ChannelGain(Entry):
    """A term of a channel, in column units per rad or m."""

    name: str
    value: float | None = None
    std: float | None = None


@entry
class ChannelResult(Entry):
    """An uncalibrated signal: its gains and its noise, in the column's unit."""

    name: str
    gains: tuple[ChannelGain, ...] = ()
    noise: float | None = None


@entry
class ClassicReason(Entry):
    """Why the classic formula is off, as far as one reason goes."""

    what: str
    percent: float = 0.0


@entry
class ClassicRow(Entry):
    """The classic formula of two or three wires beside the fit, of one run."""

    run: str
    period_s: float | None = None
    Izz_kg_m2: float | None = None
    fitted_Izz_kg_m2: float | None = None
    off_percent: float = 0.0
    reasons: tuple[ClassicReason, ...] = ()


@entry
class BudgetShare(Entry):
    """What one source adds to a deviation, in quadrature."""

    what: str
    std_kg_m2: float = 0.0


@entry
class Budget(Entry):
    """Where the deviation of a body's Izz about P comes from, largest first."""

    name: str
    shares: tuple[BudgetShare, ...] = ()


@entry
class YawAmplitudes(Entry):
    """Amplitude of yaw in parts of a run of a bench, rad: measured, and by each law of loss.

    Attributes:
        run: its name.
        times_s: middles of the parts, from the first sample.
        measured_rad: as measured.
        std_rad: their deviations.
        linear_rad: a share of what is there is lost.
        quadratic_rad: a share that grows with what is there.
        dry_rad: the same from every period.
    """

    run: str
    times_s: Numbers = ()
    measured_rad: Numbers = ()
    std_rad: Numbers = ()
    linear_rad: Numbers = ()
    quadratic_rad: Numbers = ()
    dry_rad: Numbers = ()


@entry
class YawDecay(Entry):
    """How yaw dies away on a bench: probability of each law, and every run."""

    laws: Mapping[str, float] = empty(default_factory=dict)
    runs: tuple[YawAmplitudes, ...] = ()


@entry
class MarkerRun(Entry):
    """How rigid the markers were in one run: standard deviations about a rigid body.

    Attributes:
        run: its name.
        rigidity_um: of each marker; None where it was not seen.
        left_out: markers that the others contradict.
        all_um: of all markers together.
        kept_um: of those that were used.
        frame_std_mm: of the platform frame's place.
        frame_std_mrad: of its turn.
        correlation_s: over which the deviations persist.
    """

    run: str
    rigidity_um: Numbers = ()
    left_out: tuple[str, ...] = ()
    all_um: float | None = None
    kept_um: float | None = None
    frame_std_mm: tuple[float, ...] = ()
    frame_std_mrad: tuple[float, ...] = ()
    correlation_s: float | None = None


@entry
class Markers(Entry):
    """The markers' common layout against target.toml, and each run."""

    names: tuple[str, ...] = ()
    off_target_mm: Numbers = ()
    run_std_mm: float | None = None
    runs: tuple[MarkerRun, ...] = ()


@entry
class Identification(Document):
    """What `freeswing identify` found.

    Attributes:
        estimates: by method.
        comparison: free coordinates against full poses, by method.
        validation: of the best estimate, a run each.
        validated: name of that estimate.
        free_coordinates: those used.
        amplification: how many times more the pose moves than they do, at worst.
        notes: sentences about the session.
        objects: platform and loads where the session has loads or payloads.
        channels: uncalibrated signals of a bench.
        budgets: of a bench, where each body's deviation of Izz comes from.
        classic: the classic formula of benches, by run.
        scatter_between_runs_kg_m2: of Izz on a bench beyond noise; 0: none was seen.
        yaw_decay: amplitude of yaw against time, of a bench.
        swings: where each run took place.
        entries_m: the cables' entry points.
        markers: what the recorded markers were worth.
    """

    kind: ClassVar[str] = "identification"

    estimates: Mapping[str, Estimate] = empty(default_factory=dict)
    comparison: Mapping[str, tuple[Difference, ...]] = empty(default_factory=dict)
    validation: tuple[ValidatedRun, ...] = ()
    validated: str = ""
    free_coordinates: tuple[str, ...] = ()
    amplification: float | None = None
    notes: tuple[str, ...] = ()
    objects: tuple[Body, ...] | None = absent(default=None)
    channels: tuple[ChannelResult, ...] | None = absent(default=None)
    budgets: tuple[Budget, ...] | None = absent(default=None)
    classic: tuple[ClassicRow, ...] | None = absent(default=None)
    scatter_between_runs_kg_m2: float | None = absent(default=None)
    yaw_decay: YawDecay | None = absent(default=None)
    swings: tuple[SwingPlace, ...] = ()
    entries_m: tuple[Numbers, ...] = ()
    markers: Markers | None = None

    @property
    def ranked(self) -> dict[str, Estimate]:
        """The estimates that are there, best first."""
        found = {name: self.estimates.get(name) for name in ESTIMATE_ORDER}
        return {name: one for name, one in found.items() if one is not None and one.parameters}

    @property
    def best(self) -> str | None:
        """Name of the best estimate; None without any."""
        return next(iter(self.ranked), None)
