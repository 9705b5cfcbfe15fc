"""Forces that stand in for a wrong number of the file, on an independent integrator's runs."""

import pytest

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
