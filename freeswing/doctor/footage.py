"""Footage: which camera files are there, and whether their frames and stamps fit together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from freeswing.cdpr.files.documents import DataError, InputError
from freeswing.doctor.finding import Finding
from freeswing.session.session_file import Run, Session

if TYPE_CHECKING:
    from freeswing.calib.board.recordings import Recording

LOOKED_AT = 100
"""Frames looked at for copies: a recorder that repeats frames does so many times in as many."""
VIDEO_SUFFIXES = (".mkv", ".avi", ".mp4", ".mov")
IMAGE_SUFFIXES = (".png", ".bmp", ".tif", ".tiff", ".pgm", ".jpg", ".jpeg")


def calibration_findings(session: Session) -> Iterator[Finding]:
    """Cameras that are known, or can be calibrated."""
    if not session.video_runs:
        return
    has_cameras = session.cameras.is_file()
    source = session.calibration
    if has_cameras:
        yield from _camera_file(session)
    elif source is None or source.recordings is None:
        text = "there are videos, but neither cameras.toml nor calibration recordings"
        yield Finding("error", "cameras", text, "add one of them")
    else:
        yield Finding("note", "cameras", "not calibrated yet", "run freeswing calibrate")
    if source is not None and source.board is not None:
        yield from _board(source.board)
    if source is not None and source.recordings is not None:
        if not camera_names(source.recordings):
            text = f"{source.recordings} holds no <camera>.mkv and no <camera>/*.png"
            yield Finding("error", "calibration", text, "correct calibration.recordings")
        if not source.base_tags and not source.surveyed:
            text = "no base_tags: nothing ties the cameras to the base frame"
            yield Finding("warning", "calibration", text, "survey a tag on the frame")
    if session.target is None:
        yield Finding("error", "target", "videos need a target.toml", "name the tags or markers")


def _board(table: Mapping[str, object]) -> Iterator[Finding]:
    from freeswing.calib.board.declared_board import board_from

    try:
        board_from(table)
    except InputError as failure:
        text = str(failure).removeprefix("board: ")
        yield Finding("error", "calibration.board", text, "correct session.toml")


def video_findings(session: Session, run: Run) -> Iterator[Finding]:
    """Every camera of the session has a recording of the run."""
    subject = f"run {run.name}"
    folder = run.video or Path()
    found = camera_names(folder)
    if not found:
        text = f"{folder} holds no <camera>.mkv and no <camera>/*.png"
        yield Finding("error", subject, text, "correct video")
        return
    if session.cameras.is_file():
        from freeswing.calib.camera.cameras_file import read_cameras

        try:
            known = {camera.name for camera in read_cameras(session.cameras)}
        except InputError:
            return
        for name in sorted(known - found):
            yield Finding("warning", subject, f"camera {name} has no recording")
        for name in sorted(found - known):
            text = f"camera {name} is not in {session.cameras.name}"
            yield Finding("warning", subject, text, "its recording is not used")


def footage_findings(subject: str, folder: Path, frame_rate_hz: float | None) -> Iterator[Finding]:
    """Each recording of a folder: its frames' times, copies of frames, torn ones."""
    from freeswing.calib.board.recordings import find_recordings

    try:
        found = find_recordings(folder)
    except InputError:
        return  # that nothing is there is said elsewhere
    for recording in found:
        where = f"{subject} {recording.name}"
        try:
            yield from _recording_findings(where, recording, frame_rate_hz)
        except (InputError, DataError) as failure:
            yield Finding("error", where, str(failure).replace("\n", " "))


def _recording_findings(
    subject: str, recording: Recording, frame_rate_hz: float | None
) -> Iterator[Finding]:
    from freeswing.calib.footage.copied_frames import are_many
    from freeswing.calib.footage.first_frames import condition_of
    from freeswing.calib.footage.frame_times import frame_times
    from freeswing.calib.footage.interlacing import torn_text

    times = frame_times(recording, frame_rate_hz)
    for remark in times.remarks:
        yield Finding("warning" if remark.is_warning else "note", subject, remark.text)
    if times.source == "none":
        text = f"no {recording.name}.csv beside the images, and no frame_rate_hz"
        yield Finding("error", subject, text, "add one of them")
    condition = condition_of(recording, LOOKED_AT)
    if condition.is_torn:
        yield Finding("error", subject, torn_text(recording))
    if are_many(condition.copies, condition.frames):
        text = f"{condition.copies} of the first {condition.frames} frames repeat the one before"
        remedy = "record at the source's own rate; copies are left out"
        yield Finding("warning", subject, text, remedy)


def camera_names(folder: Path) -> set[str]:
    """Names of the cameras that have a video or a folder of images here."""
    if not folder.is_dir():
        return set()
    places = list(folder.iterdir())
    videos = {p.stem for p in places if p.is_file() and p.suffix.lower() in VIDEO_SUFFIXES}
    images = {p.name for p in places if p.is_dir() and _has_image(p)}
    return videos | images


def _has_image(folder: Path) -> bool:
    return any(file.suffix.lower() in IMAGE_SUFFIXES for file in folder.iterdir())


def _camera_file(session: Session) -> Iterator[Finding]:
    from freeswing.calib.camera.cameras_file import read_cameras

    try:
        read_cameras(session.cameras)
    except InputError as failure:
        yield Finding("error", "cameras", str(failure).replace("\n", " "))
