"""One camera's recording of one run, streamed into pieces of sightings."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.board.recordings import Image, Recording, read_frames
from freeswing.calib.camera.camera import Camera
from freeswing.calib.footage.ahead import ahead
from freeswing.calib.footage.copied_frames import WARM_UP, with_copies
from freeswing.calib.footage.frame_times import frame_times, needed
from freeswing.cdpr.files.documents import InputError
from freeswing.vision.look.follow import REPEATED, UNSTAMPED, Follower, FrameView
from freeswing.vision.look.pieces import (
    FRAMES_A_PIECE,
    Piece,
    input_hash,
    is_whole,
    load_piece,
    piece_path,
    restore,
    save_piece,
)
from freeswing.vision.look.watched_target import Watch

Array = NDArray[np.float64]


def collect_sightings(
    folder: Path,
    camera: Camera,
    watch: Watch,
    recording: Recording,
    frame_rate_hz: float | None,
    tell: Callable[[int], None] | None = None,
) -> list[Path]:
    """The pieces of a recording, made where they are not there yet.

    Args:
        folder: where pieces are kept.
        camera: its lens and pose.
        watch: what to look for.
        recording: the frames.
        frame_rate_hz: serves where the recording has no stamps.
        tell: told the number of frames done after each piece.

    Raises:
        InputError: when frames have another size than the camera, or have no stamps.
    """
    stamps = needed(frame_times(recording, frame_rate_hz), recording)
    told = repr((stamps.rate_hz, stamps.stamps)).encode()
    inputs = input_hash(camera, watch, recording, told)
    paths = _existing(folder, camera.name, inputs)
    if paths and len(load_piece(paths[-1]).numbers) < FRAMES_A_PIECE:
        return paths
    done = len(paths) * FRAMES_A_PIECE
    warm_up = min(done, WARM_UP)
    decoded = islice(read_frames(recording), done - warm_up, None)
    frames = ahead(islice(with_copies(decoded), warm_up, None))
    follower: Follower | None = None
    while batch := list(islice(frames, 1)):
        if follower is None:
            follower = Follower(camera, watch)
            if paths:
                restore(follower, paths[-1])
        numbers: list[int] = []
        times: list[float] = []
        views: list[FrameView] = []
        while batch:
            (number, label, image), is_copy = batch.pop()
            _check_size(camera, label, image)
            time_s = stamps.at(number)
            views.append(_view(follower, image, time_s, is_copy=is_copy))
            numbers.append(number)
            times.append(time_s)
            if len(numbers) < FRAMES_A_PIECE:
                batch = list(islice(frames, 1))
        path = piece_path(folder, camera.name, inputs, len(paths))
        save_piece(path, Piece.of(numbers, times, views), follower)
        paths.append(path)
        if tell is not None:
            tell((len(paths) - 1) * FRAMES_A_PIECE + len(numbers))
    return paths


def _existing(folder: Path, camera: str, inputs: str) -> list[Path]:
    paths: list[Path] = []
    while is_whole(path := piece_path(folder, camera, inputs, len(paths))):
        paths.append(path)
    return paths


def _view(follower: Follower, image: Image, time_s: float, *, is_copy: bool) -> FrameView:
    if not np.isfinite(time_s):
        return FrameView(UNSTAMPED, (), None)
    if is_copy:
        return FrameView(REPEATED, (), None)
    return follower.look(image, time_s)


def _check_size(camera: Camera, label: str, image: Image) -> None:
    height, width = image.shape
    if (width, height) != camera.size_px:
        raise InputError(
            f"{label}: {width} x {height} pixels, but cameras.toml has {camera.size_px[0]} x "
            f"{camera.size_px[1]} for {camera.name}: calibrate at the size that is recorded"
        )
