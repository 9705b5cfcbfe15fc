"""Marker recordings as C3D (https://www.c3d.org, user guide of 2008): binary, float32 or int16.

Written with ezc3d. Read here: ezc3d ends the process on some damaged files, and a measured file
from elsewhere must give a message instead.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import InputError, read_bytes, replace_file
from freeswing.cdpr.files.mocap.fill_values import without_gaps
from freeswing.cdpr.files.number_table import LARGEST_NUMBER
from freeswing.cdpr.measured.marker_recording import MarkerRecording

Array = NDArray[np.float64]

MOST_C3D_BYTES = 512 * 2**20
BLOCK = 512
MARK = 0x50
BYTE_ORDERS = {84: "<", 86: ">"}
METRES_PER_UNIT = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
ITEM_TYPES = {-1: "S1", 1: "i1", 2: "i2", 4: "f4"}
FULL_COUNT = 0xFFFF
SPARE_SHARE = 0.1  # some writers leave room at the end; a count of 1 where 801 are is no such
LEAST_RATE_HZ = 0.01
MOST_RATE_HZ = 1e6


def read_c3d(path: Path | str) -> MarkerRecording:
    """Read the points of a C3D file; a negative residual or NaN is a marker that was not seen.

    Time 0 is frame 1 of the recording, so that a cropped file keeps its times.

    Raises:
        InputError: for a damaged file, an unknown unit or no points.
    """
    data = read_bytes(path, MOST_C3D_BYTES)
    try:
        return _read(Path(path), data)
    except InputError:
        raise
    except (IndexError, KeyError, ValueError, OverflowError) as error:
        raise InputError(f"{path}: a damaged C3D file ({error}); export it again") from error


def write_c3d(path: Path | str, recording: MarkerRecording, unit: str = "mm") -> None:
    """Write a C3D file in `unit` (m, cm or mm), as float32, at a uniform rate.

    Raises:
        ValueError: for another unit, times that are not uniform from a multiple of the step on, or
            more frames than the format counts.
    """
    import tempfile

    import ezc3d

    if unit not in METRES_PER_UNIT:
        raise ValueError(f"unit {unit!r} must be one of {', '.join(METRES_PER_UNIT)}")
    rate, first = _grid(recording.times_s)
    positions = recording.positions_m / METRES_PER_UNIT[unit]
    points = np.ones((4, len(recording.names), len(recording.times_s)))
    points[:3] = positions.transpose(2, 1, 0)
    residuals = np.where(np.isnan(points[0]), -1.0, 0.0)  # the format's mark of a gap
    file = ezc3d.c3d()
    file["header"]["points"]["first_frame"] = first
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(recording.names)
    file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    file["data"]["points"] = points
    file["data"]["meta_points"]["residuals"] = residuals[None]
    with tempfile.TemporaryDirectory() as folder:
        draft = Path(folder) / "draft.c3d"
        file.write(str(draft))
        replace_file(path, draft.read_bytes())


@dataclass(frozen=True, slots=True)
class _Parameter:
    kind: int
    dimensions: tuple[int, ...]
    data: bytes

    def numbers(self, order: str) -> list[float]:
        if self.kind not in (1, 2, 4):
            raise KeyError("a text stands where a number must be")
        return np.frombuffer(self.data, f"{order}{ITEM_TYPES[self.kind]}").astype(float).tolist()

    def texts(self) -> list[str]:
        if self.kind != -1 or not self.dimensions:
            raise KeyError("a number stands where a text must be")
        width = self.dimensions[0]
        cells = [self.data[i : i + width] for i in range(0, len(self.data), max(width, 1))]
        return [cell.decode("utf-8", "replace").strip(" \0") for cell in cells]


def _read(path: Path, data: bytes) -> MarkerRecording:
    if len(data) < 2 * BLOCK or data[1] != MARK or data[0] == 0:
        raise InputError(f"{path}: not a C3D file (its second byte must be 80)")
    start = (data[0] - 1) * BLOCK
    order = BYTE_ORDERS.get(data[start + 3])
    if order is None:
        raise InputError(
            f"{path}: processor type {data[start + 3]} (84 is Intel, 86 MIPS); convert the file to "
            "Intel numbers"
        )
    parameters = _parameters(data, start, order)
    header = np.frombuffer(data[:BLOCK], f"{order}u2")
    rate = parameters["POINT", "RATE"].numbers(order)[0]
    if not LEAST_RATE_HZ <= rate <= MOST_RATE_HZ:
        raise InputError(
            f"{path}: POINT:RATE is {rate} Hz, must be {LEAST_RATE_HZ:g} to {MOST_RATE_HZ:g}"
        )
    names = _names(path, parameters, order)
    first, n_frames = _frames(path, data, header, parameters, order, len(names))
    raw = _points(path, data, header, parameters, order, n_frames, len(names))
    labelled = [i for i, name in enumerate(names) if name]
    used = tuple(names[i] for i in labelled)
    positions, notes = without_gaps(raw[:, labelled], used)
    scale = _metres_per_unit(path, parameters)
    times = (first - 1 + np.arange(n_frames)) / rate
    return MarkerRecording(times, used, scale * positions, path.name, notes)


def _parameters(data: bytes, start: int, order: str) -> dict[tuple[str, str], _Parameter]:
    """Parameters by (GROUP, NAME)."""
    groups: dict[int, str] = {}
    found: dict[tuple[int, str], _Parameter] = {}
    at = start + 4
    while at + 2 <= len(data):
        n_name = abs(int.from_bytes(data[at : at + 1], "little", signed=True))
        group = int.from_bytes(data[at + 1 : at + 2], "little", signed=True)
        if n_name == 0 or group == 0:
            break
        name = data[at + 2 : at + 2 + n_name].decode("latin-1").upper()
        field = at + 2 + n_name
        (step,) = np.frombuffer(data[field : field + 2].ljust(2, b"\0"), f"{order}u2").tolist()
        if group < 0:
            groups[-group] = name
        else:
            found[group, name] = _parameter(data, field + 2)
        if step == 0:
            break
        at = field + step
    return {(groups[group], name): p for (group, name), p in found.items() if group in groups}


def _parameter(data: bytes, at: int) -> _Parameter:
    kind = int.from_bytes(data[at : at + 1], "little", signed=True)
    n_dimensions = data[at + 1]
    dimensions = tuple(data[at + 2 : at + 2 + n_dimensions])
    size = abs(kind)
    for dimension in dimensions:
        size *= dimension
    begin = at + 2 + n_dimensions
    if kind not in ITEM_TYPES or begin + size > len(data):
        raise KeyError(f"a parameter of type {kind} and {size} bytes at byte {at}")
    return _Parameter(kind, dimensions, data[begin : begin + size])


def _frames(
    path: Path,
    data: bytes,
    header: NDArray[np.uint16],
    parameters: dict[tuple[str, str], _Parameter],
    order: str,
    n_points: int,
) -> tuple[int, int]:
    """First frame, counted from 1, and the number of frames that all fields agree on.

    Frames are counted four times: in the header's two numbers of 16 bits, in POINT:FRAMES, in
    TRIAL:ACTUAL_*_FIELD and by the file's length. Numbers of 16 bits that are full say nothing.

    Raises:
        InputError: where they contradict each other, naming all of them.
    """
    first, last = int(header[3]), int(header[4])
    told: dict[str, int] = {}
    if last < FULL_COUNT and last >= first:
        told["header"] = last - first + 1
    fields = [parameters.get(("TRIAL", f"ACTUAL_{end}_FIELD")) for end in ("START", "END")]
    if all(field is not None and len(field.data) >= 4 for field in fields):
        start, end = (_long(field.data, order) for field in fields if field is not None)
        if end >= start:
            told["TRIAL:ACTUAL"] = end - start + 1
            first = start if start >= 1 else first
    count = parameters.get(("POINT", "FRAMES"))
    if count is not None:
        number = count.numbers(order)[0]
        number = number + 2.0**16 if count.kind == 2 and number < 0.0 else number
        if 0.0 < number < FULL_COUNT or (count.kind == 4 and number > 0.0):
            told["POINT:FRAMES"] = int(number)
    there, spare = _frames_of_length(data, header, parameters, order, n_points)
    fitting = {n for n in told.values() if 0 <= there - n <= max(spare, SPARE_SHARE * n)}
    agreed = set(told.values())
    if len(fitting) == 1 and (agreed == fitting or len(told) > 1):
        return first, fitting.pop()
    if len(agreed) == 1 and there < min(agreed):
        return first, agreed.pop()  # cut short: said where the points are read
    if not told and there >= 1:
        return first, there - _blank_at_end(data, header, parameters, order, n_points)
    all_told = ", ".join(f"{name} {number}" for name, number in told.items()) or "no field"
    raise InputError(
        f"{path}: how many frames there are is told in contradiction: {all_told}, and the file's "
        f"length holds {there}; export it again"
    )


def _frames_of_length(
    data: bytes,
    header: NDArray[np.uint16],
    parameters: dict[tuple[str, str], _Parameter],
    order: str,
    n_points: int,
) -> tuple[int, int]:
    """Whole frames that the file has room for, and how many of them may fill the last block."""
    start, end, bytes_a_frame = _room(data, header, parameters, order, n_points)
    if start < BLOCK or bytes_a_frame == 0:
        return 0, 0
    return max(end - start, 0) // bytes_a_frame, BLOCK // bytes_a_frame


def _room(
    data: bytes,
    header: NDArray[np.uint16],
    parameters: dict[tuple[str, str], _Parameter],
    order: str,
    n_points: int,
) -> tuple[int, int, int]:
    """Where the frames' bytes start and end at most, and how many each frame has."""
    item = 4 if parameters["POINT", "SCALE"].numbers(order)[0] < 0.0 else 2
    start, parameters_at = (int(header[8]) - 1) * BLOCK, (data[0] - 1) * BLOCK
    end = parameters_at if parameters_at > start else len(data)
    return start, end, item * (4 * n_points + int(header[2]))


