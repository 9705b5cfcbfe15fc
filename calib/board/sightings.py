"""Runs the detectors over calibration recordings and lines the cameras' frames up in time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from freeswing.calib.board.board_corners import BoardCorners, BoardDetector
from freeswing.calib.board.board_unlike_seen import corners_in_a_mirror
from freeswing.calib.board.declared_board import Board
from freeswing.calib.board.kept_boards import KeptBoards
from freeswing.calib.board.motion_cuts import smoothness
from freeswing.calib.board.motion_pieces import Timeline, linked, timeline
from freeswing.calib.board.platform_as_board import PlatformDetector, PlatformTags
from freeswing.calib.board.recordings import Recording, read_frames
from freeswing.calib.board.searched_frames import in_bursts, middle_frames
from freeswing.calib.camera.lens_models import Array
from freeswing.calib.footage.frame_times import frame_times
from freeswing.calib.rig.views import Views, make_views
from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.system.progress import Progress

_WORKERS = 2
_LOOKED_AT_AGAIN, _EVERY = 6, 5


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
        covariance_px2: what the detector says of their noise, by groups of corners found
            together, (n, n_groups, 2 c, 2 c).
        border_cells: width of the border of the board's tags as found.
        still_frames: a few images spread over the recording, for what does not move.
    """

    name: str
    size_px: tuple[int, int]
    n_frames: int
    numbers: np.ndarray
    stamps_s: Array
    labels: tuple[str, ...]
    pixels: Array
    covariance_px2: Array
    border_cells: int = 1
    still_frames: tuple[np.ndarray, ...] = ()


def see_boards(
    recordings: Iterable[Recording],
    board: Board,
    frame_rate_hz: float | None,
    n_still: int = 0,
    progress: Progress | None = None,
    kept: Path | None = None,
) -> tuple[Sightings, ...]:
    """Detect the board in every recording, cameras side by side.

    Recordings of more than `MOST_FRAMES` frames are searched in bursts of `BURST` frames spread
    evenly, so that image velocities stay available. What was found stays in the folder `kept` and
    is not looked for again.
    """
    recordings = tuple(recordings)
    done = np.zeros(len(recordings))

    def run(index: int) -> Sightings:
        def told(share: float) -> None:
            done[index] = share
            if progress is not None:
                progress(f"board in {recordings[index].name}", float(done.mean()))

        detector = BoardDetector(board)
        return _see(recordings[index], detector, frame_rate_hz, n_still, kept, told)

    with ThreadPoolExecutor(_WORKERS) as pool:
        return tuple(pool.map(run, range(len(recordings))))


def see_platform(
    recordings: Mapping[str, Recording],
    cameras: Iterable[tuple[str, tuple[int, int]]],
    tags: PlatformTags,
    frame_rate_hz: float | None,
    progress: Progress | None = None,
    kept: Path | None = None,
) -> tuple[Sightings, ...]:
    """The platform's tags in one run, camera by camera; nothing where a camera has no recording.

    Of more than `MOST_FRAMES` frames those in the middle are looked at, without gaps.
    """
    cameras = tuple(cameras)
    blank = PlatformDetector(tags).nothing()

    def run(index: int) -> Sightings:
        name, size_px = cameras[index]

        def told(share: float) -> None:
            if progress is not None:
                progress(f"platform in {name}", (index + share) / len(cameras))

        recording = recordings.get(name)
        if recording is None:
            none = np.zeros(0)
            pixels, noise = blank.pixels[None][:0], blank.covariance_px2[None][:0]
            return Sightings(name, size_px, 0, none.astype(int), none, (), pixels, noise)
        return _see(recording, PlatformDetector(tags), frame_rate_hz, 0, kept, told)

    with ThreadPoolExecutor(_WORKERS) as pool:
        return tuple(pool.map(run, range(len(cameras))))


def _see(
    recording: Recording,
    detector: BoardDetector | PlatformDetector,
    frame_rate_hz: float | None,
    n_still: int,
    kept: Path | None,
    told: Callable[[float], None],
) -> Sightings:
    count = len(recording.images) or _count_frames(recording)
    wanted = in_bursts(count) if isinstance(detector, BoardDetector) else middle_frames(count)
    still_at = set(np.linspace(0, count - 1, n_still).round().astype(int)) if n_still else set()
    boards = KeptBoards(detector, kept, recording, len(wanted))
    doubtful: list[np.ndarray] = []  # some images that show half of the board at the most
    numbers, labels, found, stills, size = [], [], [], [], (0, 0)
    for position, (number, label, image) in enumerate(read_frames(recording)):
        size = (image.shape[1], image.shape[0])
        if position in still_at:
            stills.append(image)
        if position not in wanted:
            continue
        corners = boards.look(image)
        if detector.other_board is not None:
            raise DataError(f"{recording.path}: {detector.other_board}")
        told((position + 1) / max(count, 1))
        if corners is not None:
            numbers.append(number)
            labels.append(label)
            found.append(corners)
        if len(doubtful) < _LOOKED_AT_AGAIN and position % _EVERY == 0 and _is_part(corners):
            doubtful.append(image)
    if all(map(_is_part, found)):
        _refuse_mirrored(recording, detector, doubtful)
    frames = np.array(numbers, dtype=int)
    empty = detector.nothing()
    return Sightings(
        recording.name,
        size,
        count,
        frames,
        frame_times(recording, frame_rate_hz).of(frames),
        tuple(labels),
        np.stack([empty.pixels, *(corners.pixels for corners in found)])[1:],
        np.stack([empty.covariance_px2, *(corners.covariance_px2 for corners in found)])[1:],
        detector.border_cells,
        tuple(stills),
    )


