"""Driven robots: speed against real time, sensitivities, and the motion beside MuJoCo's.

    python -m benchmarks.model.driven_motion [--json PATH]

MuJoCo runs as issue 18 defines it: tendons with stiffness, damping, armature and a motor each, RK4
at 0.2 ms, currents among its states, no Coulomb friction; three random binary sequences a band.
"""

from __future__ import annotations

import sys

import numpy as np

from benchmarks.harness import Row, best_of, publish
from freeswing.cdpr.driven.excitation import prbs
from freeswing.cdpr.driven.motion import simulate_driven
from freeswing.cdpr.driven.sensitivity import state_slopes
from freeswing.cdpr.driven.statics import static_pose
from tests.cdpr.driven.test_driven_motion import TABLE_1, apart, random_bits
from tests.cdpr.driven_robots import inca
from tests.oracle.witnesses.mujoco_driven import mujoco_driven

UNKNOWN = (
    *("Lx_m", "Ly_m", "Lz_m", "arm_m", "theta_xy_rad", "theta_xz_rad", "drum_m", "mass_kg"),
    *("Ixx_kg_m2", "Iyy_kg_m2", "motor_inertia_kg_m2", "viscous_N_m_s", "spring_N_m"),
    "coulomb_N_m",
)
SEEDS = (4, 5, 6)


def main() -> int:
    """Measure and publish."""
    return publish("driven_motion", [*_speed(), *_beside_mujoco()])


def _speed() -> list[Row]:
    model, still = inca(), np.zeros(8)
    start = np.concatenate([static_pose(model, still).pose, np.zeros(6)])
    references = prbs(5001, 8, 1000.0, (0.0, 1.0), 1.0, np.random.default_rng(1))

    def run():
        return simulate_driven(model, start, references, 1000.0, currents_A=still)

    motion = run()
    state_slopes(motion, UNKNOWN)
    once = best_of(run)
    slopes = best_of(lambda: state_slopes(motion, UNKNOWN))
    return [
        Row("5 s at 1 kHz, 8 cables, rigid", once, "s", 5.0 / 25.0, f"{5.0 / once:.0f} x real"),
        Row("sensitivities, 14 numbers + start", slopes / once, "x", 12.0, f"{slopes:.3f} s"),
    ]


def _beside_mujoco() -> list[Row]:
    model, rows = inca(), []
    theta = model.theta({"coulomb_N_m": 0.0})
    pose = static_pose(model, np.zeros(8), theta).pose
    state = np.concatenate([pose, np.zeros(6)])
    for rate_hz in (1, 5):
        gaps = []
        for seed in SEEDS:
            references = random_bits(rate_hz, 3.0, seed)
            found = simulate_driven(model, state, references, 1000.0, theta)
            expected = mujoco_driven(model.robot, TABLE_1, pose, references, 1000.0, references[0])
            travel = np.ptp(expected[:, :3], axis=0).max()
            gaps.append((*apart(found.poses, expected), travel))
        metres, radians, travel = np.max(gaps, axis=0)
        note = f"travel to {travel:.2f} m"
        rows.append(Row(f"beside MuJoCo, {rate_hz} Hz", 1e3 * metres, "mm", 1e-3, note))
        rows.append(Row(f"beside MuJoCo, {rate_hz} Hz", 1e3 * radians, "mrad", 1e-2))
    return rows


if __name__ == "__main__":
    sys.exit(main())
