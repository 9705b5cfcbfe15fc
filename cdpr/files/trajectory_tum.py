"""Trajectories in the TUM form: `t x y z qx qy qz qw`, separated by spaces, # for comments."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from freeswing.cdpr.files.documents import replace_file
from freeswing.cdpr.files.number_table import (
    check_times,
    known_poses,
    read_lines,
    read_numbers,
)
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.rotation import matrix_from_quaternion, quaternion_from_matrix

TUM_COLUMNS = ("t", "x", "y", "z", "qx", "qy", "qz", "qw")


def read_tum(path: Path | str) -> Trajectory:
    """Read platform poses in the base frame; `nan` is a missing number.

    Raises:
        InputError: naming file, line, column and remedy.
    """
    lines = enumerate(read_lines(path), start=1)
    rows = ((number, line) for number, line in lines if not line.lstrip().startswith("#"))
    table = read_numbers(path, rows, None, TUM_COLUMNS)
    check_times(path, table, 0, "t")
    position, quaternion, notes = known_poses(
        path, table, table.values[:, 1:4], table.values[:, [7, 4, 5, 6]], "qx qy qz qw"
    )
    poses = Trajectory.from_poses(
        table.values[:, 0],
        position,
        matrix_from_quaternion(quaternion),
        provenance=f"{Path(path).name}: measured poses",
    )
    return replace(poses, notes=notes)


def write_tum(path: Path | str, trajectory: Trajectory) -> None:
    """Write a pose trajectory; missing samples are left out, as readers of the form expect.

    Raises:
        ValueError: when the trajectory does not hold poses.
    """
    known = trajectory.take(trajectory.is_known)
    quaternion = quaternion_from_matrix(known.rotations())[:, [1, 2, 3, 0]]
    table = np.concatenate([known.times_s[:, None], known.positions(), quaternion], axis=1)
    rows = (" ".join(map(repr, row)) for row in table.tolist())
    replace_file(path, "\n".join(["# t x y z qx qy qz qw", *rows, ""]).encode())
