"""samples/filmed as phones would have recorded it: no stamps, other containers, other mistakes."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from scipy.interpolate import CubicSpline

from freeswing.calib.board.recordings import find_recordings, read_frames
from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import read_cameras, write_cameras
from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.main import main
from tests.places import SAMPLES

FILMED = SAMPLES / "filmed"
START_S = 0.2  # base time of the recordings' first frames
RATE_HZ = 20.0


def write_session(
    folder: Path,
    change: Callable[[tuple[Camera, ...]], Iterable[Camera]] = tuple,
    *,
    text: Callable[[str], str] = str,
    target: Callable[[str], str] = str,
    runs: int = 1,
) -> Path:
    """A session of the sample's first runs, its cameras those of the truth or changed."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(FILMED / "robot.toml", folder)
    (folder / "target.toml").write_text(target((FILMED / "target.toml").read_text()))
    head, *tables = (FILMED / "session.toml").read_text().split("[[runs]]")
    kept = "".join("[[runs]]" + table for table in tables[:runs])
    (folder / "session.toml").write_text(text(head + kept))
    write_cameras(
        folder / "cameras.toml", tuple(change(read_cameras(FILMED / "truth" / "cameras.toml")))
    )
    for name in ("swing-01", "swing-02", "swing-03", "check-01")[:runs]:
        shutil.copytree(FILMED / "runs" / name, folder / "runs" / name)
    return folder


def frames_of(camera: str, run: str = "swing-01") -> list[np.ndarray]:
    """Pictures of one camera."""
    (recording,) = (r for r in find_recordings(FILMED / "runs" / run) if r.name == camera)
    return [image for _, _, image in read_frames(recording)]


def write_frames(
    path: Path,
    frames: Iterable[np.ndarray],
    stamps_s: np.ndarray,
    tick: Fraction = Fraction(1, 90000),
) -> None:
    """A good video in whose container the stamps stand, without a csv beside it."""
    for old in path.parent.glob(f"{path.stem}.*"):
        old.unlink()
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=20, options={"crf": "10", "bf": "0"})
        stream.pix_fmt = "yuv420p"
        stream.codec_context.time_base = stream.time_base = tick
        opened = False
        for frame, stamp in zip(frames, stamps_s, strict=True):
            if not opened:
                stream.height, stream.width = frame.shape
                opened = True
            picture = av.VideoFrame.from_ndarray(frame, format="gray").reformat(format="yuv420p")
            picture.pts, picture.time_base = round(float(stamp) / float(tick)), tick
            container.mux(stream.encode(picture))
        container.mux(stream.encode())


def without_clocks(cameras: tuple[Camera, ...]) -> list[Camera]:
    return [replace(camera, clock_offset_s=0.0) for camera in cameras]


def without_base_tags(text: str) -> str:
    """The session's text without surveyed tags."""
    tables = re.split(r"^(?=\[)", text, flags=re.MULTILINE)
    return "".join(one for one in tables if not one.startswith("[[calibration.base_tags"))


def track(folder: Path, *more: str) -> int:
    return main(["track", str(folder), "--workers", "1", "--quiet", *more])


def errors_m(folder: Path, later_s: float, run: str = "swing-01") -> np.ndarray:
    """Position errors of a track whose times are the truth's less `later_s`, (n, 3)."""
    found = read_trajectory(folder / "results" / "tracks" / f"{run}.csv")
    truth = read_trajectory(FILMED / "truth" / f"{run}.csv")
    at = found.times_s + later_s
    good = found.is_known & (at > truth.times_s[0]) & (at < truth.times_s[-1])
    return (found.values - CubicSpline(truth.times_s, truth.values)(at))[good, :3]
