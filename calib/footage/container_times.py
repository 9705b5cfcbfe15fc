"""When a video says its frames were taken: presentation times, turn and interlacing."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.lens_models import Array
from freeswing.cdpr.files.documents import InputError

_TICK_SHARE = 0.6
"""Times within this share of a tick from an even beat are that beat, written in ticks: rounding
leaves half a tick, the rest is for the beat's own error."""
_LONGEST_TICK = 0.5
"""A tick longer than this share of the beat cannot tell an even beat from an uneven one."""


@dataclass(frozen=True, slots=True)
class Presentation:
    """What the container says of its frames.

    Attributes:
        ticks: when each frame is shown, in the container's own unit, rising, (n,).
        times_s: when each frame is shown, rising, from the first, (n,). Where the container's
            ticks are coarse and the frames come evenly, the even times.
        rate_hz: frames a second along the stretches without a gap.
        even: whether all frames lie on one even beat (gaps of whole frames allowed).
        missing: frames that the beat has and the recording has not.
        turn_deg: clockwise turn after which the picture is upright (0, 90, 180 or 270), which
            every reader here makes, as viewers, OpenCV and the readers of EXIF do.
        interlaced: whether the file says that its frames are two half pictures.
    """

    ticks: NDArray[np.int64]
    times_s: Array
    rate_hz: float
    even: bool
    missing: int
    turn_deg: int
    interlaced: bool


def presentation_of(path: Path) -> Presentation | None:
    """Presentation of a video file; None where the container holds no times.

    Raises:
        InputError: when it cannot be opened.
    """
    status = path.stat()
    return _read(path, status.st_size, status.st_mtime_ns)


@lru_cache(maxsize=64)
def _read(path: Path, size: int, changed_ns: int) -> Presentation | None:
    """Read once as long as the file stays as it is."""
    import av
    from av.error import FFmpegError

    try:
        with av.open(str(path)) as container:
            if not container.streams.video:
                return None
            stream = container.streams.video[0]
            times = [
                packet.pts
                for packet in container.demux(stream)
                if packet.pts is not None and packet.size and not packet.is_discard
            ]
            tick_s = float(stream.time_base or 0.0)
            field_order = getattr(stream.codec_context, "field_order", 0)
        with av.open(str(path)) as container:
            frame = next(container.decode(video=0), None)
    except (FFmpegError, OSError) as error:
        raise InputError(f"{path}: cannot be decoded ({error})") from error
    if frame is None:
        raise InputError(f"{path}: not one frame can be decoded: copied in part? copy it again")
    ticks = np.unique(np.array(times, dtype=np.int64))
    if len(ticks) < 2 or len(ticks) < len(times) or tick_s <= 0.0:
        return None
    shown, beat_s, even, missing = evened((ticks - ticks[0]) * tick_s, tick_s)
    interlaced = int(field_order) > 1
    return Presentation(ticks, shown, 1.0 / beat_s, even, missing, turn_of(frame), interlaced)


def turn_of(frame: object) -> int:
    """Clockwise turn in degrees that a decoded frame asks for, a multiple of 90."""
    turn = float(getattr(frame, "rotation", 0.0) or 0.0)
    return round(-turn / 90.0) % 4 * 90


def upright(image: NDArray[np.uint8], turn_deg: int) -> NDArray[np.uint8]:
    """The picture (h, w) after a clockwise turn by a multiple of 90 degrees."""
    return np.ascontiguousarray(np.rot90(image, -turn_deg // 90)) if turn_deg else image


def evened(times_s: Array, tick_s: float) -> tuple[Array, float, bool, int]:
    """Times without the container's rounding, their beat in s, whether even, and frames missing.

    Args:
        times_s: rising, (n,).
        tick_s: unit in which they were written.

    Source:
        Press et al. 2007, Numerical Recipes, sec. 15.2: a straight line by least squares.
    """
    beat = float(np.median(np.diff(times_s)))
    start, count = float(times_s[0]), np.zeros(len(times_s))
    for _ in range(3):
        steps = np.maximum(np.round(np.diff(times_s) / beat), 1.0)
        count = np.concatenate([[0.0], np.cumsum(steps)])
        beat, start = np.polyfit(count, times_s, 1)
    off = float(np.abs(times_s - start - beat * count).max())
    even = off <= _TICK_SHARE * tick_s and tick_s < _LONGEST_TICK * beat
    missing = int(count[-1]) + 1 - len(times_s)
    return (beat * count if even else times_s), float(beat), bool(even), missing
