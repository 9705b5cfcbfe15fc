"""What the report is made of: the results of a session, and why others are not there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.robot import Robot
from freeswing.report.control_results import ControlResults, read_control
from freeswing.report.drive_results import DriveResults, read_drive_results
from freeswing.results.calibration import Calibration
from freeswing.results.check import Check
from freeswing.results.codec import Document
from freeswing.results.diagnosis import Diagnosis
from freeswing.results.files import read_document
from freeswing.results.identification import Estimate, Identification
from freeswing.results.motion import Motion, RunMotion
from freeswing.results.tracking import Tracking

# Where each result stands, the first that is there taken.
FILES: dict[str, tuple[type[Document], tuple[str, ...]]] = {
    "calibration": (Calibration, ("calibration.json",)),
    "tracking": (Tracking, ("tracking.json",)),
    "identification": (Identification, ("identification.json",)),
    "diagnosis": (Diagnosis, ("diagnosis.json",)),
    "motion": (Motion, ("diagnosis_motion.json", "motion.json")),
    "fitted": (Motion, ("motion.json",)),
    "check": (Check, ("check.json",)),
}
RESULTS = ("calibration", "tracking", "identification", "diagnosis", "motion")


@dataclass(frozen=True, slots=True)
class Material:
    """The results of one session; None where there is none to show.

    Attributes:
        title: the session's name.
        calibration: `results/calibration.json`.
        tracking: `results/tracking.json`.
        identification: `results/identification.json`.
        diagnosis: `results/diagnosis.json`.
        motion: measured and predicted samples of the validation runs, by diagnosis
            (`results/diagnosis_motion.json`) or else by identification (`results/motion.json`).
        fitted: `results/motion.json`, for the runs that were fitted.
        check: `results/check.json`.
        robot: as declared, for the drawing.
        folder: the session as a command line names it.
        absent: why a result is not shown, by its kind.
        warnings: what to know of the results as a whole.
        refresh_s: how often the page reads itself anew, while a session is watched.
        control: what `design` and `servo` wrote.
        drive: what `drive` wrote.
    """

    title: str
    calibration: Calibration | None = None
    tracking: Tracking | None = None
    identification: Identification | None = None
    diagnosis: Diagnosis | None = None
    motion: Motion | None = None
    fitted: Motion | None = None
    check: Check | None = None
    robot: Robot | None = None
    folder: str = "SESSION"
    absent: Mapping[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    refresh_s: float | None = None
    control: ControlResults | None = None
    drive: DriveResults | None = None

    @property
    def estimates(self) -> dict[str, Estimate]:
        """The estimates that are there, best first."""
        return {} if self.identification is None else self.identification.ranked

    @property
    def fitted_runs(self) -> tuple[RunMotion, ...]:
        """What the best estimate was fitted to, beside the motions found for it."""
        return () if self.fitted is None else self.fitted.fitted

    @property
    def documents(self) -> dict[str, Document]:
        """The result documents that are there, by kind."""
        found = {name: getattr(self, name) for name in RESULTS}
        return {name: one for name, one in found.items() if one is not None}

    def why_absent(self, *kinds: str) -> str:
        """Why results of these kinds are not shown; empty where nothing is known."""
        return " ".join(dict.fromkeys(self.absent[kind] for kind in kinds if kind in self.absent))


def read_material(
    title: str,
    results: Path,
    *,
    robot: Robot | None = None,
    folder: str = "SESSION",
    left_out: Mapping[str, str] | None = None,
    absent: Mapping[str, str] | None = None,
    warnings: tuple[str, ...] = (),
) -> Material:
    """The results found in the folder `results`.

    Args:
        title: the session's name.
        results: the folder.
        robot: as declared.
        folder: the session as a command line names it.
        left_out: files that are not to be shown, with the reason.
        absent: why results that are not there could not be made, by kind.
        warnings: what to know of the results as a whole.
    """
    left_out = left_out or {}
    found: dict[str, Document] = {}
    why = dict(absent or {})
    for kind, (cls, names) in FILES.items():
        for name in names:
            if name in left_out:
                why[kind] = left_out[name]
                continue
            try:
                document = read_document(results / name, cls)
            except InputError as failure:
                why[kind] = str(failure)
                continue
            if document is not None:
                found[kind] = document
                break
    try:
        control = read_control(results)
    except InputError as failure:
        control, why["control"] = None, str(failure)
    try:
        drive = read_drive_results(results)
    except InputError as failure:
        drive, why["drive"] = None, str(failure)
    shown = {"robot": robot, "folder": folder, "absent": why, "warnings": warnings}
    shown |= {"control": control, "drive": drive}
    return Material(title, **found, **shown)  # pyright: ignore[reportArgumentType]
