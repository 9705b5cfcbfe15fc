"""What is said of a driven robot under control: linear.json, controller(s).json and the like."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.linear import COORDINATES, LinearModel, Mode
from freeswing.printing.curves import Panel
from freeswing.results.codec import Document, Entry, Numbers, absent, entry

Array = NDArray[np.float64]
Rows = tuple[Numbers, ...]


@entry
class LinearMode(Entry):
    """One mode of the linear model."""

    rate_rad_s: float | None
    frequency_hz: float | None
    damping: float | None
    words: str
    shape: Numbers


@entry
class SingularValues(Entry):
    """Of position by force and of orientation by moment, at each rate (Fig. 8)."""

    rate_rad_s: Numbers
    position_m_N: Rows
    orientation_rad_N_m: Rows


@entry
class Linear(Document):
    """linear.json: u is the change of the wrench about P in base axes, y that of the pose."""

    kind: ClassVar[str] = "linear"

    robot: str
    coordinates: tuple[str, ...]
    at: Numbers
    wrench: Numbers
    A: Rows
    B: Rows
    C: Rows
    D: Rows
    mass: Rows
    damping: Rows
    stiffness: Rows
    turning: Rows
    wrench_matrix: Rows
    modes: tuple[LinearMode, ...]
    singular_values: SingularValues
    currents_A: Numbers | None


@entry
class Halves(Entry):
    """A number of the loop's position, and the same of its orientation."""

    position: float | None
    orientation: float | None


@entry
class AtDelay(Entry):
    """The loop with poses as old as they are."""

    delay_s: float | None
    stable: bool
    margins: Halves
    bandwidth_rad_s: Halves


@entry
class OperatingPoint(Entry):
    """Where a controller was designed, and the wrench that holds the platform there."""

    position_m: Numbers
    angles_rad: Numbers
    wrench: Numbers


@entry
class ControllerResult(Document):
    """controller.json; what its method alone has to say, such as `norm`, is in `further`."""

    kind: ClassVar[str] = "controller"

    method: str
    gamma: float | None
    order: int
    sample_rate_hz: int
    A: Rows
    B: Rows
    C: Rows
    D: Rows
    margins: Halves
    bandwidth_rad_s: Halves
    static_error: Halves
    stable: bool
    delay_margin_s: float | None
    with_delay: AtDelay
    operating_point: OperatingPoint
    warnings: tuple[str, ...]
    carried_by_encoders: bool = absent(default=False)
    predictor: Mapping[str, Rows] | None = absent(default=None)

    def row(self) -> ControllerRow:
        """Its row in controllers.json."""
        return ControllerRow(
            gamma=self.gamma,
            order=self.order,
            margins=self.margins,
            bandwidth_rad_s=self.bandwidth_rad_s,
            delay_margin_s=self.delay_margin_s,
            with_delay=self.with_delay,
        )


@entry
class ControllerRow(Entry):
    """One controller beside others."""

    gamma: float | None
    order: int
    margins: Halves
    bandwidth_rad_s: Halves
    delay_margin_s: float | None
    with_delay: AtDelay


@entry
class Controllers(Document):
    """controllers.json: all controllers of one robot, by method."""

    kind: ClassVar[str] = "controllers"

    controllers: Mapping[str, ControllerRow]


@entry
class Examined(Entry):
    """A controller on one plant."""

    stable: bool
    margins: Halves
    gamma: float | None = absent(default=None)


@entry
class PlaceExamined(Entry):
    """A controller at one place, as it is and turned into the place's axes."""

    position_m: Numbers
    stable: bool
    margins: Halves
    gamma: float | None = absent(default=None)
    scheduled: Examined


@entry
class FirstFailure(Entry):
    """How far along an axis tensions hold the platform, and where the controller first fails."""

    along: str
    sign: float
    held_to: float | None
    fails_at: float | None
    scheduled_fails_at: float | None


@entry
class WorstDraw(Entry):
    """The robot of a cloud that the controller holds worst."""

    stable: bool
    margins: Halves
    gamma: float | None = absent(default=None)
    margin: float | None
    numbers: Mapping[str, float | None]


@entry
class Draws(Entry):
    """Robots that might be the one that was identified."""

    count: int
    source: str
    note: str
    std: Mapping[str, float | None]
    unstable: int
    failing: int
    worst: WorstDraw
    gamma_largest: float | None


@entry
class Robustness(Document):
    """robustness.json: the grid, the rays and the draws, in sentences too."""

    kind: ClassVar[str] = "robustness"

    method: str
    controller: str
    grid: tuple[PlaceExamined, ...]
    first_failures: tuple[FirstFailure, ...]
    draws: Draws
    sentences: tuple[str, ...]


@entry
class StepResult(Entry):
    """What a run left of one step of a task; see `servo.loop.judge`."""

    begins_s: float
    left_m: float | None
    left_rad: float | None
    jitter_m: float | None
    t90_s: float | None
    overshoot: float | None


@entry
class TrialResult(Entry):
    """One run of a task."""

    controller: str
    trial: str
    friction_feed: bool
    encoders: bool
    schedule: bool
    seed: int
    steps: tuple[StepResult, ...]
    least_N: float | None
    most_N: float | None
    slack: tuple[str, ...]
    outside: float | None
    scaled: float | None
    current_rms_A: float | None
    held: bool
    why: str


@entry
class ServoResult(Document):
    """servo.json: every run of a task."""

    kind: ClassVar[str] = "servo"

    task: str
    trials: tuple[TrialResult, ...]


def linear_document(
    robot: str,
    linear: LinearModel,
    found: Sequence[Mode],
    rates: Array,
    response: Any,
    currents_A: Array | None,
) -> Linear:
    """The linear model with its modes.

    Args:
        robot: its name.
        linear: its model about a pose.
        found: the modes.
        rates: of the singular values in rad/s, (n,).
        response: the model's at these, (n, 6, 6).
        currents_A: that hold the pose, (n_cables,), None where none do.
    """
    matrices = ("A", "B", "C", "D", "mass", "damping", "stiffness", "turning", "wrench_matrix")
    table = {
        "format": Linear.format(),
        "robot": robot,
        "coordinates": list(COORDINATES),
        "at": linear.at,
        "wrench": linear.wrench,
        **{name: getattr(linear, name) for name in matrices},
        "modes": [
            {
                "rate_rad_s": mode.rate_rad_s,
                "frequency_hz": mode.rate_rad_s / (2.0 * np.pi),
                "damping": mode.damping,
                "words": mode.words,
                "shape": mode.shape,
            }
            for mode in found
        ],
        "singular_values": {
            "rate_rad_s": rates,
            "position_m_N": _values(response[:, :3, :3]),
            "orientation_rad_N_m": _values(response[:, 3:, 3:]),
        },
        "currents_A": currents_A,
    }
    return Linear.from_json(table)


def linear_panels(rates: Array, response: Any) -> tuple[Panel, ...]:
    """Fig. 8: position by force, orientation by moment."""
    return tuple(
        Panel(title, "rad/s", up, rates, _values(block))
        for title, up, block in (
            ("position", "m/N", response[:, :3, :3]),
            ("orientation", "rad/(N m)", response[:, 3:, 3:]),
        )
    )


def _values(blocks: Any) -> Array:
    return np.asarray(np.linalg.svd(blocks, compute_uv=False), float)
