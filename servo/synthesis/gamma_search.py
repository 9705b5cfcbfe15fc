"""The least gamma by bisection, and a controller a little above it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from freeswing.servo.synthesis.norm import hinf_norm
from freeswing.servo.synthesis.riccati import (
    Normalised,
    Solution,
    StandardProblem,
    central_controller,
    normalise,
    solve_at,
)
from freeswing.servo.synthesis.state_space import StateSpace, close

# At the least gamma the central controller has a pole that runs to -infinity (-1.5e10 from slycot
# on the paper's problem); 2 % above it the fastest pole of that problem is at -162 rad/s.
BACK_OFF = 0.02
DIRECT = "the direct part of the problem"
NEAR = 1.001
TINY = 1e-9  # a least gamma of zero cannot be halved in logarithms
TRUNCATION = 0.2  # kappa 1 of ITP, as its authors take it


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
    top, why = _narrowed(n, *_bracket(n), tolerance)
    return _checked(problem, n, top, back_off, why)


def _bracket(n: Normalised) -> tuple[Solution, Solution]:
    """A gamma without and one with a controller."""
    below = Solution(max(n.least, TINY), np.zeros((0, 0)), np.zeros((0, 0)), DIRECT)
    if n.least > 0.0:
        # Where the direct part is all that limits, nothing but halving would come down to it.
        near = solve_at(n, n.least * NEAR)
        if near.why is None:
            return below, near
        below = near
    gamma = max(2.0 * n.least, 1e-3)
    while True:
        solution = solve_at(n, gamma)
        if solution.why is None:
            return below, solution
        # 1e8: a loop that amplifies so much is no controller, and rounding rules there.
        if gamma > 1e8:
            raise ValueError(
                f"no controller up to gamma {gamma:.3g}: {solution.why}; loosen the weights"
            )
        below, gamma = solution, 4.0 * gamma


def _narrowed(
    n: Normalised, below: Solution, above: Solution, tolerance: float
) -> tuple[float, str]:
    """The least gamma with a controller, and what stops a smaller one.

    The coupling rises smoothly through 1 where it is what stops: the secant finds it in a few
    steps, and no case takes more than one step more than halving (ITP; Oliveira, Takahashi 2020).
    """
    low, high, why = math.log(below.gamma), math.log(above.gamma), str(below.why)
    at_low, at_high = _room(below), _room(above)
    most = math.ceil(math.log2(max((high - low) / tolerance, 1.0))) + 1
    pull = TRUNCATION / (high - low)
    for step in range(most + 1):
        if high - low <= tolerance:
            break
        middle = (low + high) / 2.0
        secant = (high * at_low - low * at_high) / (at_low - at_high)
        side = math.copysign(1.0, middle - secant)
        shift = pull * (high - low) ** 2
        aim = secant + side * shift if shift <= abs(middle - secant) else middle
        reach = tolerance * 2.0 ** (most - step - 1) - (high - low) / 2.0
        aim = aim if abs(aim - middle) <= reach else middle - side * reach
        solution = solve_at(n, math.exp(aim))
        if solution.why is None:
            high, at_high = aim, _room(solution)
        else:
            low, at_low, why = aim, _room(solution), solution.why
    return math.exp(high), why


def _room(solution: Solution) -> float:
    """1 where X and Y do not couple at all, 0 at the least gamma, -1 where one is missing."""
    if math.isinf(solution.coupling):
        return -1.0
    return (1.0 - solution.coupling) / (1.0 + solution.coupling)


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
