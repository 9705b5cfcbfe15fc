"""A controller as every command passes it on: continuous, discrete, and what is known of it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from freeswing.servo.design.mpc import Predictor
from freeswing.servo.design.plant import CONTROL_RATE_HZ, Plant
from freeswing.servo.synthesis.discretise import zero_order_hold
from freeswing.servo.synthesis.loop import Loop, examine
from freeswing.servo.synthesis.state_space import Array, StateSpace

# Half a control period more than the pose's age: the wrench is held so long on average.
HALF_HOLD_S = 0.5 / CONTROL_RATE_HZ


@dataclass(frozen=True, slots=True)
class Controller:
    """From the pose error [x y z roll pitch yaw] to the change of the wrench F_ev.

    Attributes:
        method: one of `family.METHODS`; the error of "joint-pid" is the motors', not the pose's.
        system: continuous.
        sampled: the same at the control rate.
        at: the pose that it was designed about, (6,).
        wrench: F_ev that holds it there, (6,).
        undelayed: the loop as if poses were instantly there.
        delayed: the loop with poses as old as `delay_s`.
        delay_s: mean age of poses plus half a hold of the wrench.
        facts: what its method has to say, such as gamma.
        warnings: sentences.
        carried: designed for poses that the encoders carry on to now.
        predictor: of a predictive controller, else None.
    """

    method: str
    system: StateSpace
    sampled: StateSpace
    at: Array
    wrench: Array
    undelayed: Loop
    delayed: Loop
    delay_s: float
    facts: dict[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    carried: bool = False
    predictor: Predictor | None = None

    @property
    def gamma(self) -> float | None:
        """The bound that its synthesis reached at best; None where it has none."""
        return self.facts.get("gamma")

    @property
    def norm(self) -> float:
        """Of the weighted loop; 1 where no weights were met."""
        return self.facts.get("norm", 1.0)

    @property
    def weights_faster(self) -> float:
        """By how much the rates of its weights were multiplied."""
        return self.facts.get("share", 1.0)


def finished(
    method: str,
    plant: Plant,
    system: StateSpace,
    facts: dict[str, float],
    warnings: tuple[str, ...] = (),
) -> Controller:
    """Sample and examine a continuous controller.

    Raises:
        ValueError: where its fastest pole is too fast for the control rate.
    """
    period = 1.0 / CONTROL_RATE_HZ
    fastest = float(np.abs(system.poles()).max(initial=0.0))
    # A pole at half the sampling rate (3141 rad/s) is not seen by the samples at all.
    if fastest > np.pi * CONTROL_RATE_HZ and method != "hinf":
        raise ValueError(f"a pole at {fastest:.3g} rad/s is too fast for {CONTROL_RATE_HZ} Hz")
    late = plant.delay_s + HALF_HOLD_S
    undelayed = examine(plant.system, system)
    delayed = examine(plant.system, system, late, undelayed)
    return Controller(
        method,
        system,
        zero_order_hold(system, period),
        plant.at,
        plant.wrench,
        undelayed,
        delayed,
        late,
        facts,
        (*warnings, *_about(undelayed, delayed, late)),
    )


def _about(undelayed: Loop, delayed: Loop, late: float) -> list[str]:
    said = []
    if not undelayed.stable:
        return ["the closed loop is unstable: do not run this controller"]
    for name, half in (("position", undelayed.position), ("orientation", undelayed.orientation)):
        if half.bandwidth_rad_s == 0.0:
            said.append(
                f"{name}: |S| is above 0.71 at every rate: this controller corrects nothing"
            )
    if not delayed.stable:
        said.append(
            f"poses are {1e3 * late:.1f} ms old when they are used, the loop bears "
            f"{1e3 * undelayed.delay_margin_s:.1f} ms: it is unstable with this camera; design "
            "the delay in ([camera] in weights.toml)"
        )
    return said
