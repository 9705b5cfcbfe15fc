"""Peak memory of tracking against the length of a recording, eight cameras.

Two things happen to a recording, each in a process of its own here: every camera is followed
(`collect_sightings`, one process a camera at a time), and all are fused (`track_run`). Following is
measured on a looped video of small images, and on images of full size for what these add; fusing on
sightings that are repeated on disk up to an hour, which is what it reads. Told is the largest
resident set of a process, and what a session takes with one process a core.

    python benchmarks/cameras/vision_memory.py [--minutes 1 4 15 60] [--rate 100]
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from freeswing.calib.board.recordings import Recording
from freeswing.calib.camera.cameras_file import read_cameras, write_cameras
from freeswing.cdpr.measured.target import read_target
from freeswing.vision.look.pieces import FRAMES_A_PIECE, load_piece
from freeswing.vision.look.sightings import collect_sightings
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.settings import Settings
from freeswing.vision.track_run import track_run
from tests.vision.loops import PERIOD, RATE_HZ, small_cameras, write_looped_session

CAMERAS = 8
FOLLOWED = (400, 1600, 6400)


def peak_mib() -> float:
    """The largest resident set this process has had."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def follow(folder: Path, name: str) -> None:
    """Follows one camera of a session."""
    camera = next(c for c in read_cameras(folder / "cameras.toml") if c.name == name)
    recording = Recording(name, folder / "runs" / "long" / f"{name}.mkv")
    watch = Watch.of(read_target(folder / "target.toml"))
    collect_sightings(folder / "pieces", camera, watch, recording, RATE_HZ)


def repeat_pieces(folder: Path, frames: int, rate_hz: float) -> None:
    """Copies each camera's first piece until it fills a recording of so many frames."""
    for camera in read_cameras(folder / "cameras.toml"):
        first = sorted((folder / "pieces").glob(f"{camera.name}-*.npz"))[0]
        piece = load_piece(first)
        count = FRAMES_A_PIECE - FRAMES_A_PIECE % PERIOD
        with np.load(first) as data:
            arrays = dict(data)
        if len(piece.numbers) != count:
            raise SystemExit(f"{first}: {len(piece.numbers)} frames, {count} are needed")
        for k in range(-(-frames // count)):
            arrays["numbers"] = piece.numbers + k * count
            arrays["stamps_s"] = (piece.numbers + k * count) / rate_hz
            path = folder / "long" / f"{camera.name}-{k:06d}.npz"
            path.parent.mkdir(exist_ok=True)
            with path.open("wb") as stream:
                np.savez(stream, **arrays)


def fuse(folder: Path, frames: int) -> None:
    """Fuses the first frames of the repeated pieces."""
    pieces = -(-frames // FRAMES_A_PIECE)
    sources = [
        (camera, sorted((folder / "long").glob(f"{camera.name}-*.npz"))[:pieces])
        for camera in read_cameras(folder / "cameras.toml")
    ]
    watch = Watch.of(read_target(folder / "target.toml"))
    track_run("long", sources, watch, folder / "long.csv", Settings())


def measured(*arguments: str) -> float:
    """Peak of a process that does one of the above, MiB."""
    command = [sys.executable, __file__, "--do", *arguments]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return float(done.stdout.split()[-1])


def main() -> None:
    """Makes recordings, measures and prints."""
    parser = argparse.ArgumentParser(description="Peak memory of tracking against length.")
    parser.add_argument("--minutes", type=float, nargs="*", default=[1.0, 4.0, 15.0, 60.0])
    parser.add_argument("--rate", type=float, default=100.0)
    parser.add_argument("--do", nargs="*")
    options = parser.parse_args()
    if options.do:
        kind, folder, what = options.do
        if kind == "follow":
            follow(Path(folder), what)
        elif kind == "fuse":
            fuse(Path(folder), int(what))
        print(peak_mib())
        return
    rows = []
    with tempfile.TemporaryDirectory() as place:
        for frames in FOLLOWED:
            folder = Path(place) / f"follow-{frames}"
            write_looped_session(folder, small_cameras(1), frames)
            mib = measured("follow", str(folder), "cam0")
            rows.append({"what": "follow", "frames": frames, "mib": mib})
            print(f"follow one camera, 200 x 160, {frames:6d} frames: {mib:6.0f} MiB")
        folder = Path(place) / "fuse"
        write_looped_session(folder, small_cameras(CAMERAS), FRAMES_A_PIECE)
        write_cameras(folder / "cameras.toml", small_cameras(CAMERAS))
        for k in range(CAMERAS):
            follow(folder, f"cam{k}")
        longest = round(max(options.minutes) * 60.0 * options.rate)
        repeat_pieces(folder, longest, options.rate)
        for minutes in options.minutes:
            frames = round(minutes * 60.0 * options.rate)
            mib = measured("fuse", str(folder), str(frames))
            rows.append({"what": "fuse", "minutes": minutes, "frames": frames, "mib": mib})
            print(
                f"fuse {CAMERAS} cameras, {minutes:4.0f} min at {options.rate:.0f} Hz: "
                f"{mib:6.0f} MiB"
            )
    print(json.dumps(rows))


if __name__ == "__main__":
    main()
