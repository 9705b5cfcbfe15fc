"""The driven robot that a command names."""

from __future__ import annotations

from pathlib import Path

from freeswing.cdpr.driven.model import DrivenModel, build_driven
from freeswing.cdpr.files.problems import InputError
from freeswing.cdpr.files.robot_file import read_robot, robot_path


def read_driven(path: Path | str) -> tuple[Path, DrivenModel]:
    """The file (ROBOT may be its folder) and the model in it.

    Raises:
        InputError: unreadable, or not a driven robot of six cables and more.
    """
    path = robot_path(path)
    robot = read_robot(path)
    try:
        return path, build_driven(robot)
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: {error}") from error
