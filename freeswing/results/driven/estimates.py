"""`drive.json`: a driven robot's numbers by every method, and how well each run follows them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, TypeVar

import numpy as np

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.cdpr.files.documents import InputError, load_json
from freeswing.results.codec import Document, Entry, Numbers, absent, empty, entry
from freeswing.servo.files.identified_file import Identified, identified

LARGEST_BYTES = 64 * 2**20
AGAIN = "delete it and run freeswing drive again"
Rows = tuple[Numbers, ...]
D = TypeVar("D", bound=Document)


@entry
class DriveNumber(Entry):
    """One number by one method; value and std are None where the data do not determine it.

    Attributes:
        name: unit at its end.
        value: SI.
        std: standard deviation.
        identifiable: whether the data determine it.
        on_bound: the search ended on a bound: no estimate.
        tied: names held equal to it.
    """

    name: str
    value: float | None
    std: float | None = None
    identifiable: bool = True
    on_bound: bool = False
    tied: tuple[str, ...] = absent(())


@entry
class Method(Entry):
    """Numbers by the regression of inverse dynamics."""

    parameters: tuple[DriveNumber, ...]
    condition: float | None = None


@entry
class OfPublished(Entry):
    """Kinematics by the paper's (18).

    Attributes:
        parameters: the numbers.
        rms_rad: what the angles are off.
        condition: of the search.
        stopped: why it ended.
    """

    parameters: tuple[DriveNumber, ...]
    rms_rad: float | None
    condition: float | None
    stopped: str


@entry
class OfStaticPoses(OfPublished):
    """Kinematics by likelihood, every true pose unknown."""

    equation_18: OfPublished


@entry
class Joint(Entry):
    """Numbers by a search over whole runs.

    Attributes:
        parameters: the numbers.
        correlation: of them, in their order; rows of what is not determined are zero.
        condition: of the search.
        iterations: its steps.
        stopped: why it ended.
        second_start_z: how far it ends from a second start, in deviations; -1, and absent in the
            file: none was made; None: not finite.
        initial_values: the method that it starts from; absent: the declared ones.
    """

    parameters: tuple[DriveNumber, ...]
    correlation: Rows
    condition: float | None = None
    iterations: int = 0
    stopped: str = ""
    second_start_z: float | None = absent(-1.0)
    initial_values: str | None = absent()

    @property
    def values(self) -> Mapping[str, float | None]:
        """By name."""
        return {one.name: one.value for one in self.parameters}


@entry
class Estimates(Entry):
    """By method, in the order in which they are made."""

    inverse_dynamics: Method | None = absent()
    output_error: Joint | None = absent()
    joint: Joint
    kinematic: OfStaticPoses | None = absent()


@entry
class DriveFit(Entry):
    """How a run is followed, in per cent by motor: by (22), and as MATLAB counts."""

    run: str
    role: str
    equation_22: Numbers
    matlab: Numbers
    rms_rad: float | None


@entry
class UsedRun(Entry):
    """How much of a run was fitted: up to its first slack cable."""

    run: str
    seconds: float | None
    whole: bool


@entry
class RampRead(Entry):
    """Coulomb friction read off a ramp of current, beside the estimate's."""

    run: str
    motor: str
    slope_A_s: float | None
    moved_s: float | None
    ramp_N_m: float | None
    estimate_N_m: float | None
    estimate_on_this_ramp_N_m: float | None
    slope_costs_N_m: float | None
    breakaway_s: float | None


@entry
class SlackRun(Entry):
    """A run in which cables would have had to push."""

    run: str
    samples: int
    cables: tuple[str, ...]
    from_s: float | None
    least_tension_N: float | None
    in_model: bool


@entry
class SaturatedRun(Entry):
    """A run in which motors were asked for more than their limits."""

    run: str
    samples: int
    motors: tuple[str, ...]


@entry
class AnglesLeft(Entry):
    """The angles' residuals by run: how alike 10 ms apart, and over their noise."""

    autocorrelation_10_ms: Mapping[str, float | None]
    times_noise: Mapping[str, float | None]


@entry
class DriveResult(Document):
    """The whole of drive.json."""

    kind: ClassVar[str] = "drive-result"

    session: str
    estimates: Estimates
    fit_percent: tuple[DriveFit, ...]
    initial_fit_percent: tuple[DriveFit, ...]
    used: tuple[UsedRun, ...]
    ramps: tuple[RampRead, ...]
    slack: tuple[SlackRun, ...]
    saturated: tuple[SaturatedRun, ...]
    residual: AnglesLeft
    effects: tuple[str, ...] = absent(())
    held: tuple[str, ...] | None = absent()


@entry
class JointNumbers(Entry):
    """Of the joint estimate as much as other commands need."""

    parameters: tuple[DriveNumber, ...]
    correlation: Rows = ()


@entry
class JointAlone(Entry):
    """Of the estimates likewise."""

    joint: JointNumbers


@entry
class DriveNumbers(Document):
    """Of drive.json what export and robustness need; the rest may be missing."""

    kind: ClassVar[str] = "drive-result"

    estimates: JointAlone
    effects: tuple[str, ...] = absent(())
    residual: Mapping[str, Mapping[str, float | None]] = empty(default_factory=dict)


def read_drive(path: Path, kind: type[D]) -> D:
    """drive.json as one of its documents.

    Raises:
        InputError: where it is not there, of another kind, or a value is not what its key says.
    """
    table = load_json(path, kind.format(), LARGEST_BYTES, AGAIN)
    try:
        return kind.from_json(table)
    except ValueError as failure:
        raise InputError(f"{path}: {str(failure)[:200]}; {AGAIN}") from None


def joint_numbers(path: Path) -> Mapping[str, float | None] | None:
    """Values of the joint estimate by name, None where there is no such file.

    Raises:
        InputError: where it is not one.
    """
    if not path.is_file():
        return None
    joint = read_drive(path, DriveNumbers).estimates.joint
    return {one.name: one.value for one in joint.parameters}


def read_identified(path: Path | str, model: DrivenModel) -> Identified:
    """The joint estimate as robots are drawn from it.

    Raises:
        InputError: unreadable, of another kind, of another robot, or no covariance.
    """
    joint = read_drive(Path(path), DriveNumbers).estimates.joint
    correlation = np.array(joint.correlation, dtype=np.float64)
    try:
        return identified(joint.parameters, correlation, model)
    except ValueError as error:
        raise InputError(f"{path}: estimates.joint: {error}") from error
