"""results/homing.json, homing-advice.json and excitation.json: before anything is recorded."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from freeswing.results.codec import Document, Entry, Numbers, absent, empty, entry
from freeswing.results.common import Pose


@entry
class ResidualRms(Entry):
    """What the fitted start pose leaves of the readings, and of equilibrium over weight."""

    sigma_rad: float | None = None
    length_m: float | None = None
    statics: float | None = None


@entry
class ReadingNoise(Entry):
    """Noise of the readings, stated or found."""

    sigma_rad: float | None = None
    length_m: float | None = None
    stated: bool = False


@entry
class SuspectReading(Entry):
    """A reading that the others contradict."""

    row: int = 0
    column: str = ""
    residual: float | None = None


@entry
class Homing(Document):
    """The start pose, with deviations, and how the readings agree with it."""

    kind: ClassVar[str] = "homing"

    start_pose: Pose
    start_pose_std: Pose
    cable_lengths_m: Numbers = ()
    cable_lengths_std_m: Numbers = ()
    swivel_angles_rad: Numbers = ()
    swivel_angles_std_rad: Numbers = ()
    residual_rms: ResidualRms | None = None
    conditioning: float | None = None
    seconds: float | None = None
    poses: int | None = None
    noise: ReadingNoise
    chi_square_over_degrees: float
    suspect_readings: tuple[SuspectReading, ...] = ()
    geometry: Any = None


@entry
class HomingQuality(Entry):
    """How well pulleys home: deviations of the start, and conditioning."""

    position_std_m: float
    angle_std_rad: float | None = None
    conditioning: float


@entry
class AdvisedCable(Entry):
    """A cable's swivel axes, and whether they differ from those declared."""

    name: str
    changed: bool = False
    swivel_x: Numbers = ()
    swivel_y: Numbers = ()
    swivel_z: tuple[float, ...] = ()


@entry
class HomingAdvice(Document):
    """Swivel axes that determine the start position better."""

    kind: ClassVar[str] = "homing-advice"

    assumed_std: Mapping[str, float | None] = empty(default_factory=dict)
    declared: HomingQuality
    advised: HomingQuality
    cables: tuple[AdvisedCable, ...] = ()


@entry
class PlannedSwing(Entry):
    """One swing of a plan.

    Attributes:
        cable_lengths_m: to be held.
        equilibrium: where it hangs at them.
        release: where it is let go.
        tension_range_N: lowest and highest tension.
        frequencies_hz: of its modes.
        conditioning: how many times more the pose moves than the free coordinates.
        reach: displacement by coordinate.
        winch_release: the winches' motion: absent where none was asked for, None where the
            limits leave none.
    """

    cable_lengths_m: tuple[float, ...] = ()
    equilibrium: Pose
    release: Pose
    tension_range_N: tuple[float, ...] = ()
    frequencies_hz: Numbers = ()
    conditioning: float | None = None
    reach: Mapping[str, float | None] = empty(default_factory=dict)
    winch_release: Any = absent(default="not asked for")


@entry
class RandomPlans(Entry):
    """What plans drawn at random would cost."""

    count: int
    quantiles: Mapping[str, float]
    share_below_10: float


@entry
class Excitation(Document):
    """A plan of swings and what it is worth."""

    kind: ClassVar[str] = "excitation"

    cost_C: float
    equilibria: tuple[PlannedSwing, ...] = ()
    criterion: str = ""
    free_coordinates: tuple[str, ...] = ()
    samples_per_swing: int | None = None
    duration_s: float | None = None
    limits: Mapping[str, Any] = empty(default_factory=dict)
    mass_kg: float | None = None
    predicted_std: Mapping[str, float | None] = empty(default_factory=dict)
    starts: Mapping[str, Any] = empty(default_factory=dict)
    refinement: Numbers = ()
    seconds: Mapping[str, float | None] = empty(default_factory=dict)
    random_plans: RandomPlans | None = None


@entry
class BenchChoice(Entry):
    """What a choice would cost, all else as the plan has it: deviation of the object's Izz."""

    what: str
    value: float
    percent: float
    best: bool = False


@entry
class BenchSource(Entry):
    """What one source adds to the deviation of the object's Izz under the plan."""

    what: str
    percent: float


@entry
class BenchPlan(Document):
    """Which swings of a bench tell an object's Izz best, and what remains of its deviation."""

    kind: ClassVar[str] = "bench-plan"

    percent: float
    choices: tuple[BenchChoice, ...] = ()
    sources: tuple[BenchSource, ...] = ()
    assumed: Mapping[str, float] = empty(default_factory=dict)