def _blank_at_end(
    data: bytes,
    header: NDArray[np.uint16],
    parameters: dict[tuple[str, str], _Parameter],
    order: str,
    n_points: int,
) -> int:
    """Frames of zeros that fill up the last block where the file's length alone counts frames."""
    start, end, size = _room(data, header, parameters, order, n_points)
    stop = start + (end - start) // size * size
    blank = 0
    while blank < BLOCK // size and not any(data[stop - (blank + 1) * size : stop - blank * size]):
        blank += 1
    return blank


def _long(data: bytes, order: str) -> int:
    low, high = np.frombuffer(data[:4], f"{order}u2").tolist()
    return low + (high << 16)


def _names(
    path: Path, parameters: dict[tuple[str, str], _Parameter], order: str
) -> tuple[str, ...]:
    """Label of every point, empty where it has none."""
    n_points = int(parameters["POINT", "USED"].numbers(order)[0]) & FULL_COUNT
    if n_points == 0:
        raise InputError(
            f"{path}: holds no points, analogue channels alone; export the markers' paths too"
        )
    names: list[str] = []
    for suffix in ("", *map(str, range(2, 10))):
        if ("POINT", f"LABELS{suffix}") in parameters:
            names += parameters["POINT", f"LABELS{suffix}"].texts()
    names = (names + [""] * n_points)[:n_points]
    twice = sorted({name for name in names if name and names.count(name) > 1})
    if twice:
        raise InputError(f"{path}: POINT:LABELS: {twice[0]!r} stands twice; labels must differ")
    if not any(names):
        raise InputError(f"{path}: holds no labelled point; label the markers and export again")
    return tuple(names)


