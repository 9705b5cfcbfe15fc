"""Writes the session of samples/inca-6d from a seed: `python -m tests.samples.make_driven`.

The motions come from the paper's equations as tests/oracle writes them down, never from the
product's model.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

from tests.oracle.mechanics.world import Array
from tests.oracle.witnesses.driven_plant import Plant
from tests.places import SAMPLES

SHAPE = {
    "Lx_m": 2.50,
    "Ly_m": 2.75,
    "Lz_m": 3.05,
    "arm_m": 0.138,
    "theta_xy_rad": 1.0995574287564276,
    "theta_xz_rad": 0.37699111843077515,
    "drum_m": 0.0175,
}
DYNAMIC = {
    "mass_kg": 0.289,
    "Ixx_kg_m2": 1.49e-4,
    "Iyy_kg_m2": 2.07e-4,
    "motor_inertia_kg_m2": 3.88e-5,
    "viscous_N_m_s": 6.68e-5,
    "spring_N_m": 14.4,
    "coulomb_N_m": 4.4e-3,
}
RUBBING, ADDED_N_M = 5, 2.4e-3  # a motor, and by how much more its bearing rubs
RATE_HZ, POSE_RATE_HZ, LATENCY_S, STEP_RAD, CURRENT_A = 500.0, 100.0, 0.0107, 0.001534, 0.005
STD = np.repeat([1e-3, 5e-3], 3)
SEED = 612

TOML = f"""format = "freeswing-drive/1"
name = "inca-6d"
robot = "robot-initial.toml"
sample_rate_hz = {RATE_HZ:g}
pose_latency_s = {LATENCY_S}
encoder_step_rad = {STEP_RAD}
current_std_A = {CURRENT_A}
position_std_m = {STD[0]:g}
angle_std_rad = {STD[-1]:g}
encoder_zero = {{ position_m = [0, 0, 0], q = [1, 0, 0, 0] }}

[unknown]
kinematic = ["Lx_m", "Ly_m", "Lz_m", "arm_m", "theta_xy_rad", "theta_xz_rad", "drum_m"]
dynamic = ["mass_kg", "Ixx_kg_m2", "Iyy_kg_m2=Izz_kg_m2", "motor_inertia_kg_m2",
           "viscous_N_m_s", "spring_N_m", "coulomb_N_m"]

