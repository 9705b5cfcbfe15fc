"""The least gamma by bisection, and a controller a little above it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from freeswing.servo.synthesis.norm import hinf_norm
from freeswing.servo.synthesis.riccati import (
    Normalised,
    Solution,
    StandardProblem,
    central_controller,
    least_gamma,
    normalise,
    solve_at,
)
from freeswing.servo.synthesis.state_space import StateSpace, close

# At the least gamma the central controller has a pole that runs to -infinity (-1.5e10 from slycot
# on the paper's problem); 2 % above it the fastest pole of that problem is at -162 rad/s.
BACK_OFF = 0.02


@dataclass(frozen=True, slots=True)
class Synthesis:
    """A controller, the gamma it was asked for and the norm that its closed loop really has."""

    controller: StateSpace
    gamma_least: float
    gamma: float
    norm: float
    norm_rate_rad_s: float
    stopped_by: str


def synthesise(
    problem: StandardProblem, *, back_off: float = BACK_OFF, tolerance: float = 1e-4
) -> Synthesis:
    """The central controller at (1 + back_off) times the least gamma.

    Args:
        problem: one whose assumptions have been tested (`assumptions`).
        back_off: share of the least gamma to stay away from it.
        tolerance: of the least gamma, relative.

    Raises:
        ValueError: where no gamma up to 1e8 is feasible, or where the closed loop's norm, computed
            afresh, is not what the equations promise.
    """
    n = normalise(problem)
    bottom, top, why = _bracket(n)
    while top - bottom > tolerance * top:
        middle = (
            math.sqrt(bottom * top) if bottom > 0.0 and top > 2 * bottom else (bottom + top) / 2
        )
        solution = solve_at(n, middle)
        if solution.why is None:
            top = middle
        else:
            bottom, why = middle, solution.why
    return _checked(problem, n, top, back_off, why)


def _bracket(n: Normalised) -> tuple[float, float, str]:
    bottom = least_gamma(n)
    why = "the direct part of the problem"
    top = max(2.0 * bottom, 1e-3)
    while True:
        solution = solve_at(n, top)
        if solution.why is None:
            return bottom, top, why
        bottom, why = top, solution.why
        # 1e8: a loop that amplifies so much is no controller, and rounding rules there.
        if top > 1e8:
            raise ValueError(
                f"no controller up to gamma {top:.3g}: {solution.why}; loosen the weights"
            )
        top *= 4.0


def _checked(
    problem: StandardProblem, n: Normalised, least: float, back_off: float, why: str
) -> Synthesis:
    gamma = least * (1.0 + back_off)
    solution: Solution = solve_at(n, gamma)
    if solution.why is not None:
        raise ValueError(f"gamma {gamma:.6g} is not feasible though {least:.6g} is: {solution.why}")
    controller = central_controller(n, solution)
    loop = close(problem.plant, controller)
    norm = hinf_norm(loop)
    # 1e-3: a norm above the promise by more says that rounding has eaten the Riccati solutions.
    if norm.value > gamma * 1.001:
        raise ValueError(
            f"the closed loop's norm is {norm.value:.6g} where gamma {gamma:.6g} was promised: the "
            "weights are too ill-conditioned for double precision; bring their poles and zeros "
            "closer together (1e-2 rad/s serves as an integrator as well as 1e-4)"
        )
    return Synthesis(controller, least, gamma, norm.value, norm.rate_rad_s, why)
