"""Time stamps of a recording's frames: from its csv, from its container, or by its rate.

Whatever serves is held against what else is stated, and what disagrees is said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from freeswing.calib.board.recordings import Recording, stamp_file, stamp_rows
from freeswing.calib.camera.lens_models import Array
from freeswing.calib.footage.container_times import Presentation, presentation_of
from freeswing.cdpr.files.documents import DataError, InputError

SAME_RATE = 1e-4
"""Rates apart by more are named: over a swing of 10 s that is 1 ms, a millimetre at 1 m/s."""
NEAR_RATE = 0.02
"""Two statements of one rate lie within this: 29.97 called 30 is 1e-3, film at 23.976 called 24
too. What is farther off states something else."""
_PLAYED_SLOWLY = 1.9
"""A recorder that plays at another speed does so by a factor of two or more."""
_UNITS = ((1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds"))


@dataclass(frozen=True, slots=True)
class Remark:
    """Something about a recording's times that a reader should know."""

    is_warning: bool
    text: str


@dataclass(frozen=True, slots=True)
class FrameTimes:
    """Stamps of one recording.

    Attributes:
        stamps: seconds by frame number, or None where the rate serves.
        rate_hz: frames a second, NaN when unknown.
        source: `csv`, `container` or `rate`, or `none`.
        remarks: what is odd about them.
    """

    stamps: dict[int, float] | None
    rate_hz: float
    source: str
    remarks: tuple[Remark, ...] = ()

    def at(self, number: int) -> float:
        """A frame's stamp in seconds, NaN when it has none."""
        if self.stamps is not None:
            return self.stamps.get(number, float("nan"))
        return number / self.rate_hz

    def of(self, numbers: np.ndarray) -> Array:
        """Stamps of frame numbers, (n,)."""
        return np.array([self.at(int(number)) for number in numbers], dtype=np.float64)


def frame_times(recording: Recording, frame_rate_hz: float | None) -> FrameTimes:
    """Stamps from `<camera>.csv`, else the container's presentation times, else the rate.

    Rows of the csv that do not come after the one before are left out: the frame is a repeated one.

    Args:
        recording: one camera's.
        frame_rate_hz: as the session states it.

    Raises:
        InputError: when the csv is not `frame,t_s` in seconds.
        DataError: when container and session state rates of which one must be wrong.
    """
    shown = None if recording.images else presentation_of(recording.path)
    path = stamp_file(recording)
    if path.is_file():
        return _from_csv(recording, shown, frame_rate_hz)
    if shown is not None:
        return _from_container(recording, shown, frame_rate_hz)
    if frame_rate_hz is None:
        return FrameTimes(None, float("nan"), "none")
    return FrameTimes(None, frame_rate_hz, "rate")


def needed(times: FrameTimes, recording: Recording) -> FrameTimes:
    """The same times.

    Raises:
        InputError: where there are none.
    """
    if times.source != "none":
        return times
    raise InputError(
        f"{recording.path}: has no {stamp_file(recording).name} with frame,t_s beside it, and the "
        "session states no frame_rate_hz: add one of them"
    )


def _from_csv(
    recording: Recording, shown: Presentation | None, frame_rate_hz: float | None
) -> FrameTimes:
    path = stamp_file(recording)
    stamps: dict[int, float] = {}
    last, late, rows = -np.inf, 0, 0
    for _, number, time in stamp_rows(path):
        rows += 1
        if time > last and number not in stamps:
            stamps[number] = last = time
        else:
            late += 1
    remarks = []
    if late:
        text = f"{late} of {rows} rows of {path.name} do not come after the row before: left out"
        remarks.append(Remark(is_warning=True, text=text))
    rate = _rate(np.array(list(stamps.values())))
    for stated, whose in ((frame_rate_hz, "frame_rate_hz"), (_beat(shown), "the container")):
        if stated is not None and np.isfinite(rate):
            for factor, unit in _UNITS:
                if abs(stated / rate / factor - 1.0) < NEAR_RATE:
                    raise InputError(
                        f"{path}: t_s rises by {1.0 / rate:.6g} a frame where {whose} says "
                        f"{stated:g} Hz: these are {unit}; divide them by {factor:.0e}"
                    )
    if shown is not None:
        remarks += _beside_container(path.name, stamps, shown)
    return FrameTimes(stamps, rate, "csv", tuple(remarks))


