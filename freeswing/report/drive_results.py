"""What `drive` left in a results folder, for the page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from freeswing.cdpr.files.documents import load_json
from freeswing.results.driven.estimates import AGAIN, LARGEST_BYTES, DriveResult, read_drive


@dataclass(frozen=True, slots=True)
class DriveResults:
    """The documents.

    Attributes:
        estimates: `drive.json`.
        motion: `drive_motion.json`, empty where it is not there.
    """

    estimates: DriveResult
    motion: Mapping[str, Any]


def read_drive_results(results: Path) -> DriveResults | None:
    """What is there; None where no driven robot was identified.

    Raises:
        InputError: for a document that is not what its name says.
    """
    path, beside = results / "drive.json", results / "drive_motion.json"
    if not path.is_file():
        return None
    estimates = read_drive(path, DriveResult)
    motion: dict[str, Any] = {}
    if beside.is_file():
        motion = load_json(beside, "freeswing-drive-motion/1", LARGEST_BYTES, AGAIN)
    return DriveResults(estimates, motion)