[static]
file = "static.csv"
samples = 100
"""


@dataclass(frozen=True, slots=True)
class Recorded:
    """A run to make: its name, its role, its length and its references at a time."""

    name: str
    role: str
    seconds: float
    band_hz: float


RUNS = (Recorded("ident", "identify", 4.0, 1.0), Recorded("val_b", "validate", 2.5, 2.0))
RAMP_S, RAMP_A_S = 0.3, 1.0


def main() -> None:
    """Make the session anew; the same seed gives the same files."""
    folder, plant, generator = SAMPLES / "inca-6d", robot(), np.random.default_rng(SEED)
    (folder / "runs").mkdir(exist_ok=True)
    (folder / "truth").mkdir(exist_ok=True)
    text = TOML
    for run in RUNS:
        hold = round(RATE_HZ / (2.0 * run.band_hz))
        count = round(run.seconds * RATE_HZ) + 1
        bits = generator.integers(0, 2, (-(-count // hold), 8))
        _record(folder, plant, run.name, np.repeat(bits, hold, axis=0)[:count] * 1.0, generator)  # pyright: ignore[reportArgumentType]
        text += _table(run.name, run.role)
    for motor in (1, RUBBING):
        references = np.zeros((round(RAMP_S * RATE_HZ) + 1, 8))
        references[:, motor - 1] = RAMP_A_S * np.arange(len(references)) / RATE_HZ
        _record(folder, plant, f"ramp_{motor}", references, generator)
        text += _table(f"ramp_{motor}", "validate")
    write_static_poses(folder / "static.csv", plant, generator)
    (folder / "drive.toml").write_text(text)
    truth = {
        "seed": SEED,
        "parameters": SHAPE | DYNAMIC,
        "effects": [{"effect": "coulomb_friction", "part": str(RUBBING), "added": ADDED_N_M}],
    }
    (folder / "truth" / "truth.json").write_text(json.dumps(truth, indent=1) + "\n")


def robot() -> Plant:
    """The robot that was recorded."""
    corners = np.array(
        [[x, y, z] for z in (1, -1) for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1))], float
    )
    size = np.array([SHAPE["Lx_m"], SHAPE["Ly_m"], SHAPE["Lz_m"]])
    xy, xz = SHAPE["theta_xy_rad"], SHAPE["theta_xz_rad"]
    in_xy = np.array([np.cos(xy), np.sin(xy), 0.0])
    in_xz = np.array([np.cos(xz), 0.0, np.sin(xz)])
    arms = [corner * (in_xy if corner.prod() > 0 else in_xz) for corner in corners]
    ones = np.ones(8)
    rubs = DYNAMIC["coulomb_N_m"] * ones
    rubs[RUBBING - 1] += ADDED_N_M
    return Plant(
        outputs=corners * size / 2.0,
        arms=SHAPE["arm_m"] * np.array(arms),
        mass=DYNAMIC["mass_kg"],
        inertia=np.array([DYNAMIC["Ixx_kg_m2"], DYNAMIC["Iyy_kg_m2"], DYNAMIC["Iyy_kg_m2"]]),
        drum=SHAPE["drum_m"] * ones,
        spring=DYNAMIC["spring_N_m"] * ones,
        motor=DYNAMIC["motor_inertia_kg_m2"] * ones,
        viscous=DYNAMIC["viscous_N_m_s"] * ones,
        coulomb=rubs,
        torque=0.0603 * ones,
        lag_s=0.0013,
    )


def rest(plant: Plant, currents: Array) -> Array:
    """The pose at rest under held currents, (6,)."""
    hanging = np.array([0.0, 0.0, -0.2, 0.0, 0.0, 0.0])
    return fsolve(lambda x: plant.second_rates(x, np.zeros(6), currents), hanging, xtol=1e-12)  # pyright: ignore[reportReturnType]


def _angles(plant: Plant, poses: Array) -> Array:
    """Encoder readings, zero at the centre, (n_t, 8)."""
    zero = plant.lines(np.zeros(6))[0]
    turned = (zero - np.array([plant.lines(x)[0] for x in poses])) / plant.drum
    return np.round(turned / STEP_RAD) * STEP_RAD


def _measured(plant: Plant, poses: Array, std: Array, generator: np.random.Generator) -> Array:
    """Positions and quaternions with noise, (n, 7)."""
    exact = np.array([plant.quaternion(x) for x in poses])
    noise = generator.normal(size=(len(poses), 6)) * std
    true = Rotation.from_quat(exact, scalar_first=True)
    turned = true * Rotation.from_rotvec(noise[:, 3:])
    return np.hstack([poses[:, :3] + noise[:, :3], turned.as_quat(canonical=True)[:, [3, 0, 1, 2]]])


def _record(
    folder: Path, plant: Plant, name: str, references: Array, generator: np.random.Generator
) -> None:
    """One run from rest without current."""
    still = np.zeros(8)
    poses = plant.motion(rest(plant, still), references, RATE_HZ, still)
    times = np.arange(len(poses)) / RATE_HZ
    currents, flows = np.empty_like(references), still
    left = np.exp(-1.0 / (RATE_HZ * plant.lag_s))
    for k, asked in enumerate(references):
        currents[k] = flows
        flows = asked + (flows - asked) * left
    currents += CURRENT_A * generator.normal(size=currents.shape)
    late = CubicSpline(times, poses)(np.maximum(times - LATENCY_S, 0.0))
    seen = _measured(plant, late, STD, generator)
    every = round(RATE_HZ / POSE_RATE_HZ)
    names = [*_names("I", "A"), *_names("Iref", "A"), *_names("theta", "rad")]
    rows = [",".join(["t_s", *names, POSE])]
    angles = _angles(plant, poses)
    for k, time in enumerate(times):
        cells = [f"{time:.3f}", *(f"{v:.4f}" for v in currents[k])]
        cells += [*(f"{v:g}" for v in references[k]), *(f"{v:.6f}" for v in angles[k])]
        cells += [f"{v:.5f}" for v in seen[k]] if k % every == 0 else [""] * 7
        rows.append(",".join(cells))
    (folder / "runs" / f"{name}.csv").write_text("\n".join(rows) + "\n")


POSE = "x_m,y_m,z_m,qw,qx,qy,qz"


def _names(what: str, unit: str) -> list[str]:
    return [f"{what}{k}_{unit}" for k in range(1, 9)]


def write_static_poses(path: Path, plant: Plant, generator: np.random.Generator) -> None:
    """Nine poses at rest: without current, and with 1 A in one motor after another."""
    currents = np.vstack([np.zeros(8), np.eye(8)])
    poses = np.array([rest(plant, row) for row in currents])
    seen = _measured(plant, poses, STD / 10.0, generator)
    rows = [",".join([*_names("I", "A"), *_names("theta", "rad"), POSE])]
    for row in np.hstack([currents, _angles(plant, poses), seen]):
        rows.append(",".join(f"{v:.6g}" for v in row))
    path.write_text("\n".join(rows) + "\n")


def _table(name: str, role: str) -> str:
    return f'\n[[runs]]\nname = "{name}"\nrole = "{role}"\nfile = "runs/{name}.csv"\n'


if __name__ == "__main__":
    main()