def _beside_container(name: str, stamps: dict[int, float], shown: Presentation) -> list[Remark]:
    """Stamps of the csv against the presentation times of the same frames."""
    numbers = np.array([number for number in stamps if number < len(shown.times_s)], dtype=int)
    remarks = []
    if len(stamps) != len(shown.times_s):
        text = (
            f"{name} has {len(stamps)} stamps, the video {len(shown.times_s)} frames: cut short, "
            "or frames were lost in between and have the stamps of others"
        )
        remarks.append(Remark(is_warning=True, text=text))
    if len(numbers) < 3:
        return remarks
    told = np.array([stamps[int(number)] for number in numbers])
    ratio, start = np.polyfit(shown.times_s[numbers], told, 1)
    off = told - start - ratio * shown.times_s[numbers]
    claims = not shown.even or abs(ratio - 1.0) < NEAR_RATE  # else a writer's default rate
    if abs(ratio - 1.0) > SAME_RATE:
        text = (
            f"{name} runs {ratio:.6g} times as fast as the video's own presentation times "
            f"({shown.rate_hz / ratio:.6g} and {shown.rate_hz:.6g} frames a second); {name} is used"
        )
        remarks.append(Remark(is_warning=claims, text=text))
    worst = int(np.argmax(np.abs(off)))
    if claims and abs(off[worst]) > 0.6 / shown.rate_hz:
        text = (
            f"{name} and the video's presentation times are up to {1e3 * abs(off[worst]):.1f} ms "
            f"apart (frame {numbers[worst]}); {name} is used"
        )
        remarks.append(Remark(is_warning=True, text=text))
    return remarks


def _from_container(
    recording: Recording, shown: Presentation, frame_rate_hz: float | None
) -> FrameTimes:
    remarks = []
    scale = 1.0
    if frame_rate_hz is not None:
        off = shown.rate_hz / frame_rate_hz - 1.0
        fast = max(frame_rate_hz / shown.rate_hz, shown.rate_hz / frame_rate_hz)
        both = f"{shown.rate_hz:.6g} frames a second, the session says {frame_rate_hz:.6g}"
        if fast > _PLAYED_SLOWLY:
            scale = shown.rate_hz / frame_rate_hz
            text = f"plays {both}: taken at {frame_rate_hz:.6g}, with the container's gaps"
            remarks.append(Remark(is_warning=True, text=text))
        elif abs(off) > NEAR_RATE:
            raise DataError(
                f"{recording.path}: its presentation times give {both}: one of them is wrong by "
                f"{100 * abs(off):.2g} %. Set frame_rate_hz to the rate at which it was filmed, or "
                f"put {stamp_file(recording).name} with frame,t_s beside it"
            )
        elif abs(off) > SAME_RATE:
            text = (
                f"presentation times give {both} ({off:+.1e}): the presentation times are used; "
                "correct frame_rate_hz"
            )
            remarks.append(Remark(is_warning=True, text=text))
    if shown.missing:
        text = (
            f"{shown.missing} of {len(shown.times_s) + shown.missing} frames are missing "
            f"(first after frame {_first_gap(shown.times_s)}); the others keep their times"
        )
        remarks.append(Remark(is_warning=False, text=text))
    stamps = dict(enumerate((scale * shown.times_s).tolist()))
    return FrameTimes(stamps, shown.rate_hz / scale, "container", tuple(remarks))


def _first_gap(times_s: Array) -> int:
    steps = np.diff(times_s)
    return int(np.argmax(steps > 1.5 * np.median(steps)))


def _beat(shown: Presentation | None) -> float | None:
    return None if shown is None else shown.rate_hz


def _rate(stamps_s: Sequence[float] | Array) -> float:
    steps = np.diff(np.asarray(stamps_s))
    return float(1.0 / np.median(steps)) if len(steps) else float("nan")
