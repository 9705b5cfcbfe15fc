"""Pulleys that robot.toml gives otherwise than they are: named by lengths that winches keep."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import POSE_COORDINATES, Cable, Robot
from freeswing.doctor.robot_file import mistaken_cables as room
from freeswing.doctor.robot_file.mistaken_cables import mistaken_cables, refuse_mistaken_cables
from freeswing.ident.runs import SwingRun
from tests.ident.swings import PAPER_LENGTHS_M, paper_model, recorded, tilted_release

ROBOT = paper_model().robot
NAMES = ", ".join(cable.name for cable in ROBOT.cables)


@cache
def swings() -> tuple[SwingRun, ...]:
    """Four runs at 0.1 mm of noise."""
    generator, runs = np.random.default_rng(8), []
    for k in (2, 5, 7, 9):
        motion = tilted_release(build_model(ROBOT), PAPER_LENGTHS_M[k], 0.1, 3.0)
        run = recorded(motion, f"swing-{k}", generator, 1e-4, POSE_COORDINATES, "identify")
        runs.append(replace(run, lengths_m=PAPER_LENGTHS_M[k], lengths_std_m=5e-4))
    return tuple(runs)


def with_cables(of: Callable[[int, Cable], Cable]) -> Robot:
    return replace(ROBOT, cables=tuple(of(k, one) for k, one in enumerate(ROBOT.cables)))


def radii(factor: float, *cables: int) -> Robot:
    """The robot with other radii for some of its cables."""
    radius = factor * ROBOT.cables[0].pulley_radius_m
    return with_cables(lambda k, one: replace(one, pulley_radius_m=radius) if k in cables else one)


def turned(k: int, cable: Cable) -> Cable:
    """Its swivel axis stands a quarter turn off."""
    if k != 1:
        return cable
    return replace(cable, swivel_y=cable.swivel_z, swivel_z=-cable.swivel_y)


@pytest.mark.parametrize(
    ("robot", "said", "cables"),
    [
        (radii(2.0, 0, 1, 2, 3), "has the diameter for the pulley's radius", f"cables {NAMES}"),
        (radii(0.5, 0, 1, 2, 3), "has half of the pulley's radius", f"cables {NAMES}"),
        (radii(2.0, 2), "has the diameter for the pulley's radius", "cable 3"),
        (with_cables(turned), "swivel frame turned by 90 degrees about its own x", "cable 2"),
    ],
)
def test_each_is_named(robot: Robot, said: str, cables: str) -> None:
    told, remedy = mistaken_cables(swings(), robot)
    assert said in told, told
    assert f"({cables})" in told, told
    with pytest.raises(DataError, match="locked winches keep"):
        refuse_mistaken_cables(swings(), robot)
    assert ("pulley_radius_m" in remedy) == ("radius" in said), remedy


def test_what_is_right_or_wrong_otherwise_is_not_named() -> None:
    """Nor what too few runs tell, runs without poses, or lengths as stated contradict."""
    refuse_mistaken_cables(swings(), ROBOT)
    off = np.array([0.012, -0.012, 0.01])
    attached = with_cables(lambda _, one: replace(one, attachment_m=one.attachment_m + off))
    assert mistaken_cables(swings(), attached) == ("", "")
    double = radii(2.0, 0, 1, 2, 3)
    assert mistaken_cables(swings()[:3], double)[0]
    assert mistaken_cables(swings()[:2], double) == ("", "")
    free = tuple(replace(one, trajectory=one.trajectory.select(("x", "y"))) for one in swings())
    assert mistaken_cables(free, double) == ("", "")
    model = build_model(double)
    poses = [one.trajectory.values.mean(axis=0) for one in swings()]
    as_double = [np.asarray(model.lengths(pose, model.start_values)).ravel() for pose in poses]
    contradicting = tuple(
        replace(one, lengths_m=lengths) for one, lengths in zip(swings(), as_double, strict=True)
    )
    assert mistaken_cables(contradicting, double) == ("", "")


@pytest.mark.parametrize(
    ("beyond", "left", "named"),
    [(1.05, 0.0, True), (0.95, 0.0, False), (4.0, 0.35, True), (4.0, 0.37, False)],
)
def test_how_much_lengths_change_and_what_may_be_left(monkeypatch, beyond, left, named) -> None:
    """As much as the noise of means; three tenths of it rms, 0.36 of 4."""
    one, none = np.ones(ROBOT.n_cables), np.zeros(ROBOT.n_cables)

    def changes(_runs, robot: Robot):
        is_half = robot.radii_m[0] < 0.75 * ROBOT.radii_m[0]
        found = left if is_half else beyond
        return room._Changes(found * one, one, none)

    monkeypatch.setattr(room, "_changes", changes)
    assert bool(mistaken_cables(swings(), ROBOT)[0]) == named


def test_too_short_runs_are_not_asked() -> None:
    """Twenty means of a tenth of a second, of which three runs tell enough."""
    robot = radii(2.0, 0, 1, 2, 3)
    for length_s, named in ((2.2, True), (1.8, False)):
        short = [replace(one, window_s=(0.0, length_s)) for one in swings()]
        assert bool(mistaken_cables(short, robot)[0]) == named, length_s
