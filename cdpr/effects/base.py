"""The plug-in form: one effect is one file with a name, parameters and its term in the model.

An effect overrides only the hooks that it needs. All hooks work on symbolic expressions of one
instant; parameters arrive in the order of `parameters(robot)`. Forces are per unit of platform
mass (m/s^2), torques likewise (m^2/s^2): free motion cannot tell the mass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import casadi as ca

from freeswing.cdpr.model.body import Expression, along
from freeswing.cdpr.model.pulley import CableState, Geometry
from freeswing.cdpr.robot import Array, Robot

if TYPE_CHECKING:
    from freeswing.cdpr.driven.parameters import MotorTerms


@dataclass(frozen=True, slots=True)
class Parameter:
    """One unknown of an effect.

    Attributes:
        name: with its unit as suffix.
        low: least plausible value.
        high: greatest plausible value.
        scale: a typical size, for the scaling of steps.
        start: where a fit starts.
        amplitude: True when the effect vanishes where all its amplitude parameters are zero;
            False for shape parameters (a frequency, a point of application).
        per_run: True when each run has its own value (a phase that no clock ties to the runs).
        part: the cable that it belongs to, where an effect may touch one cable alone.
        source: who says what is known of it beforehand; empty for its plausible range.
    """

    name: str
    low: float
    high: float
    scale: float
    start: float = 0.0
    amplitude: bool = True
    per_run: bool = False
    part: str = ""
    source: str = ""

    @property
    def prior_std(self) -> float:
        """A third of the way from the start to the farther bound."""
        return max(self.high - self.start, self.start - self.low) / 3.0

    def known(self, value: float, std: float, source: str) -> Parameter:
        """The parameter with a value and its standard deviation as what `source` knows of it."""
        low, high = value - 3.0 * std, value + 3.0 * std
        return replace(self, start=value, low=low, high=high, source=source)


@dataclass(frozen=True, slots=True)
class Instant:
    """The platform at one instant, as expressions.

    Attributes:
        time_s: time since the start of the run.
        zeta: pose coordinates, (6,).
        rates: zeta_dot, (6,).
        rotation: R, (3, 3).
        omega: angular velocity in the base frame, (3,).
        com: P to centre of mass in the base frame, (3,).
        cables: lengths and angles, one a cable.
        tensions: specific tensions tau / m (n,), without the effects that need them, and for
            stretch without dry friction; None for effects that need none.
        second_rates: zeta_ddot, (6,); None but for effects on what is measured.
    """

    time_s: Expression
    zeta: Expression
    rates: Expression
    rotation: Expression
    omega: Expression
    com: Expression
    cables: tuple[CableState, ...]
    tensions: Expression = None
    second_rates: Expression = None

    @property
    def velocity(self) -> Expression:
        """Velocity of P in the base frame, (3,)."""
        return self.rates[:3]

    def velocity_of(self, cable: CableState) -> Expression:
        """Velocity of a cable's attachment point in the base frame, (3,)."""
        return self.velocity + ca.cross(self.omega, cable.lever)

    def force_at(self, lever: Expression, force: Expression) -> Expression:
        """Wrench about P, (6,), of a force at the point P + lever."""
        return ca.vertcat(force, ca.cross(lever, force))

    def torque(self, torque: Expression) -> Expression:
        """Wrench about P, (6,), of a pure torque."""
        return ca.vertcat(ca.SX.zeros(3), torque)

    def rate_of(self, quantity: Expression) -> Expression:
        """Time derivative of a quantity that depends on the pose alone."""
        return along(quantity, self.zeta, self.rates)

    def against(self, quantity: Expression, effort: Expression) -> Expression:
        """Generalised force, (6,), conjugate to zeta_dot, of an effort opposing `quantity`."""
        return -ca.jacobian(quantity, self.zeta).T * effort


@dataclass(frozen=True, slots=True)
class Experiment:
    """What to record so that effects which it sets apart no longer look alike.

    Attributes:
        advice: what to do and why it helps, as a clause.
        rank: where several would serve, those of lower rank are told first.
    """

    advice: str
    rank: int


AMPLITUDES = Experiment(
    "record swings of clearly different amplitude and let them die away for at least three "
    "times as long: dry friction, linear and quadratic drag decay differently",
    1,
)
PAYLOAD = Experiment(
    "repeat some swings with a known payload: what scales with weight and what does not part ways",
    2,
)
EQUILIBRIA = Experiment(
    "record equilibria spread over the whole workspace, with large tilts of the platform, and "
    "state the cable lengths of each run",
    3,
)
LONG_RUN = Experiment("record one run several times as long with the winches locked", 4)


@dataclass(frozen=True, slots=True)
class Recorded:
    """What a session holds, as far as effects ask.

    Attributes:
        lengths: whether any run states its cable lengths.
        slow_errors: whether any run's poses state how far they err together.
    """

    lengths: bool = True
    slow_errors: bool = False


@dataclass(frozen=True, slots=True)
class Readings:
    """How the instruments of a driven robot err together.

    Attributes:
        times_s: of the rows, (n_t,).
        latency_s: the pose in a row was true this much earlier than the session says.
        offsets_rad: what each encoder reads too much, (n_t, n).
    """

    times_s: Array
    latency_s: float
    offsets_rad: Array


class Clues(Protocol):
    """What a residual tells an effect about where its shape parameters start."""

    def common_frequencies_hz(self) -> Sequence[float]:
        """Those at which all runs' residuals stand out of their surroundings, most so first."""
        ...


