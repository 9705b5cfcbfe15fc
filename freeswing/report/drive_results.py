"""What `drive` left in a results folder, for the page."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from freeswing.cdpr.files.documents import InputError
from freeswing.results.driven.estimates import AGAIN, DriveResult, read_drive
from freeswing.results.driven.motion import DriveMotion


@dataclass(frozen=True, slots=True)
class DriveResults:
    """The documents.

    Attributes:
        estimates: `drive.json`.
        motion: `drive_motion.json`, or None where it is not there.
    """

    estimates: DriveResult
    motion: DriveMotion | None


def read_drive_results(results: Path) -> DriveResults | None:
    """What is there; None where no driven robot was identified.

    Raises:
        InputError: for a document that is not what its name says.
    """
    path, beside = results / "drive.json", results / "drive_motion.json"
    if not path.is_file():
        return None
    estimates = read_drive(path, DriveResult)
    if not beside.is_file():
        return DriveResults(estimates, None)
    motion = read_drive(beside, DriveMotion)
    if run := motion.uneven():
        raise InputError(f"{beside}: run {run}: rows and columns are not as many; {AGAIN}")
    return DriveResults(estimates, motion)
