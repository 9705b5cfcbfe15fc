"""What is asked of a plan of swings, and what a plan is."""

from __future__ import annotations

from dataclasses import dataclass, field

from freeswing.cdpr.robot import Array
from freeswing.excite.information import MeasurementNoise
from freeswing.excite.swing import Swing, SwingLimits
from freeswing.excite.winch_release import WinchRelease

CRITERIA = ("cost", "information")


@dataclass(frozen=True, slots=True)
class ExcitationOptions:
    """What is asked of a plan.

    Attributes:
        n_swings: equilibria n_e.
        n_samples: samples a swing.
        duration_s: length of a swing.
        limits: what every swing keeps.
        criterion: "cost" for C of eq. (40), "information" for D-optimality of the
            maximum-likelihood estimate.
        n_library: random swings to choose from.
        n_starts: random plans that exchange starts from.
        rounds: rounds of refinement by gradients ("cost" alone).
        n_random: random plans to score beside the best one.
        noise: of the measurements, for the predicted standard deviations.
        mass_kg: overrules the robot file's.
        winch: whether to plan the winches' motions that let the swings go.
        seed: of all chance.
    """

    n_swings: int = 12
    n_samples: int = 100
    duration_s: float = 10.0
    limits: SwingLimits = field(default_factory=SwingLimits)
    criterion: str = "cost"
    n_library: int = 96
    n_starts: int = 30
    rounds: int = 6
    n_random: int = 0
    noise: MeasurementNoise = field(default_factory=MeasurementNoise)
    mass_kg: float | None = None
    winch: bool = False
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Plan:
    """Swings to record.

    Attributes:
        swings: in the order of a short way from one to the next.
        cost: C, from the motions simulated once more to 1e-10 m, W taken as a whole.
        start_costs: what each start reached by exchange, rising.
        history: C along the refinement.
        random: C of random plans, (n_random,).
        std: predicted standard deviations of the inertia values, (9,).
        releases: the winches' motions, None where there is none; empty when not asked for.
        seconds: making the library, all starts, and the refinement.
    """

    swings: tuple[Swing, ...]
    cost: float
    start_costs: tuple[float, ...]
    history: tuple[float, ...]
    random: Array
    std: Array
    releases: tuple[WinchRelease | None, ...]
    seconds: tuple[float, float, float]


def check_options(options: ExcitationOptions) -> None:
    """Refuse options that make no sense.

    Raises:
        ValueError: naming the option, its value and its limit.
    """
    low, high = options.limits.tension_N
    if not 0 <= low < high:
        raise ValueError(f"tension limits {low:g} to {high:g} N: need 0 <= lowest < highest")
    for name in ("n_swings", "n_samples", "n_starts"):
        value, least = getattr(options, name), {"n_samples": 10}.get(name, 1)
        if value < least:
            raise ValueError(f"{name} is {value}, must be at least {least}")
    if options.n_library < options.n_swings:
        raise ValueError(
            f"n_library is {options.n_library}, must be at least n_swings = {options.n_swings}"
        )
    if options.criterion not in CRITERIA:
        raise ValueError(f"criterion {options.criterion!r} must be one of {', '.join(CRITERIA)}")
