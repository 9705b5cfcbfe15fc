"""What `drive` left in a results folder, for the page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from freeswing.cdpr.files.documents import load_json

LARGEST_BYTES = 64 * 2**20
AGAIN = "delete it and run freeswing drive again"


@dataclass(frozen=True, slots=True)
class DriveResults:
    """The documents.

    Attributes:
        estimates: `drive.json`.
        motion: `drive_motion.json`, empty where it is not there.
    """

    estimates: Mapping[str, Any]
    motion: Mapping[str, Any]


def read_drive_results(results: Path) -> DriveResults | None:
    """What is there; None where no driven robot was identified.

    Raises:
        InputError: for a document that is not what its name says.
    """
    path, beside = results / "drive.json", results / "drive_motion.json"
    if not path.is_file():
        return None
    estimates = load_json(path, "freeswing-drive-result/1", LARGEST_BYTES, AGAIN)
    motion: dict[str, Any] = {}
    if beside.is_file():
        motion = load_json(beside, "freeswing-drive-motion/1", LARGEST_BYTES, AGAIN)
    return DriveResults(estimates, motion)
