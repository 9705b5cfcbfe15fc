"""Find where the robot stands when it is switched on, from incremental readings."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from freeswing.console import Console


def add_arguments(parser: ArgumentParser) -> None:
    """homing.toml."""
    parser.add_argument("homing", metavar="HOMING", help="homing.toml or its folder")


def run(options: Namespace, console: Console) -> None:
    """Solve the start pose and say where it is."""
    from calib.start_pose import home

    path = Path(options.homing)
    document = home(path, console.progress)
    pose, std = document["start_pose"], document["start_pose_std"]
    for key, unit, scale in (("position_m", "mm", 1e3), ("angles_rad", "mrad", 1e3)):
        values = ", ".join(f"{scale * value:.3f}" for value in pose[key])
        spread = ", ".join(f"{scale * value:.3f}" for value in std[key])
        console.say(f"{key.partition('_')[0]}: {values} {unit} (std {spread})")
    folder = path if path.is_dir() else path.parent
    result = folder / "results" / "homing.json"
    console.say(str(result))
    console.show_file(result)