class Effect:
    """An effect that leaves everything as it is; subclasses override what they change.

    Attributes:
        name: as in files and flags.
        summary: what the robot or the recording then has, as a phrase.
        needs_tension: whether its hooks use `Instant.tensions`.
        dry: whether its force jumps where a motion turns round: cables stretch by tensions without
            it.
        stage: "kinematics", "base" (gravity), "drive", "force" or "measurement".
        on_driven: whether robots moved by motors may have it.
        on_free: whether free swings may have it.
        separated_by: experiments that set it apart from others which they set apart.
        tolerance: which of `cdpr.tolerances.Tolerances` says how far its values may be from zero
            where nobody has erred; "" where that is a hundredth or so of their plausible range.
        nuisance: whether it is no claim about the robot but stands beside all that are.
        fully: the effect, in no catalogue, that makes its slow part the full motion; "": none.
        springs: whether cables pull by their stretch where it is there, instead of being held.
    """

    name: str = ""
    summary: str = ""
    needs_tension: bool = False
    dry: bool = False
    separated_by: tuple[Experiment, ...] = ()
    stage: str = "force"  # "kinematics", "base" (gravity), "drive", "force" or "measurement"
    on_driven: bool = False
    on_free: bool = True
    tolerance: str = ""
    nuisance: bool = False
    fully: str = ""
    springs: bool = False

    @property
    def stretches(self) -> bool:
        """Whether it changes cable lengths with their tension."""
        return self.needs_tension and type(self).length_change is not Effect.length_change

    @property
    def changes_measurement(self) -> bool:
        """Whether what is measured is another pose than the platform's."""
        return type(self).measured is not Effect.measured

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """The unknowns, in the order in which hooks receive them."""
        raise NotImplementedError

    def geometry(self, geometry: Geometry, values: Expression) -> Geometry:
        """Displaced geometry or gravity."""
        return geometry

    def motors(self, motors: MotorTerms, values: Expression) -> MotorTerms:
        """Changed constants of the motors of a driven robot."""
        return motors

    def payloads(self, values: Expression) -> list[tuple[Expression, Expression]]:
        """Point masses fixed to a driven platform: (mass in kg, place in its frame) each."""
        return []

    def length_change(
        self, robot: Robot, instant: Instant, values: Expression
    ) -> Expression | None:
        """How much longer each cable is than it was told to be, (n,); may use tensions."""
        return None

    def length_lag(self, robot: Robot, instant: Instant, values: Expression) -> Expression | None:
        """What lengthens each cable by its time derivative, (n,); may use tensions."""
        return None

    def wrench(self, instant: Instant, values: Expression) -> Expression | None:
        """Specific wrench about P in the base frame, (6,), conjugate to the twist."""
        return None

    def generalised_force(self, instant: Instant, values: Expression) -> Expression | None:
        """Specific generalised force, (6,), conjugate to zeta_dot."""
        return None

    def point_masses(
        self, robot: Robot, instant: Instant, values: Expression
    ) -> list[tuple[Expression, Expression, Expression]]:
        """Rigidly attached masses over the platform's: (lever, inertial mass, heavy mass) each."""
        return []

    def measured(self, instant: Instant, values: Expression) -> Expression | None:
        """Change of the measured pose: translation and small base-frame rotation, (6,)."""
        return None

    def readings(self, readings: Readings, values: Array) -> Readings:
        """Changed readings of a driven robot: numbers, not expressions."""
        return readings

    def stretch(self, values: Array, mass_kg: float) -> tuple[float, float]:
        """Compliance 1/EA of a driven robot's cables in 1/N, and their relaxation time in s."""
        return 0.0, 0.0

    @property
    def beside_motion(self) -> bool:
        """Whether the equations of a driven robot with rigid cables know nothing of it."""
        kind = type(self)
        return kind.readings is not Effect.readings or kind.stretch is not Effect.stretch

    def cannot_show(self, robot: Robot, recorded: Recorded) -> str:
        """Why this robot or these recordings could not show it, or "" where they could."""
        return "" if self.parameters(robot) else "this robot has no part that could show it"

    def length_pattern(self, times_s: Array, lengths_m: Array, tensions: Array) -> Array | None:
        """How lengths vary along a run with locked winches where it is at work, (n_t, n, k).

        Geometry that is fitted to constant lengths has it as a rival; it is itself left to the
        dynamics. One column an unknown, for lengths (n_t, n) and specific tensions (n_t, n).
        """
        return None

    def shape_guesses(self, clues: Clues) -> Sequence[dict[str, float]]:
        """Where shape parameters may start on a residual, by name; others at their `start`."""
        return ()

    def further_shapes(self) -> Sequence[dict[str, float]]:
        """Shapes that a fit starts from besides, by name, where the first has not converged."""
        return ()


def each(robot: Robot, stem: str, unit: str, low: float, high: float, scale: float):
    """One parameter a cable, named stem_<cable>_unit."""
    return tuple(
        Parameter(f"{stem}_{cable.name}_{unit}".rstrip("_"), low, high, scale, part=cable.name)
        for cable in robot.cables
    )


def each_axis(robot: Robot, stem: str, axes: str, unit: str, bound: float, scale: float):
    """One parameter a cable and axis, named stem_<cable>_<axis>_unit, within +- bound."""
    return tuple(
        Parameter(f"{stem}_{cable.name}_{axis}_{unit}", -bound, bound, scale, part=cable.name)
        for cable in robot.cables
        for axis in axes
    )
