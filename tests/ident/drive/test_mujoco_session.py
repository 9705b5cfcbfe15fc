"""A session that MuJoCo moved, through the command line: another engine, the same numbers."""

import json

import numpy as np
import pytest

from freeswing.cdpr.driven.record import DriveRecord
from freeswing.cdpr.driven.slopes import moved
from freeswing.cdpr.files.drive_csv import write_drive_run
from freeswing.main import main
from tests.cdpr.driven_robots import inca
from tests.ident.drive.made_sessions import STD, STEP_RAD, TOML
from tests.oracle.witnesses.mujoco_driven import DrivenBody, mujoco_driven
from tests.places import SAMPLES
from tests.samples import make_driven

LATE_ROWS, EVERY = 11, 5  # of the poses: 11 ms, and one in five rows


def body():
    """The sample's robot without dry friction, as MuJoCo takes it."""
    plant = make_driven.robot()
    return DrivenBody(
        plant.mass,
        np.zeros(3),
        np.diag(plant.inertia),
        plant.spring,
        np.full(8, 0.006),
        plant.drum,
        plant.motor,
        plant.viscous,
        plant.torque,
        plant.lag_s,
    )


def recorded(path, generator, seconds):
    """One run of PRBS at 1 kHz."""
    plant = make_driven.robot()
    count = round(1000 * seconds) + 1
    references = np.repeat(generator.integers(0, 2, (count // 500 + 1, 8)), 500, axis=0)[:count]
    start = np.concatenate([make_driven.rest(plant, np.zeros(8))[:3], [1.0, 0.0, 0.0, 0.0]])
    poses = mujoco_driven(inca().robot, body(), start, references, 1000.0, np.zeros(8))
    w, x, y, z = poses[:, 3:].T
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    ends = poses[:, None, :3] + np.einsum("ijt,kj->tki", turn, plant.arms)
    lengths = np.linalg.norm(ends - plant.outputs, axis=2)
    angles = (plant.lines(np.zeros(6))[0] - lengths) / plant.drum
    angles = np.round(angles / STEP_RAD) * STEP_RAD
    seen = np.full_like(poses, np.nan)
    rows = np.arange(0, count, EVERY)
    late = poses[np.maximum(rows - LATE_ROWS, 0)]
    seen[rows] = moved(late, generator.normal(size=(len(rows), 6)) * STD)
    flows, currents = np.zeros(8), np.empty((count, 8))
    for k, asked in enumerate(references):
        currents[k] = flows
        flows = asked + (flows - asked) * np.exp(-1e-3 / plant.lag_s)
    currents += 0.005 * generator.normal(size=currents.shape)
    record = DriveRecord(np.arange(count) * 1e-3, currents, references * 1.0, angles, seen)
    write_drive_run(path, record)


@pytest.mark.slow
def test_numbers_come_back_from_a_session_of_mujoco(tmp_path):
    """From Table 1's initial robot; every number within four of its deviations."""
    generator = np.random.default_rng(915)
    for name, seconds in (("ident", 2.0), ("check", 1.5)):
        recorded(tmp_path / f"{name}.csv", generator, seconds)
    make_driven.write_static_poses(tmp_path / "static.csv", make_driven.robot(), generator)
    text = (SAMPLES / "inca-6d" / "robot-initial.toml").read_text()
    (tmp_path / "robot.toml").write_text(text.replace("coulomb_N_m = 1.8e-3", "coulomb_N_m = 0.0"))
    late = TOML.replace("pose_latency_s = 0.0107", f"pose_latency_s = {1e-3 * LATE_ROWS}")
    (tmp_path / "drive.toml").write_text(late.replace(', "coulomb_N_m"]', "]"))
    assert main(["drive", str(tmp_path), "--quiet"]) == 0
    document = json.loads((tmp_path / "results" / "drive.json").read_text())
    truth = make_driven.SHAPE | make_driven.DYNAMIC
    for entry in document["estimates"]["joint"]["parameters"]:
        error = entry["value"] - truth[entry["name"]]
        assert abs(error) < 4.0 * entry["std"], entry
        assert entry["std"] < 5e-3 * entry["value"], entry
    assert max(document["residual"]["times_noise"].values()) < 1.2
    held_out = [fit for fit in document["fit_percent"] if fit["role"] == "validate"]
    assert min(held_out[0]["matlab"]) > 99.9, held_out