def _points(
    path: Path,
    data: bytes,
    header: NDArray[np.uint16],
    parameters: dict[tuple[str, str], _Parameter],
    order: str,
    n_frames: int,
    n_points: int,
) -> Array:
    """Coordinates in the file's unit, NaN where not seen, (n_frames, n_points, 3)."""
    scale = parameters["POINT", "SCALE"].numbers(order)[0]
    if not np.isfinite(scale) or scale == 0.0:
        raise KeyError(f"POINT:SCALE {scale}")
    item = np.dtype(f"{order}f4" if scale < 0.0 else f"{order}i2")
    n_items = 4 * n_points + int(header[2])
    start = (int(header[8]) - 1) * BLOCK
    size = n_frames * n_items * item.itemsize
    if start < BLOCK or start + size > len(data):
        raise InputError(
            f"{path}: {n_frames} frames of {n_points} points need {size} bytes from byte {start} "
            f"on, the file has {len(data)}: it is cut short or damaged; export it again"
        )
    rows = np.frombuffer(data, item, n_frames * n_items, start).reshape(n_frames, n_items)
    with np.errstate(invalid="ignore"):  # signalling NaNs of damaged files
        raw = rows[:, : 4 * n_points].reshape(n_frames, n_points, 4).astype(np.float64)
    positions = raw[..., :3] * (1.0 if scale < 0.0 else scale)
    seen = (raw[..., 3] >= 0.0) & np.isfinite(positions).all(axis=2)
    if np.abs(positions[seen]).max(initial=0.0) > LARGEST_NUMBER:
        raise InputError(f"{path}: a coordinate is beyond {LARGEST_NUMBER:g}: the file is damaged")
    return np.where(seen[..., None], positions, np.nan)


def _metres_per_unit(path: Path, parameters: dict[tuple[str, str], _Parameter]) -> float:
    given = parameters.get(("POINT", "UNITS"))
    unit = (given.texts() or [""])[0].lower() if given is not None else ""
    if not unit:
        raise InputError(
            f"{path}: states no unit (POINT:UNITS is missing); export it again with one, or set it "
            "with ezc3d"
        )
    if unit not in METRES_PER_UNIT:
        known = ", ".join(METRES_PER_UNIT)
        raise InputError(f"{path}: POINT:UNITS is {unit[:20]!r}, must be one of {known}")
    return METRES_PER_UNIT[unit]


def _grid(times_s: Array) -> tuple[float, int]:
    """Rate and number of the first frame (from 0) of uniform times."""
    steps = np.diff(times_s)
    rate = float(1.0 / np.mean(steps)) if len(steps) else 1.0
    rate = round(rate, 6)
    first = round(float(times_s[0]) * rate)
    error = np.abs((first + np.arange(len(times_s))) / rate - times_s).max()
    if error > 0.01 / rate or first < 0 or first + len(times_s) >= FULL_COUNT:
        raise ValueError(
            f"times_s: up to {error:.3g} s off the frames of {rate:g} Hz; C3D holds up to "
            f"{FULL_COUNT} uniform frames: resample or shorten the recording"
        )
    return rate, first
