"""Least gammas beside slycot's on random standard problems and the paper's own: values and time.

    python benchmarks/control/synthesis_peers.py [--problems 50]

A gamma of ours counts only where the closed loop's norm, taken afresh, confirms it; a gamma of
slycot's that is larger than a confirmed one is slycot's bisection stopping early.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import slycot

from freeswing.cdpr.driven.model import build_driven
from freeswing.cdpr.files.robot_file import read_robot
from freeswing.servo.design.plant import plant_at
from freeswing.servo.files.weights_file import read_weights
from freeswing.servo.synthesis.four_block import weighted
from freeswing.servo.synthesis.gamma_search import synthesise
from freeswing.servo.synthesis.riccati import StandardProblem
from freeswing.servo.synthesis.state_space import StateSpace

SAMPLE = "samples/inca-6d"


def main() -> None:
    """Both solvers on every problem."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--problems", type=int, default=50)
    count = parser.parse_args().problems
    spent = np.zeros(2)
    same = 0
    for seed in range(count):
        ours, theirs, times, why = both(random_problem(seed))
        spent += times
        agree = abs(ours / theirs - 1.0) < 1e-3
        same += agree
        if not agree:
            print(f"problem {seed}: ours {ours:.6g}, slycot {theirs:.6g} {why}", flush=True)
    print(f"random: {same} of {count} agree to 1e-3; processor time {spent[0]:.2f} s against "
          f"{spent[1]:.2f} s, a ratio of 1/{spent[1] / spent[0]:.1f}")  # fmt: skip
    plant = plant_at(build_driven(read_robot(f"{SAMPLE}/robot.toml"))).system
    for name in ("weights-printed", "weights"):
        problem = weighted(plant, read_weights(f"{SAMPLE}/{name}.toml").weights)
        ours, theirs, times, _ = both(problem)
        print(f"{name}: ours {ours:.5f} in {times[0]:.2f} s, slycot {theirs:.5f} in "
              f"{times[1]:.2f} s (1/{times[1] / times[0]:.1f})")  # fmt: skip


def both(problem: StandardProblem) -> tuple[float, float, np.ndarray, str]:
    """Gammas, processor seconds, what was said."""
    said = []
    start = time.process_time()
    try:
        ours = synthesise(problem, tolerance=1e-5).gamma_least
    except ValueError as error:
        ours = np.nan
        said.append(f"(ours: {error})")
    middle = time.process_time()
    plant = problem.plant
    matrices = [getattr(plant, key).copy() for key in "ABCD"]
    top = 2.0 * ours if ours == ours else 1e4
    try:
        theirs = slycot.sb10ad(
            plant.order, plant.n_inputs, plant.n_outputs, problem.n_controls, problem.n_measured,
            top, *matrices, job=1, gtol=1e-5,
        )[0]  # fmt: skip
    except Exception as error:  # noqa: BLE001
        theirs = np.nan
        said.append(f"(slycot: {str(error).strip()[:80]})")
    times = np.array([middle - start, time.process_time() - middle])
    return ours, theirs, times, " ".join(said)


def random_problem(seed: int) -> StandardProblem:
    """2 to 12 states, square or not, with all of D11, D12, D21, D22."""
    rng = np.random.default_rng(1000 + seed)
    n, n_u, n_y = int(rng.integers(2, 13)), int(rng.integers(1, 4)), int(rng.integers(1, 4))
    n_w, n_z = n_y + int(rng.integers(0, 4)), n_u + int(rng.integers(0, 4))
    sizes = ((n, n), (n, n_w + n_u), (n_z + n_y, n), (n_z + n_y, n_w + n_u))
    A, B, C, D = (rng.standard_normal(size) for size in sizes)
    return StandardProblem(StateSpace(A, B, C, D), n_y, n_u)


if __name__ == "__main__":
    main()
