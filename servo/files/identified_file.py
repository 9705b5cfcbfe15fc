"""drive.json as far as robustness needs it: numbers, their covariance, and what stays unknown."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.cdpr.files.documents import load_json
from freeswing.cdpr.files.problems import InputError
from freeswing.servo.synthesis.state_space import Array

FORMAT = "freeswing-drive-result/1"
LARGEST_FILE_BYTES = 64 * 2**20
# Eigenvalues of a correlation matrix written with 16 digits are negative by rounding alone.
NEGATIVE = -1e-8


@dataclass(frozen=True, slots=True)
class Identified:
    """The joint estimate of a driven robot.

    Attributes:
        members: names of the model's numbers that each unknown moves, (k,).
        values: (k,).
        covariance: (k, k).
        unknown: names that the data did not determine.
    """

    members: tuple[tuple[str, ...], ...]
    values: Array
    covariance: Array
    unknown: tuple[str, ...]


def read_identified(path: Path | str, model: DrivenModel) -> Identified:
    """Read and check drive.json against the robot that is to be controlled.

    Raises:
        InputError: unreadable, of another kind, of another robot, or no covariance.
    """
    table = load_json(path, FORMAT, LARGEST_FILE_BYTES, "freeswing drive writes such a file")
    try:
        return _read(table["estimates"]["joint"], model)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: estimates.joint: {error!r}") from error


def _read(joint: dict[str, Any], model: DrivenModel) -> Identified:
    entries = joint["parameters"]
    names = [str(entry["name"]) for entry in entries]
    strange = [name for name in names if name not in model.names]
    if strange:
        raise InputError(f"{', '.join(strange)}: no numbers of robot {model.robot.name}")
    known = [k for k, entry in enumerate(entries) if entry["value"] is not None]
    if not known:
        raise InputError("estimates.joint determines nothing")
    std = np.array([entries[k]["std"] for k in known], dtype=np.float64)
    whole = np.array(joint["correlation"], dtype=np.float64)
    if whole.shape != (len(names), len(names)):
        raise ValueError(f"correlation of shape {whole.shape} for {len(names)} numbers")
    correlation = whole[np.ix_(known, known)]
    least = float(np.linalg.eigvalsh(correlation)[0])
    if not np.isfinite(std).all() or (std < 0.0).any() or least < NEGATIVE:
        raise ValueError("std and correlation make no covariance")
    return Identified(
        tuple((names[k], *map(str, entries[k].get("tied", ()))) for k in known),
        np.array([entries[k]["value"] for k in known], dtype=np.float64),
        correlation * np.outer(std, std),
        tuple(name for k, name in enumerate(names) if k not in known),
    )
