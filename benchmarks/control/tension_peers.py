"""Tension distribution beside general QP solvers, one run: microseconds a wrench, feasible and not.

    python benchmarks/control/tension_peers.py [ROBOT] [--rows 400]

Each solver gets the same wrenches of the same robot (8 cables, r = 2). Ours is timed inside its own
language (50 calls a clock reading), the peers through the interface that a Python loop would use
with their workspace made before. What is not installed is left out.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable

import numpy as np
from scipy.optimize import linprog

from freeswing.cdpr.driven.statics import holding_wrench
from freeswing.servo.driven_file import read_driven
from freeswing.servo.robot_now import pose7
from freeswing.servo.tensions.loop_kernels import distribute_rows
from freeswing.servo.tensions.methods import KERNELS
from freeswing.servo.tensions.robot_wrenches import demands_at_rest

REPEATS = 50


def main() -> None:
    """Make wrenches, let everyone solve them, print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("robot", nargs="?", default="samples/inca-6d")
    parser.add_argument("--rows", type=int, default=400)
    options = parser.parse_args()
    demands = made(options.robot, options.rows)
    rows = [tuple(getattr(demands, key)[k].copy() for key in KEYS) for k in range(options.rows)]
    feasible = np.array([by_highs(*row) for row in rows])
    print(f"{feasible.sum()} of {len(rows)} wrenches are feasible by HiGHS")
    print(f"{'':22}{'feasible':>20}{'infeasible':>22}{'solved':>9}{'nearest to':>12}")
    print(f"{'':22}{'median':>10}{'p99':>10}{'median':>12}{'p99':>10}")
    nearest = distribute_rows(*[np.array(column) for column in zip(*rows, strict=True)], 0)
    for name, kernel in KERNELS.items():
        report(name, *ours(rows, kernel), feasible, nearest)
    for name, make in PEERS.items():
        try:
            solve = make(*rows[0])
        except ImportError:
            print(f"{name:22} not installed")
            continue
        report(name, *theirs(solve, rows), feasible, nearest)


KEYS = ("A", "b", "offset", "lower", "upper", "wish")


def made(robot: str, count: int) -> object:
    """Poses about the centre; wrenches that hold the platform and more."""
    _, model = read_driven(robot)
    rng = np.random.default_rng(0)
    reach = np.repeat([0.25, 0.1], 3)
    poses = np.array([pose7(rng.uniform(-reach, reach)) for _ in range(count)])
    rest = np.array([holding_wrench(model, pose) for pose in poses])
    more = rng.uniform(-1.0, 1.0, (count, 6)) * np.repeat([6.0, 0.1], 3)
    return demands_at_rest(model, poses, rest + more, of_motors=True)[0]


def by_highs(A, b, offset, lower, upper, wish) -> bool:  # noqa: D103
    bounds = list(zip(lower, upper, strict=True))
    return linprog(np.zeros(len(wish)), A_eq=A, b_eq=b - offset, bounds=bounds).status == 0


def ours(rows: list, kernel: int) -> tuple[np.ndarray, np.ndarray]:
    """Microseconds and currents, NaN where not solved."""
    distribute_rows(*[np.repeat(part[None], 2, 0) for part in rows[0]], kernel)
    times, found = [], []
    for row in rows:
        many = [np.repeat(part[None], REPEATS, 0) for part in row]
        best = np.inf
        for _ in range(3):  # the best of three: another process's turn is not ours
            start = time.perf_counter()
            x, status, _, _ = distribute_rows(*many, kernel)
            best = min(best, time.perf_counter() - start)
        times.append(1e6 * best / REPEATS)
        found.append(x[0] if status[0] == 0 else np.full(x.shape[1], np.nan))
    return np.array(times), np.array(found)


def theirs(solve: Callable, rows: list) -> tuple[np.ndarray, np.ndarray]:
    """The same of a peer."""
    times, found = [], []
    for row in rows:
        best, answer = np.inf, None
        for _ in range(3):
            start = time.perf_counter()
            answer = solve(*row)
            best = min(best, time.perf_counter() - start)
        times.append(1e6 * best)
        found.append(np.full(len(row[5]), np.nan) if answer is None else answer)
    return np.array(times), np.array(found)


