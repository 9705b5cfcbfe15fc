"""How fast the model is: start-up, W, free motion, sensitivities, equilibria.

    python benchmarks/model/model_speed.py [--json PATH]

The robot is that of the FIDIM paper; the swing is a release of 0.1 rad about column 1 of Table 2.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from benchmarks.harness import Row, best_of, publish  # noqa: E402
from freeswing.cdpr.model.batch import Bound, evaluate, only  # noqa: E402
from freeswing.cdpr.model.elastic_motion import SPRUNG, elastic_values  # noqa: E402
from freeswing.cdpr.model.equations import build_model  # noqa: E402
from freeswing.cdpr.model.free_motion import assemble, free_basis  # noqa: E402
from freeswing.cdpr.model.internal_dynamics import body_regressor, internal_regressor, twist_of  # noqa: E402
from freeswing.cdpr.model.statics import equilibrium_at_lengths  # noqa: E402
from freeswing.cdpr.rotation import matrix_from_angles  # noqa: E402
from freeswing.cdpr.simulation.free_swing import simulate  # noqa: E402
from freeswing.cdpr.simulation.sensitivity import linearise  # noqa: E402
from tests.cdpr.model_cases import MIDDLE, TABLE_2, released, rest_of, robot_named  # noqa: E402

TIMES_S = np.arange(1001) / 100.0
SAMPLES = 100_000


def start_up() -> list[Row]:
    """A fresh process that imports the model and builds one."""
    code = (
        "import time; t = time.process_time()\n"
        "from freeswing.cdpr.model.equations import build_model\n"
        "from freeswing.cdpr.simulation.free_swing import simulate\n"
        "a = time.process_time() - t; t = time.process_time()\n"
        "from tests.oracle.scenes.robots import declared_robot; r = declared_robot('bologna-4')\n"
        "t = time.process_time(); build_model(r); print(a, time.process_time() - t)"
    )
    found = []
    for _ in range(3):
        text = subprocess.run(
            [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
        )
        found.append([float(number) for number in text.stdout.split()])
    imported, built = np.min(found, axis=0)
    return [Row("import", imported, "s"), Row("build of a model", built, "s", 0.5)]


def regressor(model, free) -> Row:
    """W of many samples from poses, rates and accelerations."""
    rng = np.random.default_rng(0)
    zetas = MIDDLE["bologna-4"] + 0.05 * rng.normal(size=(SAMPLES, 6))
    rates, second = rng.normal(size=(2, SAMPLES, 6))
    none, gravity = np.zeros(0), model.robot.gravity_m_s2

    def work() -> np.ndarray:
        basis = free_basis(model, free, zetas, rates, none)
        turn, turn_rate = evaluate(model.twist_map, zetas, rates)
        twist, twist_rate = twist_of(turn, turn_rate, rates, second)
        whole = body_regressor(
            matrix_from_angles(zetas[:, 3:]),
            twist_rate[:, :3],
            twist[:, 3:],
            twist_rate[:, 3:],
            gravity,
        )
        return internal_regressor(whole, basis.xi_perp)

    return Row(f"W, {SAMPLES} samples", best_of(work, 3), "s", 1.0)


def main() -> int:
    """Measure and publish."""
    model = build_model(robot_named("bologna-4"))
    inertia = np.asarray(model.robot.inertia)
    rest = rest_of(model, inertia)
    zeta = released(model, rest)
    span, still = (0.0, 10.0), np.zeros(6)
    rows = [*start_up(), regressor(model, ("phi", "theta"))]

    def swing():
        motion = simulate(model, zeta, still, span, inertia)
        return motion, motion.at(TIMES_S)

    def answered():
        return linearise(swing()[0]).at(TIMES_S)

    motion, poses = swing()
    answered()
    force = Bound(only(model.acceleration, 0), 1000)
    force.inputs[1][:], force.inputs[3][:] = zeta, inertia
    rows.append(Row("one acceleration", best_of(force.run) * 1e3, "us"))
    rows.append(Row("free motion, 10 s at 100 Hz", best_of(swing, 7), "s", 0.05))
    rows.append(Row("the same with 21 sensitivities", best_of(answered, 7), "s", 0.5))
    others = []
    for lengths in TABLE_2[1:]:
        start = released(model, rest_of(model, inertia, lengths))
        others.append(best_of(lambda s=start: simulate(model, s, still, span, inertia), 3))
    rows.append(Row("free motion, mean of columns 2 to 12", float(np.mean(others)), "s"))
    elastic = build_model(model.robot, SPRUNG)
    values = elastic_values(elastic, 8e-5, evaluate(model.lengths, zeta, [])[0] - 0.0005)
    rows.append(
        Row(
            "free motion on elastic cables",
            best_of(lambda: simulate(elastic, zeta, still, span, inertia, values), 3),
            "s",
        )
    )
    free, lengths = ("phi", "theta"), rest.lengths_m
    path = poses[0][:, 3:5]
    rows.append(
        Row(
            "assembly of 1001 samples",
            best_of(lambda: assemble(model, free, lengths, path, zeta), 3),
            "s",
        )
    )
    middle = MIDDLE["bologna-4"]
    rows.append(
        Row(
            "equilibrium at lengths",
            best_of(lambda: equilibrium_at_lengths(model, lengths, middle, inertia), 5),
            "s",
        )
    )
    rows.append(Row("segments of the swing", len(motion.starts_s), ""))
    return publish("model_speed", rows)


if __name__ == "__main__":
    raise SystemExit(main())
