"""Runs the detectors over calibration recordings and lines the cameras' frames up in time."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from calib.board_detection import BoardDetector
from calib.boards import Board
from calib.camera_models import Array
from calib.recordings import Recording, read_frames, stamps_of
from calib.views import Views, make_views

Progress = Callable[[str, float], None]

MOST_FRAMES = 600
BURST = 5
LEAST_FLOW = 9
_WORKERS = 2


@dataclass(frozen=True, slots=True)
class Sightings:
    """The board in one camera's recording.

    Attributes:
        name: the camera.
        size_px: width and height.
        n_frames: frames in the recording.
        numbers: frames with the board, (n,).
        stamps_s: their stamps by the camera's own clock, NaN when unknown, (n,).
        labels: how a person finds them, (n,).
        pixels: corners, NaN where unseen, (n, n_points, 2).
        std_px: what the detector says of each corner's noise, (n, n_points).
        still_frames: a few images spread over the recording, for what does not move.
    """

    name: str
    size_px: tuple[int, int]
    n_frames: int
    numbers: np.ndarray
    stamps_s: Array
    labels: tuple[str, ...]
    pixels: Array
    std_px: Array
    still_frames: tuple[np.ndarray, ...] = ()


def see_boards(
    recordings: Iterable[Recording],
    board: Board,
    frame_rate_hz: float | None,
    n_still: int = 0,
    progress: Progress | None = None,
) -> tuple[Sightings, ...]:
    """Detect the board in every recording, cameras side by side.

    Recordings of more than `MOST_FRAMES` frames are searched in bursts of `BURST` frames spread
    evenly, so that image velocities stay available.
    """
    recordings = tuple(recordings)
    done = [0]

    def run(recording: Recording) -> Sightings:
        result = _see_board(recording, board, frame_rate_hz, n_still)
        done[0] += 1
        if progress is not None:
            progress(f"board in {recording.name}", done[0] / len(recordings))
        return result

    with ThreadPoolExecutor(_WORKERS) as pool:
        return tuple(pool.map(run, recordings))


def _see_board(
    recording: Recording, board: Board, frame_rate_hz: float | None, n_still: int
) -> Sightings:
    count = len(recording.images) or _count_frames(recording)
    wanted = _wanted(count)
    still_at = set(np.linspace(0, count - 1, n_still).round().astype(int)) if n_still else set()
    detector = BoardDetector(board)
    numbers, labels, pixels, stills, size = [], [], [], [], (0, 0)
    for position, (number, label, image) in enumerate(read_frames(recording)):
        size = (image.shape[1], image.shape[0])
        if position in still_at:
            stills.append(image)
        if position not in wanted:
            continue
        corners = detector.detect(image)
        if corners is not None:
            numbers.append(number)
            labels.append(label)
            pixels.append(corners)
    found = np.array(numbers, dtype=int)
    stack = np.array(pixels) if pixels else np.zeros((0, len(board.points_m), 3))
    stamps = stamps_of(recording, found, frame_rate_hz)
    return Sightings(
        recording.name,
        size,
        count,
        found,
        stamps,
        tuple(labels),
        stack[..., :2],
        stack[..., 2],
        tuple(stills),
    )


def _count_frames(recording: Recording) -> int:
    """Frames of a video: from its header where it is believable, else by decoding it."""
    import av

    with av.open(str(recording.path)) as container:
        return sum(1 for packet in container.demux(video=0) if packet.size)


def _wanted(count: int) -> set[int]:
    if count <= MOST_FRAMES:
        return set(range(count))
    starts = np.linspace(0, count - BURST, MOST_FRAMES // BURST).round().astype(int)
    return {int(start + k) for start in starts for k in range(BURST)}


def velocities(sightings: Sightings) -> Array:
    """Image velocity of every corner in px/s, NaN where the frames around do not tell.

    Five-point stencil where four neighbours exist, else the central difference; a neighbour that
    does not continue the motion (a cut, a new pose) gives no velocity. The moving plane's smooth
    flow is then fitted to each view, which fills corners that a neighbour lost. (n, n_points, 2).
    """
    at = {int(number): row for row, number in enumerate(sightings.numbers)}
    pixels, stamps = sightings.pixels, sightings.stamps_s
    result = np.full(pixels.shape, np.nan)
    for number, row in at.items():
        before, after = at.get(number - 1), at.get(number + 1)
        if before is None or after is None:
            continue
        span = stamps[after] - stamps[before]
        ahead, behind = pixels[after] - pixels[row], pixels[row] - pixels[before]
        if not (span > 0.0 and _continues(ahead, behind)):
            continue
        near = (pixels[after] - pixels[before]) / span
        two_before, two_after = at.get(number - 2), at.get(number + 2)
        if two_before is not None and two_after is not None:
            span = stamps[two_after] - stamps[two_before]
            wide = (pixels[two_after] - pixels[two_before]) / span
            finer = (4.0 * near - wide) / 3.0
            smooth = np.abs(wide - near) < 0.3 * np.abs(near) + 6.0 / span
            if np.where(np.isfinite(finer), smooth, True).all():
                near = finer if np.isfinite(finer[:, 0]).sum() >= LEAST_FLOW else near
        result[row] = _plane_flow(pixels[row], near)
    return result


def _plane_flow(pixels: Array, velocity: Array) -> Array:
    """Velocity of all seen corners by a quadratic field fitted to the known ones; NaN if too few.

    The image velocity of a moving plane is a quadratic in the pixel (Longuet-Higgins 1984).
    """
    known = np.isfinite(velocity[:, 0] + pixels[:, 0])
    if known.sum() < LEAST_FLOW:
        return np.full_like(velocity, np.nan)
    scaled = (pixels - np.nanmean(pixels, axis=0)) / np.nanstd(pixels, axis=0)
    x, y = scaled[:, 0], scaled[:, 1]
    basis = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)
    weights, *_ = np.linalg.lstsq(basis[known], velocity[known], rcond=None)
    return np.asarray(basis @ weights, dtype=np.float64)


def _continues(ahead: Array, behind: Array) -> bool:
    """Whether three frames show one smooth motion: the bend is small beside the step."""
    bend = np.linalg.norm(ahead - behind, axis=-1)
    step = np.linalg.norm(ahead + behind, axis=-1)
    known = np.isfinite(bend)
    if known.sum() < LEAST_FLOW:
        return False
    return bool(np.median(bend[known]) < 0.35 * np.median(step[known]) + 1.0)


def gather(
    all_sightings: tuple[Sightings, ...],
    frame_rate_hz: float | None,
    offsets_s: Array | None = None,
) -> tuple[Views, Array]:
    """Put simultaneous frames of the cameras together.

    Frames are matched by stamps to within half a frame where every camera has its own stamps,
    else by frame number.

    Args:
        all_sightings: one a camera.
        frame_rate_hz: nominal rate, None when unknown.
        offsets_s: what is known of each camera's clock offset, zero when None.

    Returns:
        The views, and the base time of every moment, NaN when stamps are unknown, (n_moments,).
        A view's lag is its own stamp minus that time, so it holds the clock offset too.
    """
    stamped = all(np.isfinite(s.stamps_s).all() for s in all_sightings)
    offsets = np.zeros(len(all_sightings)) if offsets_s is None or not stamped else offsets_s
    keys = [
        s.stamps_s + offset if stamped else s.numbers.astype(float)
        for s, offset in zip(all_sightings, offsets, strict=True)
    ]
    joined = np.concatenate(keys) if keys else np.zeros(0)
    reach = 0.5 / frame_rate_hz if stamped and frame_rate_hz else _half_step(keys)
    order = np.argsort(joined, kind="stable")
    group = np.zeros(len(joined), dtype=int)
    start, current = -np.inf, -1
    for index in order:
        if joined[index] - start > reach:
            start, current = joined[index], current + 1
        group[index] = current
    count = current + 1
    times = np.bincount(group, joined, count) / np.maximum(np.bincount(group, minlength=count), 1)
    camera = np.repeat(np.arange(len(keys)), [len(key) for key in keys])
    lag = joined - offsets[camera] - times[group] if stamped else np.zeros(len(joined))
    _, first = np.unique(np.stack([camera, group]), axis=1, return_index=True)
    views = make_views(
        camera,
        group,
        np.concatenate([s.pixels for s in all_sightings]),
        np.concatenate([velocities(s) for s in all_sightings]),
        lag,
        tuple(label for s in all_sightings for label in s.labels),
        np.concatenate([s.std_px for s in all_sightings]),
    ).select(np.arange(len(first)))
    return views, times if stamped else np.full(count, np.nan)


def _half_step(keys: list[Array]) -> float:
    steps = [np.diff(np.sort(key)) for key in keys]
    joined = np.concatenate(steps) if steps else np.zeros(0)
    return 0.45 * float(joined[joined > 0.0].min()) if (joined > 0.0).any() else 0.45
