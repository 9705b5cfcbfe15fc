"""Sessions of the INCA made by the program's own simulator, as files that tests may spoil."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from freeswing.cdpr.driven.behaviour import rest_pose, simulate, turns_at_rest
from freeswing.cdpr.driven.excitation import prbs
from freeswing.cdpr.driven.model import DrivenModel
from freeswing.cdpr.driven.motion import motor_angles
from freeswing.cdpr.driven.record import Instruments, observed
from freeswing.cdpr.driven.slopes import moved
from freeswing.cdpr.driven.statics import CENTRE, static_pose
from freeswing.cdpr.files.drive_csv import write_drive_run, write_static
from freeswing.cdpr.model.batch import evaluate
from tests.cdpr.driven_robots import inca
from tests.places import SAMPLES

STEP_RAD = 0.001534
INSTRUMENTS = Instruments(200.0, 0.0107, 0.001, 0.005, STEP_RAD, 0.005)
STD = np.repeat([0.001, 0.005], 3)

TOML = f"""format = "freeswing-drive/1"
name = "made"
robot = "robot.toml"
sample_rate_hz = 1000
pose_latency_s = 0.0107
encoder_step_rad = {STEP_RAD}
current_std_A = 0.005
position_std_m = 0.001
angle_std_rad = 0.005
encoder_zero = {{ position_m = [0, 0, 0], q = [1, 0, 0, 0] }}
[unknown]
kinematic = ["Lx_m", "Ly_m", "Lz_m", "arm_m", "theta_xy_rad", "theta_xz_rad", "drum_m"]
dynamic = ["mass_kg", "Ixx_kg_m2", "Iyy_kg_m2=Izz_kg_m2", "motor_inertia_kg_m2",
           "viscous_N_m_s", "spring_N_m", "coulomb_N_m"]
[static]
file = "static.csv"
samples = 100
[[runs]]
name = "ident"
role = "identify"
file = "ident.csv"
[[runs]]
name = "check"
role = "validate"
file = "check.csv"
"""


@cache
def _rests() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Currents, poses and angles: none, then 1 A in one motor after another."""
    model, currents = inca(), np.vstack([np.zeros(8), np.eye(8)])
    poses = np.array([static_pose(model, row).pose for row in currents])
    return currents, poses, motor_angles(model, poses, CENTRE, model.declared)


def static_readings(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nine poses at rest as the instruments tell them."""
    generator, (currents, poses, angles) = np.random.default_rng(seed), _rests()
    angles = np.round(angles / STEP_RAD) * STEP_RAD
    return currents, angles, moved(poses, generator.normal(size=(9, 6)) * STD / 10.0)


def recording(seed: int, seconds: float, model: DrivenModel | None = None, theta=None):
    """A run of PRBS from rest."""
    model, generator = inca() if model is None else model, np.random.default_rng(seed)
    still = np.zeros(8)
    state = np.concatenate([rest_pose(model, still, theta), np.zeros(6)])
    references = prbs(round(1000 * seconds) + 1, 8, 1000.0, (0.0, 1.0), 1.0, generator)
    motion = simulate(model, state, references, 1000.0, theta, currents_A=still)
    return observed(motion, CENTRE, INSTRUMENTS, generator)


def write_session(folder: Path, seed: int, seconds: float, robot="robot-initial.toml") -> Path:
    """drive.toml with Table 1's initial robot, an identify and a validate run."""
    (folder / "robot.toml").write_text((SAMPLES / "inca-6d" / robot).read_text())
    for k, name in enumerate(("ident", "check")):
        write_drive_run(folder / f"{name}.csv", recording(seed + k, seconds))
    write_static(folder / "static.csv", *static_readings(seed))
    (folder / "drive.toml").write_text(TOML)
    return folder


def write_flawed(folder: Path, seed: int, seconds: float, flaws: dict[str, float]) -> Path:
    """The true robot declared, but recorded with undeclared effects, values by full name."""
    effects = tuple(dict.fromkeys(name.partition(".")[0] for name in flaws))
    model = inca(effects)
    theta = model.theta(flaws)
    write_session(folder, seed, 0.06, "robot.toml")
    for k, name in enumerate(("ident", "check")):
        write_drive_run(folder / f"{name}.csv", recording(seed + k, seconds, model, theta))
    currents, generator = np.vstack([np.zeros(8), np.eye(8)]), np.random.default_rng(seed)
    poses = np.array([rest_pose(model, row, theta) for row in currents])
    zero = evaluate(model.lengths, CENTRE, theta)[0] / evaluate(model.drums, theta)[0]
    angles = zero - turns_at_rest(model, poses, currents, theta)
    angles = np.round(angles / STEP_RAD) * STEP_RAD
    noise = generator.normal(size=(9, 6)) * STD / 10.0
    write_static(folder / "static.csv", currents, angles, moved(poses, noise))
    return folder
