"""Forces that stand in for a wrong number of the file, on an independent integrator's runs."""

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.ident.diagnose.answer import not_the_cause
from freeswing.ident.diagnose.answer.not_the_cause import gravity_unasked
from freeswing.ident.diagnose.diagnose import diagnose
from freeswing.session.load_swings import load_robot, load_swings, load_target
from freeswing.session.session_file import read_session
from tests.oracle.recorded.sessions import make_session


@pytest.mark.slow
def test_a_clock_at_another_rate_is_asked_for_before_a_tether(tmp_path) -> None:
    """0.3 % fast: a tether of no stiffness that pulls upwards was accepted (1 - 1e-9)."""
    make_session(tmp_path, 7, "three-cable", {"clock_rate": "medium"})
    session = read_session(tmp_path)
    robot = load_robot(session)
    runs = list(load_swings(session, robot, load_target(session)))
    found = diagnose(runs, robot, candidates=("tether", "translational_drag"))
    told = found.document()
    assert told["accepted"] == []
    assert told["unexplained"]["present"]
    assert "stamps' clock ran 0.3" in told["unexplained"]["signature"], told["unexplained"]


@pytest.mark.slow
def test_a_clock_at_another_rate_is_asked_for_where_nothing_was_accepted(tmp_path) -> None:
    make_session(tmp_path, 8, "three-cable", {"clock_rate": "large"})
    session = read_session(tmp_path)
    robot = load_robot(session)
    runs = list(load_swings(session, robot, load_target(session)))
    told = diagnose(runs, robot, candidates=("translational_drag",)).document()
    assert told["accepted"] == []
    assert "too fast: check the frame rate" in told["unexplained"]["signature"], told["unexplained"]


@pytest.mark.parametrize(
    ("missing", "surely", "share", "asked"),
    [
        (True, True, 0.76, True),
        (True, True, 0.74, False),
        (True, False, 0.76, False),
        (False, True, 0.76, False),
    ],
)
def test_gravity_is_named_where_it_says_what_is_left(
    monkeypatch, missing, surely, share, asked
) -> None:
    """Surely, three quarters of it, and only where something is missing."""
    fit = SimpleNamespace(values=np.array([-0.006]))
    found = SimpleNamespace(fit=fit, values_of=lambda _: [0], score=None)
    monkeypatch.setattr(not_the_cause, "_under_other_gravity", lambda *_: found if surely else None)
    judged = SimpleNamespace(share=lambda _: share)
    monkeypatch.setattr(not_the_cause, "left_out", lambda *_: judged)
    settled = SimpleNamespace(by_lengths=True)
    for accepted in ([], [settled]):
        said = gravity_unasked(accepted, None, missing, np.ones(2))  # pyright: ignore[reportArgumentType]
        assert ("gravity were -0.60 %" in said) == asked, said
    force = SimpleNamespace(by_lengths=False)
    assert gravity_unasked([force], None, missing, np.ones(2)) == ""  # pyright: ignore[reportArgumentType]
