"""A small session on disk that every command can read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.files.robot_file import write_robot
from freeswing.cdpr.files.trajectory_files import write_csv
from freeswing.cdpr.measured.trajectory import Trajectory
from tests.oracle.scenes.robots import declared_robot

SESSION = """format = "freeswing-session/1"
name = "two swings"
robot = "robot.toml"
frame_rate_hz = 100.0

[[runs]]
name = "swing-01"
role = "identify"
window_s = [0.0, 6.0]
trajectory = "runs/swing-01.csv"

[[runs]]
name = "check-01"
role = "validate"
window_s = [0.0, 6.0]
trajectory = "runs/check-01.csv"
"""


@pytest.fixture
def session(tmp_path: Path) -> Path:
    """A folder with a robot and two runs whose samples are smooth but obey no law."""
    folder = tmp_path / "session"
    (folder / "runs").mkdir(parents=True)
    (folder / "session.toml").write_text(SESSION, encoding="utf-8")
    write_robot(folder / "robot.toml", declared_robot("bologna-4"))
    times = np.arange(0.0, 6.005, 0.01)
    for name, phase in (("swing-01", 0.0), ("check-01", 1.0)):
        values = np.zeros((len(times), 6))
        values[:, 0] = 1.2 + 1e-3 * np.sin(4.0 * times + phase)
        values[:, 1] = -0.2 + 1e-3 * np.cos(3.0 * times + phase)
        values[:, 2] = -0.9
        motion = Trajectory(times, ("x", "y", "z", "phi", "theta", "chi"), values)
        write_csv(folder / "runs" / f"{name}.csv", motion)
    return folder
