"""What is wrong with a film from above, named: no tag, ids twice, sizes, a camera that moved."""

from __future__ import annotations

from itertools import islice

import cv2
import numpy as np
from numpy.typing import NDArray

from freeswing.calib.board.recordings import Recording, read_frames
from freeswing.calib.tags.tag_patterns import tag_dictionary
from freeswing.vision.look.watched_target import Watch

Array = NDArray[np.float64]

_EVERY, _FRAMES = 15, 6
SIZE_OFF = 1.6  # times: paper scaled by a printer is off by a tenth, a mistaken tag by two
ALONG = 0.9  # cosine between where the turning point is and where it should be
LEAST_ARM = 0.5  # of a tag's side: a tag on the turning point tells nothing
LEAST_SAMPLES = 80  # up to six oscillations are 25 numbers: fewer samples leave no step to see
STEP_SHARE = 0.5  # a step must take away half of what oscillations leave
STEP_STDS = 6.0  # and be so many times what is left
LEAST_STEP = 0.05  # of the series' own spread: less is no knock
EDGE = 0.12  # of a run: a step nearer to its ends is told by too few samples


def unseen_text(watch: Watch, recording: Recording, run: str) -> str:
    """Why a run's film shows nothing that is wanted, in a sentence."""
    wanted = ", ".join(f"{family} {number}" for family, number in watch.tags) or "bright dots"
    said = f"run {run}: {recording.path.name}: {wanted} seen in no frame"
    if not watch.tags:
        return (
            f"{said}: dots have to be brighter than all around them and round (white paper or an "
            "LED on a dark plate; a lamp beside the lens for reflecting ones), 4 to 80 px wide"
        )
    found, twice = _ids_seen(watch, recording)
    if twice:
        return f"{said} alone: {', '.join(twice)} is there twice; every tag needs an id of its own"
    if found:
        return f"{said}; there are {', '.join(found)}: correct family and id in target.toml"
    return (
        f"{said}, nor another tag of these families: is the print sharp, lit, not mirrored, with "
        "its white rim, and larger than 25 px?"
    )


def twice_text(watch: Watch, recording: Recording, run: str) -> str | None:
    """A complaint where the film shows one id twice: such tags are left out, unseen otherwise."""
    twice = _ids_seen(watch, recording)[1] if watch.tags else []
    if not twice:
        return None
    return (
        f"run {run}: {recording.path.name} shows {', '.join(twice)} twice: which is meant cannot "
        "be known; print another id for one of them"
    )


def _ids_seen(watch: Watch, recording: Recording) -> tuple[list[str], list[str]]:
    """Ids of the wanted families in some frames: all, and those wanted that are there twice."""
    found: set[str] = set()
    twice: dict[str, int] = {}
    families = {family for family, _ in watch.tags}
    finders = {family: cv2.aruco.ArucoDetector(tag_dictionary(family)) for family in families}
    wanted = {f"{family} {number}" for family, number in watch.tags}
    for _, _, image in islice(read_frames(recording), 0, _EVERY * _FRAMES, _EVERY):
        for family, finder in finders.items():
            ids = finder.detectMarkers(image)[1]
            names = [f"{family} {int(one)}" for one in ([] if ids is None else np.ravel(ids))]
            found |= set(names)
            for name in {one for one in names if names.count(one) > 1} & wanted:
                twice[name] = twice.get(name, 0) + 1
    return sorted(found), sorted(name for name, times in twice.items() if times > 1)


def size_text(poses: Array, middle_m: Array, side_m: float, run: str) -> str | None:
    """A complaint where the platform would turn about a point far from P, as a wrong size has it.

    Yaw turns the platform about a point near the middle of its wires, where P should be. A tag
    that lies an arm away from P moves by this arm times yaw, in the scale of its own size: with a
    wrong size the turning point lands elsewhere on the line through tag and P.

    Args:
        poses: x, y, chi of known frames, (n, 3).
        middle_m: of all that was seen, platform frame, (2,).
        side_m: a tag's side, or the least distance of dots.
        run: its name.

    Source:
        Goldstein, Poole, Safko 2002, Classical Mechanics, sec. 4.9: the instantaneous centre.
    """
    arm = float(np.linalg.norm(middle_m))
    if arm < LEAST_ARM * side_m:
        return None
    chi = poses[:, 2] - poses[:, 2].mean()
    turn = poses[:, 2].mean()
    back = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    moved = (poses[:, :2] - poses[:, :2].mean(axis=0)) @ back.T
    design = np.column_stack([chi, np.ones(len(chi))])
    along = np.linalg.lstsq(design, moved, rcond=None)[0][0]
    # P moves by chi x (P - c): c is where the turning point is, platform frame.
    centre = np.array([-along[1], along[0]])
    found = middle_m - centre  # true arm in the scale of the stated size
    size = float(np.linalg.norm(found))
    if size < 1e-9:
        return None
    ratio = size / arm
    cosine = float(found @ middle_m) / (size * arm)
    if cosine < ALONG or 1.0 / SIZE_OFF < ratio < SIZE_OFF:
        return None
    return (
        f"run {run}: by size_m the tag lies {1e3 * size:.0f} mm from the point about which the "
        f"platform turns, by t_platform_tag_m {1e3 * arm:.0f} mm from P, which should be near it: "
        f"is size_m {ratio:.2g} times what it is (measure the side of the black border)? Else "
        "correct t_platform_tag_m"
    )


