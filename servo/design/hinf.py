"""The H-infinity controller of the paper's section 5.1, with its delay designed in or not."""

from __future__ import annotations

import numpy as np

from freeswing.servo.design.controller import HALF_HOLD_S, Controller, finished
from freeswing.servo.design.plant import PADE_ORDER, Plant, state_names
from freeswing.servo.synthesis.assumptions import failures
from freeswing.servo.synthesis.discretise import pade
from freeswing.servo.synthesis.four_block import weighted
from freeswing.servo.synthesis.gamma_search import synthesise
from freeswing.servo.synthesis.norm import hinf_norm
from freeswing.servo.synthesis.reduction import truncate
from freeswing.servo.synthesis.riccati import StandardProblem
from freeswing.servo.synthesis.state_space import StateSpace, close, series
from freeswing.servo.synthesis.weights import Filter, Part, Weights

# Where no controller at all comes within this of the least gamma, the weights ask for nothing.
NOTHING = 1.02


class AssumptionError(ValueError):
    """The weights leave no standard problem; one sentence for each assumption that fails."""


def design_hinf(
    plant: Plant,
    weights: Weights,
    *,
    with_delay: bool = False,
    order: int | None = None,
) -> Controller:
    """Synthesise, reduce if asked, sample and examine.

    Args:
        plant: the robot about a pose.
        weights: W1, W2, W3.
        with_delay: put the plant's delay into the design.
        order: balanced truncation to so many states; None keeps all.

    Raises:
        AssumptionError: where an assumption fails, each named.
        ValueError: where no gamma is feasible or rounding spoils the solution.
    """
    system = plant.system
    if with_delay:
        system = series(system, pade(plant.delay_s + HALF_HOLD_S, PADE_ORDER, 6))
    problem = weighted(system, weights)
    broken = failures(problem, _names(weights, with_delay))
    if broken:
        raise AssumptionError("; ".join(broken))
    found = synthesise(problem)
    facts = {
        "gamma": found.gamma_least,
        "gamma_backed_off": found.gamma,
        "norm": found.norm,
        "norm_rate_rad_s": found.norm_rate_rad_s,
    }
    warnings = list(_idle(problem, weights, found.gamma_least))
    controller: StateSpace = found.controller
    if order is not None:
        small = truncate(controller, order)
        loop = close(problem.plant, small.system)
        facts["reduction_bound"] = small.bound
        facts["norm"] = hinf_norm(loop).value if loop.is_stable() else np.inf
        controller = small.system
        if facts["norm"] > 1.05 * found.gamma:
            warnings.append(
                f"{order} states are too few: the weighted loop's norm is {facts['norm']:.3g} "
                f"instead of {found.norm:.3g}"
            )
    return finished("hinf", plant, controller, facts, tuple(warnings))


def _idle(problem: StandardProblem, weights: Weights, gamma: float) -> list[str]:
    """Whether the templates are met by no controller at all (as those of the printed eq. (24))."""
    n_y, n_u = problem.n_measured, problem.n_controls
    plant = problem.plant
    open_loop = StateSpace(
        plant.A,
        plant.B[:, : plant.n_inputs - n_u],
        plant.C[: plant.n_outputs - n_y],
        plant.D[: plant.n_outputs - n_y, : plant.n_inputs - n_u],
    )
    if not open_loop.is_stable():
        return []
    norm = hinf_norm(open_loop)
    if norm.value > NOTHING * gamma:
        return []
    allowed = [_template(part) for part in (weights.position, weights.orientation)]
    return [
        f"these weights ask for nothing: without any controller the weighted norm is "
        f"{norm.value:.3f}, the least gamma {gamma:.3f}; the disturbance template is met by the "
        f"open loop: {allowed[0]:.4g} m/N and {allowed[1]:.4g} rad/(N m) at 0 rad/s are allowed; "
        "raise w3 at low rates (its pole is likely meant at 1e-4, not 1e4)"
    ]


def _template(part: Part) -> float:
    """1 / |w1 w3| at rest."""
    zero = np.zeros(1)
    return float(1.0 / (part.w1.at(zero) * part.w3.at(zero))[0])


def _names(weights: Weights, with_delay: bool) -> list[str]:
    halves = (("position", weights.position), ("orientation", weights.orientation))

    def states(key: str) -> list[str]:
        named = []
        for half, part in halves:
            filter_: Filter = getattr(part, key)
            named += [f"{key} of {half}"] * (3 * filter_.order)
        return named

    plant = state_names() + ["the camera's delay"] * (6 * PADE_ORDER * with_delay)
    return states("w3") + plant + states("w1") + states("w2")
