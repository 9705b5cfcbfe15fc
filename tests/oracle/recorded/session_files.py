"""Writes a session folder in the documented formats; plain text, independent of the product."""

from __future__ import annotations

import json
from dataclasses import asdict, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from freeswing.cdpr.robot import Robot
from tests.oracle.mechanics.world import Array

POSE_HEADER = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")
POSE_STD_HEADER = ("std_x_m", "std_y_m", "std_z_m", "std_rx_rad", "std_ry_rad", "std_rz_rad")


def write_robot(path: Path, robot: Robot) -> None:
    """robot.toml as declared."""
    platform = robot.platform
    lines = [
        'format = "freeswing-robot/1"',
        f'name = "{robot.name}"',
        f"gravity_m_s2 = {_list(robot.gravity_m_s2)}",
        f"free_coordinates = {json.dumps(list(robot.free_coordinates or ()))}",
        "",
        "[platform]",
        f"mass_kg = {platform.mass_kg}",
        f"com_m = {_list(platform.com_m)}",
        f"specific_inertia_m2 = {_list(platform.specific_inertia_m2)}",
    ]
    for cable in robot.cables:
        lines += [
            "",
            "[[cables]]",
            f'name = "{cable.name}"',
            f"entry_m = {_list(cable.entry_m)}",
            f"pulley_radius_m = {cable.pulley_radius_m}",
            f"attachment_m = {_list(cable.attachment_m)}",
            f"swivel_x = {_list(cable.swivel_x)}",
            f"swivel_y = {_list(cable.swivel_y)}",
            f"swivel_z = {_list(cable.swivel_z)}",
        ]
    path.write_text("\n".join([*lines, ""]))


def write_target(path: Path) -> None:
    """target.toml with the marker at P alone."""
    lines = ['format = "freeswing-target/1"', "", "[[markers]]", 'name = "P"']
    lines += ["position_m = [0.0, 0.0, 0.0]", "diameter_m = 0.012", ""]
    path.write_text("\n".join(lines))


def write_session(path: Path, name: str, rate_hz: float, runs: list[dict[str, Any]]) -> None:
    """session.toml; each run has name, role, told lengths, their std, window_s or None."""
    lines = ['format = "freeswing-session/1"', f'name = "{name}"', 'robot = "robot.toml"']
    lines += ['target = "target.toml"', f"frame_rate_hz = {rate_hz}"]
    for run in runs:
        lines += ["", "[[runs]]", f'name = "{run["name"]}"', f'role = "{run["role"]}"']
        if run["lengths_m"] is not None:
            lines.append(f"cable_lengths_m = {_list(run['lengths_m'])}")
            lines.append(f"cable_lengths_std_m = {run['lengths_std_m']}")
        if run["window_s"] is not None:
            lines.append(f"window_s = {_list(run['window_s'])}")
        lines.append(f'trajectory = "runs/{run["name"]}.csv"')
    path.write_text("\n".join([*lines, ""]))


def write_samples(path: Path, header: tuple[str, ...], columns: Array) -> None:
    """A trajectory CSV, (n_t, 1 + columns) with time first; NaN becomes an empty cell."""
    cells = (",".join("" if v != v else f"{v:.9g}" for v in row) for row in columns.tolist())
    path.write_text("\n".join([",".join(("t_s", *header)), *cells, ""]))


def write_truth(path: Path, truth: dict[str, Any]) -> None:
    """truth.json: never read by the product."""
    path.write_text(json.dumps(truth, default=_plain, indent=1) + "\n")


def _plain(value: object) -> object:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if is_dataclass(value) and not isinstance(value, type):
        return asdict(value)
    raise TypeError(f"{type(value)} does not go into JSON")


def _list(values: object) -> str:
    return "[" + ", ".join(repr(float(v) + 0.0) for v in np.ravel(np.asarray(values))) + "]"
