"""Recordings on disk: frames streamed out of and into lossless video, and their time stamps."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from itertools import chain
from pathlib import Path

import av
import numpy as np
from av.container import OutputContainer
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import replace_file
from freeswing.cdpr.system.drafts import draft_of

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

MUXERS = {".mkv": "matroska", ".avi": "avi", ".mp4": "mp4", ".mov": "mov"}
CODECS = {".mkv": "ffv1", ".avi": "magicyuv", ".mp4": "ffv1", ".mov": "ffv1"}
_CLOCK = Fraction(1, 1_000_000)


def write_video(
    path: Path, frames: Iterable[Image], stamps_s: Array, *, codec: str | None = None
) -> None:
    """Writes grey frames (h, w) as a lossless video, every frame a key frame.

    The codec is MagicYUV for .avi, else FFV1.

    The file appears under its name only when complete. Stamps become presentation times in
    microseconds, counted from the first.
    """
    path = Path(path)
    pictures = iter(frames)
    first = next(pictures, None)
    if first is None:
        raise ValueError(f"{path}: a recording needs at least one frame, got none")
    with (
        draft_of(path) as draft,
        av.open(draft.name, "w", format=MUXERS[path.suffix.lower()]) as container,
    ):
        stream = _add_stream(container, codec or CODECS[path.suffix.lower()], first.shape, stamps_s)
        for frame, stamp in zip(chain([first], pictures), stamps_s, strict=True):
            picture = av.VideoFrame.from_ndarray(frame, format="gray")
            picture.pts = round((float(stamp) - float(stamps_s[0])) / _CLOCK)
            picture.time_base = _CLOCK
            container.mux(stream.encode(picture))
        container.mux(stream.encode())


def _add_stream(
    container: OutputContainer, codec: str, shape: tuple[int, ...], stamps_s: Array
) -> av.VideoStream:
    stream = container.add_stream(codec, rate=_rate(stamps_s))
    if not isinstance(stream, av.VideoStream):
        raise ValueError(f"codec {codec!r} is not one for video; use ffv1 or magicyuv")
    stream.height, stream.width = shape
    stream.pix_fmt = "gray"
    stream.gop_size = 1
    stream.codec_context.time_base = _CLOCK
    stream.time_base = _CLOCK
    if codec == "ffv1":
        stream.options = {"level": "3", "slices": "4", "slicecrc": "1"}
    return stream


def write_stamps(path: Path, stamps_s: Array) -> None:
    """Writes `frame,t_s` beside a recording."""
    lines = ["frame,t_s", *(f"{k},{t:.9f}" for k, t in enumerate(stamps_s))]
    replace_file(Path(path), ("\n".join(lines) + "\n").encode())


def _rate(stamps_s: Array) -> Fraction:
    if len(stamps_s) < 2:
        return Fraction(25)
    step = float(np.median(np.diff(stamps_s)))
    return Fraction(1.0 / step).limit_denominator(1000) if step > 0.0 else Fraction(25)
