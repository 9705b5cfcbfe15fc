"""Elastic cables: slack, and the rigid model as their limit."""

import numpy as np
import pytest

from freeswing.cdpr.driven.elastic import elastic_rest, simulate_elastic
from freeswing.cdpr.driven.motion import simulate_driven
from freeswing.cdpr.driven.statics import static_pose
from tests.cdpr.driven_robots import inca

STILL = np.zeros(8)


def gentle(n):
    """Currents that leave every cable taut."""
    return np.tile(np.linspace(0.3, 0.6, 8), (n, 1))


def test_at_rest_it_stays():
    model = inca()
    pose, out = elastic_rest(model, STILL, 5000.0)
    found = simulate_elastic(model, pose, out, np.zeros((60, 8)), 1000.0, 5000.0)
    assert np.abs(found.states[-1, :3] - pose[:3]).max() < 1e-9
    assert not found.slack.any()


def test_the_rigid_model_is_the_limit():
    model, references = inca(), gentle(150)
    start = static_pose(model, STILL).pose
    rigid = simulate_driven(
        model, np.concatenate([start, np.zeros(6)]), references, 1000.0, currents_A=STILL
    )
    gaps = []
    for stiffness in (4000.0, 8000.0):
        pose, out = elastic_rest(model, STILL, stiffness)
        found = simulate_elastic(model, pose, out, references, 1000.0, stiffness, currents_A=STILL)
        gaps.append(np.abs(found.states[-30:, :3] - rigid.states[-30:, :3]).max())
    stretch = rigid.tensions_N.max() * 2.4 / 8000.0  # of the tightest cable, 2.4 m long
    assert gaps[1] < 3.0 * stretch, f"{gaps[1] * 1e3:.3f} mm apart, stretch {stretch * 1e3:.3f} mm"
    # First order in 1 / EA: half the gap at twice the stiffness, cables' own swings aside.
    assert 0.35 < gaps[1] / gaps[0] < 0.65, f"{gaps} m apart"


def test_a_slack_cable_does_not_push():
    model = inca()
    pose, out = elastic_rest(model, STILL, 3000.0)
    bits = np.random.default_rng(3).integers(0, 2, (6, 8))
    references = np.repeat(2.5 * bits, 70, axis=0)
    found = simulate_elastic(model, pose, out, references, 1000.0, 3000.0, currents_A=STILL)
    state = np.concatenate([pose, np.zeros(6)])
    rigid = simulate_driven(model, state, references, 1000.0, currents_A=STILL)
    assert rigid.slack.any(), "no cable would have pushed: nothing was compared"
    assert found.tensions_N.min() >= 0.0
    assert found.slack.any()


def test_what_cannot_be_followed_is_refused():
    model = inca()
    pose, out = elastic_rest(model, STILL, 5000.0)
    with pytest.raises(ValueError, match="leave the elasticity out"):
        simulate_elastic(model, pose, out, np.zeros((3, 8)), 1000.0, 1e12)
    with pytest.raises(ValueError, match="must be > 0"):
        simulate_elastic(model, pose, out, np.zeros((3, 8)), 1000.0, 0.0)