def _is_part(corners: BoardCorners | None) -> bool:
    """Whether an image shows half of a board at the most."""
    return corners is None or 2 * corners.count <= len(corners.pixels)


def _refuse_mirrored(
    recording: Recording, detector: BoardDetector | PlatformDetector, images: list[np.ndarray]
) -> None:
    """Passes images that show no more of the board in a mirror than they do without.

    Markers of small dictionaries are taken for others in a mirror: some corners are found then too.

    Raises:
        DataError: where they show more.
    """
    board = detector.board
    if not (isinstance(board, Board) and board.has_tags):
        return
    plain = (detector.detect(image) for image in images)
    corners = sum(one.count for one in plain if one is not None)
    if corners_in_a_mirror(board, images) > corners:
        raise DataError(
            f"{recording.path}: shows the board's mirrored image: its pictures are flipped, or the "
            "board is seen through its back. Record without a mirror"
        )


def _count_frames(recording: Recording) -> int:
    """Frames of a video: from its header where it is believable, else by decoding it."""
    import av

    with av.open(str(recording.path)) as container:
        return sum(1 for packet in container.demux(video=0) if packet.size)


@dataclass(frozen=True, slots=True)
class Gathered:
    """Simultaneous frames of the cameras put together.

    Attributes:
        views: the sightings; a view's lag is its own stamp minus its moment's base time, so it
            holds the clock offset too.
        line: the moments' base times and the pieces of smooth motion; None without stamps.
        speed_px_s: image speed of the board in each view, 0 where unknown, (n_views,).
    """

    views: Views
    line: Timeline | None
    speed_px_s: Array


def gather(
    all_sightings: tuple[Sightings, ...],
    frame_rate_hz: float | None,
    offsets_s: Array | None = None,
) -> Gathered:
    """Put simultaneous frames of the cameras together.

    Frames are matched by stamps to within half a frame where every camera has its own stamps,
    else by frame number.

    Args:
        all_sightings: one a camera.
        frame_rate_hz: nominal rate, None when unknown.
        offsets_s: what is known of each camera's clock offset, zero when None.
    """
    stamped = all(np.isfinite(s.stamps_s).all() for s in all_sightings)
    offsets = np.zeros(len(all_sightings)) if offsets_s is None or not stamped else offsets_s
    keys = [
        s.stamps_s + offset if stamped else s.numbers.astype(float)
        for s, offset in zip(all_sightings, offsets, strict=True)
    ]
    joined = np.concatenate(keys) if keys else np.zeros(0)
    group, times = _moments(keys, _reach(all_sightings, keys, frame_rate_hz))
    camera = np.repeat(np.arange(len(keys)), [len(key) for key in keys])
    moves = [smoothness(s.pixels, s.stamps_s, s.numbers) for s in all_sightings]
    _, first = np.unique(np.stack([camera, group]), axis=1, return_index=True)
    first = np.sort(first)
    lag = joined - offsets[camera] - times[group] if stamped else np.zeros(len(joined))
    views = make_views(
        camera[first],
        group[first],
        np.concatenate([s.pixels for s in all_sightings])[first],
        lag[first],
        tuple(np.array([label for s in all_sightings for label in s.labels])[first].tolist()),
        np.concatenate([s.covariance_px2 for s in all_sightings])[first],
    )
    speed = np.concatenate([speed for _, speed in moves])[first]
    if not stamped:
        return Gathered(views, None, speed)
    smooth = np.concatenate([smooth for smooth, _ in moves])
    goes_on = np.bincount(group, smooth > 0, len(times)) > 0
    goes_on &= np.bincount(group, smooth < 0, len(times)) == 0
    line = timeline(times, linked(times, goes_on, 2.0 * _half_step(keys)))
    return Gathered(views, line, speed)


def _reach(
    all_sightings: tuple[Sightings, ...], keys: list[Array], frame_rate_hz: float | None
) -> float:
    """How far apart two cameras' frames of one moment may be."""
    stamped = all(np.isfinite(s.stamps_s).all() for s in all_sightings)
    return 0.5 / frame_rate_hz if stamped and frame_rate_hz else _half_step(keys)


def _moments(keys: list[Array], reach: float) -> tuple[np.ndarray, Array]:
    """Moment of each frame, camera after camera, and each moment's mean time.

    The first camera's frames are moments; another camera's frame joins the nearest moment within
    reach, or is one of its own.
    """
    times = np.zeros(0)
    group = np.zeros(0, dtype=int)
    for key in keys:
        order = np.argsort(times, kind="stable")
        own = len(times) + np.arange(len(key))
        if len(times):
            right = np.clip(np.searchsorted(times[order], key), 1, max(len(times) - 1, 1))
            beside = order[np.stack([right - 1, np.minimum(right, len(times) - 1)])]
            nearest = beside[np.abs(times[beside] - key).argmin(axis=0), np.arange(len(key))]
            own = np.where(np.abs(times[nearest] - key) <= reach, nearest, own)
        new = np.unique(own[own >= len(times)])
        renumbered = len(times) + np.searchsorted(new, own)
        times = np.concatenate([times, key[new - len(times)]])
        group = np.concatenate([group, np.where(own < len(times) - len(new), own, renumbered)])
    joined = np.concatenate(keys) if keys else times
    mean = np.bincount(group, joined, len(times)) / np.bincount(group, minlength=len(times))
    place = np.empty(len(times), dtype=int)
    place[np.argsort(mean, kind="stable")] = np.arange(len(times))
    return place[group], np.sort(mean)


def _half_step(keys: list[Array]) -> float:
    steps = [np.diff(np.sort(key)) for key in keys]
    joined = np.concatenate(steps) if steps else np.zeros(0)
    return 0.45 * float(joined[joined > 0.0].min()) if (joined > 0.0).any() else 0.45
