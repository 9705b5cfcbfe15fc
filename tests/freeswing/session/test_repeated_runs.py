"""A recording given twice is refused; noise makes every other pair of recordings different."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.main import main
from freeswing.session.repeated_runs import SHARED, STRETCH, share_samples


def swing(seed: int, count: int = 200, digits: int = 9) -> Trajectory:
    times = 0.01 * np.arange(count)
    noise = 1e-4 * np.random.default_rng(seed).normal(size=(count, 1))
    return Trajectory(times, ("chi",), np.round(0.1 * np.sin(4.0 * times)[:, None] + noise, digits))


def joined(first: Trajectory, share: float) -> Trajectory:
    """A run of which about so many stretches are another run's."""
    count = len(first)
    kept = round(share * (count - STRETCH + 1)) + STRETCH - 1
    values = np.concatenate([first.values[:kept], swing(9).values[kept:]])
    return Trajectory(first.times_s + 7.0, first.coordinates, values)


def test_the_limit_from_both_sides() -> None:
    first = swing(1)
    assert share_samples(first, joined(first, SHARED + 0.02))
    assert not share_samples(first, joined(first, SHARED - 0.02))


@pytest.mark.parametrize("digits", [9, 4])
def test_two_recordings_of_the_same_motion_are_two(digits: int) -> None:
    assert not share_samples(swing(1, digits=digits), swing(2, digits=digits))


@pytest.mark.parametrize("role", ["identify", "validate"])
def test_a_copy_is_refused_by_name(
    session: Path, role: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = session / "session.toml"
    copy = f'\n[[runs]]\nname = "again"\nrole = "{role}"\ntrajectory = "runs/again.csv"\n'
    path.write_text(path.read_text(encoding="utf-8") + copy, encoding="utf-8")
    (session / "runs" / "again.csv").write_bytes((session / "runs" / "swing-01.csv").read_bytes())
    for command in ("identify", "diagnose"):
        assert main([command, str(session)]) == 1
        assert "runs swing-01 and again hold the same samples" in capsys.readouterr().err
    assert main(["check", str(session)]) == 1
    assert "runs swing-01 and again are the same recording" in capsys.readouterr().out
