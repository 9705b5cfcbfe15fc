"""Recordings of several cameras in one folder: `<camera>.mkv` or `<camera>/*.png`, and stamps."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.footage.container_times import presentation_of, turn_of, upright
from freeswing.cdpr.files.documents import InputError, read_text
from freeswing.cdpr.files.number_table import comma_separated

Image = NDArray[np.uint8]

VIDEO_SUFFIXES = (".mkv", ".avi", ".mp4", ".mov")
IMAGE_SUFFIXES = (".png", ".bmp", ".tif", ".tiff", ".pgm", ".jpg", ".jpeg")
_MOST_STAMP_BYTES = 1 << 28
MOST_PIXELS = 150_000_000


@dataclass(frozen=True, slots=True)
class Recording:
    """What one camera recorded.

    Attributes:
        name: the camera.
        path: a video file or a folder of images.
        images: the images in order, empty for a video.
        numbers: the images' frame numbers; equal numbers of two cameras are simultaneous.
    """

    name: str
    path: Path
    images: tuple[Path, ...] = ()
    numbers: tuple[int, ...] = ()


def find_recordings(folder: Path | str) -> tuple[Recording, ...]:
    """Every camera's recording in a folder, ordered by name.

    Raises:
        InputError: when the folder is absent, holds none, or one camera twice.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; calibration recordings belong there")
    found: dict[str, Recording] = {}
    for path in sorted(folder.iterdir()):
        recording = _recording(path)
        if recording is None:
            continue
        if recording.name in found:
            raise InputError(
                f"{folder}: camera {recording.name!r} has {found[recording.name].path.name} and "
                f"{path.name}; keep one"
            )
        found[recording.name] = recording
    if not found:
        raise InputError(f"{folder}: no <camera>.mkv and no <camera>/*.png in it")
    return tuple(found.values())


def _recording(path: Path) -> Recording | None:
    if path.name.startswith("."):
        return None
    if path.is_file():
        return Recording(path.stem, path) if path.suffix.lower() in VIDEO_SUFFIXES else None
    files = [
        file
        for file in sorted(path.iterdir())
        if file.suffix.lower() in IMAGE_SUFFIXES and not file.name.startswith(".")
    ]
    if not files:
        return None
    digits = [re.findall(r"\d+", file.stem) for file in files]
    numbers = [int(groups[-1]) if groups else -1 for groups in digits]
    if min(numbers) < 0 or len(set(numbers)) < len(numbers):
        numbers = list(range(len(files)))
    order = np.argsort(numbers, kind="stable")
    return Recording(
        path.name,
        path,
        tuple(files[i] for i in order),
        tuple(numbers[i] for i in order),
    )


def read_frames(recording: Recording) -> Iterator[tuple[int, str, Image]]:
    """Frame number, label and grey image (h, w) of every frame, in order.

    Raises:
        InputError: when the file cannot be decoded or the image size changes.
    """
    size: tuple[int, ...] | None = None
    for number, label, image in (_images if recording.images else _video)(recording):
        if size is not None and image.shape != size:
            raise InputError(
                f"{label}: {image.shape[1]} x {image.shape[0]} pixels, the frames before "
                f"had {size[1]} x {size[0]}"
            )
        size = image.shape
        yield number, label, image


def _images(recording: Recording) -> Iterator[tuple[int, str, Image]]:
    import cv2

    for number, path in zip(recording.numbers, recording.images, strict=True):
        _refuse_bomb(path)
        try:
            image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)  # turned as its EXIF asks
        except cv2.error as error:
            reason = str(error.err or error)
            raise InputError(f"{path}: an image that is not read ({reason})") from error
        if image is None:
            raise InputError(f"{path}: not an image that can be read")
        yield number, f"{recording.name}/{path.name}", np.asarray(image, dtype=np.uint8)


def _refuse_bomb(path: Path) -> None:
    """Looks at an image's size before its pixels take memory: a small file may unfold to any."""
    from PIL import Image as Header

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Header.DecompressionBombWarning)
            with Header.open(path) as header:
                width, height = header.size
    except Header.DecompressionBombError as error:
        raise InputError(f"{path}: {error}") from error
    except (OSError, ValueError, SyntaxError):
        return  # whether it can be read at all is for the decoder to say
    _refuse_pixels(path, width, height)


def _refuse_pixels(path: Path, width: int, height: int) -> None:
    if width * height > MOST_PIXELS:
        raise InputError(
            f"{path}: {width} x {height} pixels, more than the {MOST_PIXELS:.0e} read here"
        )


def _video(recording: Recording) -> Iterator[tuple[int, str, Image]]:
    """Frames by their place in the order of presentation, turned upright as the file asks."""
    import av
    from av.error import FFmpegError

    shown = presentation_of(recording.path)
    places = {} if shown is None else {int(tick): k for k, tick in enumerate(shown.ticks)}
    try:
        with av.open(str(recording.path)) as container:
            if not container.streams.video:
                raise InputError(f"{recording.path}: holds no video")
            stream = container.streams.video[0]
            _refuse_pixels(recording.path, stream.width, stream.height)
            stream.thread_type = "AUTO"
            for index, frame in enumerate(container.decode(video=0)):
                number = places.get(frame.pts, index) if frame.pts is not None else index
                label = f"{recording.path.name} frame {number}"
                image = np.asarray(frame.to_ndarray(format="gray"), np.uint8)
                # One layout for all: kernels are compiled once for each they meet.
                yield number, label, np.ascontiguousarray(upright(image, turn_of(frame)))
    except (FFmpegError, OSError) as error:
        raise InputError(f"{recording.path}: cannot be decoded ({error})") from error


def stamp_file(recording: Recording) -> Path:
    """Where a recording's time stamps are expected."""
    return recording.path.parent / f"{recording.name}.csv"


def stamp_rows(path: Path) -> Iterator[tuple[int, int, float]]:
    """Line, frame number and stamp in seconds of each row of a `frame,t_s` file.

    Columns are found by their names; others are left alone.

    Raises:
        InputError: when the file does not hold such rows.
    """
    lines = comma_separated(read_text(path, _MOST_STAMP_BYTES)).splitlines()
    names = [part.strip() for part in lines[0].split(",")] if lines else []
    if any(names.count(name) != 1 for name in ("frame", "t_s")):
        raise InputError(f"{path}: the first line must name the columns frame and t_s, once each")
    places = names.index("frame"), names.index("t_s")
    for row, line in enumerate(lines[1:], start=2):
        if not line.strip():
            continue
        try:
            cells = line.split(",")
            frame, stamp = (cells[place] for place in places)
            number, time = int(frame), float(stamp)
        except (ValueError, IndexError) as error:
            raise InputError(f"{path}: line {row}: {line[:60]!r} is not frame,t_s") from error
        if not np.isfinite(time):
            raise InputError(f"{path}: line {row}: the stamp {stamp!r} is not a number of seconds")
        yield row, number, time
