"""Flags that several commands share."""

from __future__ import annotations

import math
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from argparse import _ArgumentGroup
    from contextlib import AbstractContextManager

    from freeswing.cdpr.driven.record import Instruments
    from freeswing.session.session_file import Session
    from freeswing.workers.crew import Crew

MOST_WORKERS = 1024  # more processes than any machine's cores: a mistyped number


def add_session(parser: ArgumentParser) -> None:
    """The session and where its results go."""
    parser.add_argument("session", metavar="SESSION", help="a session's folder or session.toml")
    add_results(parser, "SESSION/results")


def add_robot(parser: ArgumentParser, needs: str = "") -> None:
    """The robot's file, or the folder that holds it, and what must stand in it."""
    parser.add_argument(
        "robot", metavar="ROBOT", type=_robot, help=f"robot.toml{needs}, or its folder"
    )


def _robot(text: str) -> Path:
    from freeswing.cdpr.files.robot_file import robot_path

    return robot_path(text)


def add_results(parser: ArgumentParser, usual: str) -> None:
    """Where results go."""
    text = f"write everything to DIR instead of {usual} (for read-only folders)"
    parser.add_argument("--results", metavar="DIR", help=text)


def add_workers(parser: ArgumentParser) -> None:
    """Who works side by side."""
    parser.add_argument(
        "--workers", type=worker_count, default=0, metavar="N", help="processes; default one a core"
    )
    parser.add_argument(
        "--cluster",
        metavar="ADDRESS",
        help="hand recordings and refits to the Dask cluster whose scheduler is there",
    )


def add_effects(parser: ArgumentParser, name: str, asked: str, numbers: str) -> None:
    """--effect and --set: how an effect is named, and what naming it and its numbers does."""
    parser.add_argument("--effect", action="append", default=[], metavar=name, help=asked)
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        type=setting,
        metavar="PARAMETER=VALUE",
        help=numbers,
    )


def refuse_given(options: Namespace, names: Sequence[str], why: str) -> None:
    """Refuse flags that would do nothing.

    Args:
        options: as parsed; a flag that was not given is None, empty or False.
        names: of those that do nothing here.
        why: they do not.

    Raises:
        InputError: naming those that were given.
    """
    from freeswing.cdpr.files.documents import InputError

    asked = [(name, getattr(options, name)) for name in names]
    given = [
        f"--{name.replace('_', '-')}"
        for name, value in asked
        if value is not None and value is not False and value not in ((), [])
    ]
    if given:
        raise InputError(f"{', '.join(given)}: {why}; leave it out")


def worker_count(text: str) -> int:
    """A number of processes, at least one."""
    count = int(text) if text.strip().isdecimal() else 0
    if not 1 <= count <= MOST_WORKERS:
        raise ArgumentTypeError(
            f"{text!r}: give 1 to {MOST_WORKERS}, or leave it out for all cores"
        )
    return count


def whole(text: str) -> int:
    """A whole number, zero or above."""
    if not text.strip().isdecimal():
        raise ArgumentTypeError(f"{text!r}: give a whole number, 0 or above")
    return int(text)


def positive_whole(text: str) -> int:
    """A whole number above zero."""
    if whole(text) == 0:
        raise ArgumentTypeError(f"{text!r}: give a whole number above 0")
    return int(text)


def finite(text: str) -> float:
    """A number that is one."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ArgumentTypeError(f"{text!r}: give a finite number")
    return value


def positive(text: str) -> float:
    """A finite number above zero."""
    try:
        value = finite(text)
    except ArgumentTypeError:
        value = 0.0
    if value <= 0.0:
        raise ArgumentTypeError(f"{text!r}: give a finite number above 0")
    return value


def not_negative(text: str) -> float:
    """A finite number, zero or above."""
    return 0.0 if text.strip() in ("0", "0.0") else positive(text)


def open_session(options: Namespace) -> Session:
    """The session that the flags of `add_session` name.

    Raises:
        InputError: also for a driven robot's session, which other commands take.
    """
    from freeswing.cdpr.files.problems import InputError
    from freeswing.session.drive_session import drive_path
    from freeswing.session.session_file import read_session

    session, results = options.session, options.results
    driven = drive_path(session)
    if driven is not None:
        raise InputError(
            f"{driven}: a driven robot's session; drive, check, diagnose, export and run take it"
        )
    if getattr(options, "cluster", None):  # whose workers start in other folders
        session, results = Path(session).resolve(), results and Path(results).resolve()
    return read_session(session, results)


def crew_of(options: Namespace, session: Session) -> AbstractContextManager[Crew]:
    """Those whom the flags of `add_workers` name."""
    from freeswing.workers.crew import crew_for

    return crew_for(session, options.workers, options.cluster)


def setting(text: str) -> tuple[str, float]:
    """PARAMETER=VALUE as the two."""
    name, _, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError:
        raise ArgumentTypeError(f"{text!r} is not PARAMETER=VALUE") from None


def add_instruments(
    group: _ArgumentGroup,
    *,
    latency_s: float = 0.0,
    encoder_step_rad: float = 0.0,
    current_noise_a: float = 0.0,
) -> None:
    """How a driven robot is measured; a number whose default is not zero may not be zero."""
    step = positive if encoder_step_rad else not_negative
    current = positive if current_noise_a else not_negative
    group.add_argument("--pose-rate-hz", type=positive, default=200.0, help="default 200")
    group.add_argument("--latency-s", type=not_negative, default=latency_s, help="of the poses")
    group.add_argument("--encoder-step-rad", type=step, default=encoder_step_rad)
    group.add_argument("--current-noise-a", type=current, default=current_noise_a)


def instruments_of(options: Namespace) -> Instruments:
    """What the flags of `add_instruments` and of poses' noise say."""
    from freeswing.cdpr.driven.record import Instruments

    return Instruments(
        pose_rate_hz=options.pose_rate_hz,
        latency_s=options.latency_s,
        position_std_m=options.noise_m,
        angle_std_rad=options.noise_rad,
        encoder_step_rad=options.encoder_step_rad,
        current_std_A=options.current_noise_a,
    )
