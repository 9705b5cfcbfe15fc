"""tracking.json as what those who go on from it work with."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.files.documents import DataError
from freeswing.results.files import read_document
from freeswing.results.tracking import Tracking
from freeswing.session.session_file import Session
from freeswing.vision.rig.rig_step import Finding
from freeswing.vision.tracked_runs import FoundCameras


def read_tracking(session: Session) -> Tracking | None:
    """The session's tracking result, None where there is none.

    Raises:
        InputError: where the file is not what tracking writes.
    """
    return read_document(session.results / "tracking.json", Tracking)


def found_cameras(session: Session) -> FoundCameras:
    """What tracking found wrong with cameras and tags.

    Raises:
        DataError: where the session has not been tracked.
        InputError: where the file is not what tracking writes.
    """
    told = read_tracking(session)
    if told is None:
        raise DataError(f"{session.results / 'tracking.json'}: no such file; run freeswing track")
    return found_in(told)


def found_in(told: Tracking) -> FoundCameras:
    """The same of a document."""
    findings: dict[str, tuple[Finding, ...]] = {run.run: () for run in told.runs}
    for effect in told.effects:
        numbers = tuple((one.name, one.value or 0.0, one.std or 0.0) for one in effect.parameters)
        own = Finding(effect.effect, effect.camera, numbers)
        findings[effect.run] = (*findings.get(effect.run, ()), own)
    corners = None
    if told.layout is not None and told.layout.refined:
        places = [tag.corners_platform_m for tag in told.layout.tags]
        corners = np.array(places, dtype=np.float64)
    seen = {run.run: tuple(camera.camera for camera in run.cameras) for run in told.runs}
    return FoundCameras(seen, findings, corners)
