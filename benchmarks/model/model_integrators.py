"""The collocation of `simulate` beside CVODES, on the same acceleration.

    python benchmarks/model/model_integrators.py [--json PATH]

Errors are largest distances of P over 10 s from the collocation at a tolerance of 1e-14.
"""

from __future__ import annotations

import sys
from pathlib import Path

import casadi as ca
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from benchmarks.harness import Row, best_of, publish  # noqa: E402
from freeswing.cdpr.model.batch import evaluate  # noqa: E402
from freeswing.cdpr.model.equations import build_model  # noqa: E402
from freeswing.cdpr.simulation.free_swing import simulate  # noqa: E402
from freeswing.cdpr.simulation.sensitivity import linearise  # noqa: E402
from tests.cdpr.model_cases import released, rest_of, robot_named  # noqa: E402

TIMES_S = np.arange(1001) / 100.0
SPAN = (0.0, 10.0)


def cvodes(model, inertia, tolerance: float, parameters: bool):
    """CasADi's CVODES over the sample grid, inertia as parameters."""
    time, state, body = ca.SX.sym("t"), ca.SX.sym("x", 12), ca.SX.sym("p", 9)
    second = model.acceleration(time, state[:6], state[6:], body, [])[0]
    problem = {"t": time, "x": state, "p": body, "ode": ca.vertcat(state[6:], second)}
    options = {"abstol": tolerance, "reltol": tolerance, "max_num_steps": 100_000}
    solver = ca.integrator("swing", "cvodes", problem, 0.0, list(TIMES_S[1:]), options)
    if not parameters:
        return solver
    return solver.factory("slopes", ["x0", "p"], ["xf", "jac:xf:p"])


def figures(model, start, inertia, reference, lengths, name, run) -> list[Row]:
    """Time, error and drift of one integrator."""
    poses = run()
    error = np.linalg.norm(poses[:, :3] - reference[:, :3], axis=1).max()
    drift = np.abs(evaluate(model.lengths, poses, [])[0] - lengths).max()
    return [
        Row(f"{name}: time", best_of(run, 3) * 1e3, "ms"),
        Row(f"{name}: error of P", error * 1e3, "mm"),
        Row(f"{name}: drift of lengths", drift, "m"),
    ]


def main() -> int:
    """Measure and publish."""
    model = build_model(robot_named("bologna-4"))
    inertia = model.robot.inertia
    zeta = released(model, rest_of(model, inertia))
    still, lengths = np.zeros(6), evaluate(model.lengths, zeta, [])[0]
    start = np.concatenate([zeta, still])
    reference = simulate(model, zeta, still, SPAN, inertia, tolerance_m=1e-14).at(TIMES_S)[0]
    rows = []
    for tolerance in (1e-8, 1e-10, 1e-12):

        def collocated(tolerance=tolerance):
            motion = simulate(model, zeta, still, SPAN, inertia, tolerance_m=tolerance)
            return motion.at(TIMES_S)[0]

        name = f"collocation {tolerance:.0e}"
        rows += figures(model, start, inertia, reference, lengths, name, collocated)
    for tolerance in (1e-8, 1e-10, 1e-12):
        solver = cvodes(model, inertia, tolerance, parameters=False)

        def multistep(solver=solver):
            found = np.array(solver(x0=start, p=inertia)["xf"]).T
            return np.vstack([start, found])[:, :6]

        name = f"CVODES {tolerance:.0e}"
        rows += figures(model, start, inertia, reference, lengths, name, multistep)
    slopes = cvodes(model, inertia, 1e-10, parameters=True)
    rows.append(
        Row("CVODES 1e-10: 9 sensitivities", best_of(lambda: slopes(start, inertia), 1) * 1e3, "ms")
    )

    def answered():
        return linearise(simulate(model, zeta, still, SPAN, inertia)).at(TIMES_S)

    answered()
    rows.append(Row("collocation 1e-10: 21 sensitivities", best_of(answered, 3) * 1e3, "ms"))
    return publish("model_integrators", rows)


if __name__ == "__main__":
    raise SystemExit(main())
