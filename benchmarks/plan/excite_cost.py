"""Plans for the FIDIM paper's robot: C beside the paper's 5.94, time a start, random plans.

The best plan's C is computed once more from swings of the tests' own Newton-Euler integrator
(maximal coordinates, 0.5 ms Runge-Kutta steps, accelerations by differences), which shares
nothing with the planner but the formulas of W. Run: python benchmarks/plan/excite_cost.py
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from freeswing.cdpr.model.free_motion import free_basis
from freeswing.cdpr.model.internal_dynamics import body_regressor, internal_regressor
from freeswing.cdpr.rotation import angle_rate_matrix, angles_from_matrix, matrix_from_angles
from freeswing.cdpr.rotation import quaternion_from_matrix as to_quaternion
from freeswing.excite.choose_swings import stacked_cost
from freeswing.excite.excite import ExcitationOptions, make_bench, plan_swings
from tests.excite.excitation_bench import bologna_4
from tests.oracle.mechanics.newton_euler import simulate
from tests.oracle.mechanics.world import Body, plain_world

PAPER_COST, PAPER_START_S = 5.94, 36.0
RATE_HZ = 1000.0


def plain_regressor(bench, swing):
    """W' of a swing and its tensions from the independent integrator."""
    robot, inertia = bench.model.robot, bench.inertia
    body = Body(bench.mass_kg, inertia[:3], inertia[3:])
    world = plain_world(robot, body, bench.lengths(swing.release))
    quaternion = to_quaternion(matrix_from_angles(swing.release[3:]))
    motion = simulate(world, swing.release[:3], quaternion, bench.duration_s, rate_hz=RATE_HZ)
    gap = round(RATE_HZ * bench.duration_s / bench.n_samples)
    at = np.arange(bench.n_samples) * gap
    # From rest the motion is even in time: what comes before the release mirrors what follows.
    v = np.concatenate([-motion.twists[2:0:-1], motion.twists])
    slope = (v[at] - 8 * v[at + 1] + 8 * v[at + 3] - v[at + 4]) * RATE_HZ / 12
    v = motion.twists
    rotations = motion.rotations[at]
    angles = angles_from_matrix(rotations)
    rates = np.linalg.solve(angle_rate_matrix(angles), v[at, 3:, None])[..., 0]
    zetas = np.hstack([motion.positions_m[at], angles])
    speeds = np.hstack([v[at, :3], rates])
    basis = free_basis(bench.model, bench.free, zetas, speeds, bench.model.start_values)
    whole = body_regressor(rotations, slope[:, :3], v[at, 3:], slope[:, 3:], robot.gravity_m_s2)
    return internal_regressor(whole, basis.xi_perp).reshape(-1, 10), motion.tensions_n


def main() -> None:
    """Print the table and the JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=2)
    seeds = parser.parse_args().seeds
    rows = []
    for seed in range(seeds):
        options = ExcitationOptions(n_random=2000, seed=seed)
        bench = make_bench(bologna_4(), options)
        begun = time.process_time()
        plan = plan_swings(bench, options, lambda *_: None)
        seconds = time.process_time() - begun
        checked = [plain_regressor(bench, swing) for swing in plan.swings]
        tensions = np.concatenate([pair[1] for pair in checked])
        rows.append(
            {
                "seed": seed,
                "cost_C": plan.cost,
                "best_start_C": plan.start_costs[0],
                "plain_simulation_C": stacked_cost(np.concatenate([pair[0] for pair in checked])),
                "plain_tensions_N": [float(tensions.min()), float(tensions.max())],
                "cpu_s_a_start": seconds / options.n_starts,
                "cpu_s": seconds,
                "random_median_C": float(np.median(plan.random)),
                "random_best_C": float(plan.random.min()),
                "random_share_below_10": float((plan.random < 10).mean()),
            }
        )
    print(f"paper: C {PAPER_COST}, {PAPER_START_S:.0f} s a start")
    for row in rows:
        low, high = row["plain_tensions_N"]
        parts = [
            f"seed {row['seed']}: C {row['cost_C']:.3f}",
            f"before gradients {row['best_start_C']:.3f}",
            f"plain simulation {row['plain_simulation_C']:.3f}",
            f"tensions {low:.1f} to {high:.1f} N",
            f"{row['cpu_s_a_start']:.2f} s a start ({row['cpu_s']:.0f} s in all)",
            f"random plans: median {row['random_median_C']:.2f}, best {row['random_best_C']:.2f}",
            f"{100 * row['random_share_below_10']:.1f} % below 10",
        ]
        print(", ".join(parts))
    print(json.dumps(rows))


if __name__ == "__main__":
    main()