def moved_text(times_s: Array, poses: Array, run: str) -> str | None:
    """A complaint where x, y or chi step aside between two times: the camera was moved.

    Oscillations of a few frequencies, growing or fading, about one rest are taken out first.

    Args:
        times_s: (n,).
        poses: x, y, chi, (n, 3), none unknown.
        run: its name.

    Source:
        Andrews 1993, Tests for parameter instability and structural change with unknown change
        point: the largest gain over all times.
    """
    if len(times_s) < LEAST_SAMPLES:
        return None
    base = _oscillations(times_s, poses)
    left = poses - base @ np.linalg.lstsq(base, poses, rcond=None)[0]
    costs = np.sum(left**2, axis=0)
    inside = np.flatnonzero(
        (times_s > times_s[0] + EDGE * np.ptp(times_s))
        & (times_s < times_s[-1] - EDGE * np.ptp(times_s))
    )
    still = costs <= 1e-30
    found: tuple[Array, float, Array] | None = None
    for start in inside[:: max(1, len(inside) // 150)]:
        both = np.column_stack([base, times_s >= times_s[start]])
        answer = np.linalg.lstsq(both, poses, rcond=None)[0]
        left = np.sum((poses - both @ answer) ** 2, axis=0)
        gains = np.where(still, 0.0, 1.0 - left / np.where(still, 1.0, costs))
        if found is None or gains.max() > found[0].max():
            found = (gains, float(times_s[start]), answer[-1])
    if found is None:
        return None
    gains, time_s, step = found
    rest = np.sqrt((1.0 - gains) * costs / len(times_s))
    big = (gains > STEP_SHARE) & (np.abs(step) > STEP_STDS * rest)
    big &= np.abs(step) > LEAST_STEP * poses.std(axis=0)
    if not big.any():
        return None
    return (
        f"run {run}: at {time_s:.2f} s the platform seems to step aside by {1e3 * step[0]:.1f}, "
        f"{1e3 * step[1]:.1f} mm and {1e3 * step[2]:.1f} mrad and to swing on: the camera was "
        "moved. Give the run a window_s before or after that, or film it again from a stand"
    )


def _oscillations(times_s: Array, poses: Array) -> Array:
    """Columns that oscillations about a rest are made of, (n, k)."""
    found: list[float] = []
    apart = 0.1 / float(np.ptp(times_s))  # rates nearer than the search's grid are one
    for series in poses.T:
        left = series - series.mean()
        for _ in range(2):
            rate = _strongest(times_s, left)
            columns = _waves(times_s, rate)
            left = left - columns @ np.linalg.lstsq(columns, left, rcond=None)[0]
            if all(abs(rate - one) > apart for one in found):
                found.append(rate)
    return np.column_stack([np.ones(len(times_s)), *(_waves(times_s, rate) for rate in found)])


def _waves(times_s: Array, rate_hz: float) -> Array:
    phase = 2.0 * np.pi * rate_hz * times_s
    since = 2.0 * (times_s - times_s.mean()) / np.ptp(times_s)
    cos, sin = np.cos(phase), np.sin(phase)
    return np.column_stack([cos, sin, since * cos, since * sin])


def _strongest(times_s: Array, series: Array) -> float:
    """The frequency that carries most of a series, Hz."""
    span = float(np.ptp(times_s))
    rates = np.arange(1.0 / span, min(4.0, 0.3 / float(np.median(np.diff(times_s)))), 0.15 / span)
    waves = np.exp(-2j * np.pi * np.outer(rates, times_s))
    window = np.hanning(len(times_s))
    return float(rates[int(np.argmax(np.abs(waves @ (window * series))))])