def report(name: str, times: np.ndarray, found: np.ndarray, feasible, nearest) -> None:
    """One line of the table."""
    solved = ~np.isnan(found).any(axis=1)
    both = solved & feasible
    gap = np.abs(found[both] - nearest[0][both]).max() if both.any() else np.nan
    good, bad = times[feasible], times[~feasible]
    print(
        f"{name:22}{np.median(good):10.1f}{np.percentile(good, 99):10.1f}"
        f"{np.median(bad):12.1f}{np.percentile(bad, 99):10.1f}"
        f"{both.sum():5d}/{feasible.sum():3d}{gap:12.1e}",
        flush=True,
    )


def _daqp(A, b, offset, lower, upper, wish) -> Callable:
    import daqp

    n = len(wish)
    H, sense = np.eye(n), np.r_[np.zeros(n), np.full(6, 5)].astype(np.int32)

    def solve(A, b, offset, lower, upper, wish):
        right = b - offset
        x, _, flag, _ = daqp.solve(H, -wish, A, np.r_[upper, right], np.r_[lower, right], sense)
        return x if flag == 1 else None

    return solve


def _quadprog(A, b, offset, lower, upper, wish) -> Callable:
    import quadprog

    n = len(wish)
    one = np.eye(n)

    def solve(A, b, offset, lower, upper, wish):
        C = np.hstack([A.T, one, -one])
        try:
            return quadprog.solve_qp(one, wish, C, np.r_[b - offset, lower, -upper], 6)[0]
        except ValueError:
            return None

    return solve


def _piqp(A, b, offset, lower, upper, wish) -> Callable:
    import piqp

    n = len(wish)
    solver = piqp.DenseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = 1e-9
    solver.setup(np.eye(n), -wish, A, b - offset, None, None, None, lower, upper)

    def solve(A, b, offset, lower, upper, wish):
        solver.update(c=-wish, A=A, b=b - offset, x_l=lower, x_u=upper)
        return np.array(solver.result.x) if solver.solve() == piqp.PIQP_SOLVED else None

    return solve


def _proxqp(A, b, offset, lower, upper, wish) -> Callable:
    import proxsuite

    n = len(wish)
    qp = proxsuite.proxqp.dense.QP(n, 6, 0, True)
    qp.settings.eps_abs = 1e-9
    qp.init(np.eye(n), -wish, A, b - offset, None, None, None, lower, upper)
    done = proxsuite.proxqp.QPSolverOutput.PROXQP_SOLVED

    def solve(A, b, offset, lower, upper, wish):
        qp.update(g=-wish, A=A, b=b - offset, l_box=lower, u_box=upper)
        qp.solve()
        return np.array(qp.results.x) if qp.results.info.status == done else None

    return solve


def _clarabel(A, b, offset, lower, upper, wish) -> Callable:
    import clarabel
    from scipy import sparse

    n = len(wish)
    P, one = sparse.eye(n, format="csc"), np.eye(n)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    cones = [clarabel.ZeroConeT(6), clarabel.NonnegativeConeT(2 * n)]

    def solve(A, b, offset, lower, upper, wish):
        G = sparse.csc_matrix(np.vstack([A, one, -one]))
        right = np.r_[b - offset, upper, -lower]
        solution = clarabel.DefaultSolver(P, -wish, G, right, cones, settings).solve()
        return np.array(solution.x) if str(solution.status) == "Solved" else None

    return solve


def _osqp(A, b, offset, lower, upper, wish) -> Callable:
    import osqp
    from scipy import sparse

    n = len(wish)
    one = np.eye(n)

    def solve(A, b, offset, lower, upper, wish):
        solver = osqp.OSQP()
        G = sparse.csc_matrix(np.vstack([A, one]))
        right = b - offset
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            solver.setup(
                sparse.eye(n, format="csc"), -wish, G, np.r_[right, lower], np.r_[right, upper],
                verbose=False, eps_abs=1e-7, eps_rel=1e-7, max_iter=4000,
            )  # fmt: skip
            found = solver.solve()
        return found.x if found.info.status == "solved" else None

    return solve


PEERS = {
    "daqp": _daqp,
    "quadprog": _quadprog,
    "piqp": _piqp,
    "proxqp": _proxqp,
    "clarabel": _clarabel,
    "osqp": _osqp,
}

if __name__ == "__main__":
    main()
