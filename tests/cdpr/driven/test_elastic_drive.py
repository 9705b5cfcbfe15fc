"""Elastic cables: slack, and the rigid model as their limit."""

import numpy as np
import pytest

from freeswing.cdpr.driven.behaviour import rest_pose, simulate
from freeswing.cdpr.driven.elastic import Stretch, elastic_rest, simulate_elastic
from freeswing.cdpr.driven.motion import simulate_driven
from freeswing.cdpr.driven.statics import CENTRE, static_pose
from tests.cdpr.driven_robots import inca

STILL = np.zeros(8)


def at(pose):
    return np.concatenate([pose, np.zeros(6)])


def gentle(n):
    """Currents that leave every cable taut."""
    return np.tile(np.linspace(0.3, 0.6, 8), (n, 1))


def test_at_rest_it_stays():
    model = inca()
    pose = elastic_rest(model, STILL, Stretch(5000.0))
    found = simulate_elastic(model, at(pose), np.zeros((60, 8)), 1000.0, Stretch(5000.0))
    assert np.abs(found.states[-1, :3] - pose[:3]).max() < 1e-9
    assert not found.slack.any()


def test_the_rigid_model_is_the_limit():
    model, references = inca(), gentle(150)
    start = static_pose(model, STILL).pose
    rigid = simulate_driven(model, at(start), references, 1000.0, currents_A=STILL)
    gaps = []
    for stiffness in (4000.0, 8000.0):
        stretch = Stretch(stiffness)
        start = at(elastic_rest(model, STILL, stretch))
        found = simulate_elastic(model, start, references, 1000.0, stretch, currents_A=STILL)
        gaps.append(np.abs(found.states[-30:, :3] - rigid.states[-30:, :3]).max())
    given = rigid.tensions_N.max() * 2.4 / 8000.0  # of the tightest cable, 2.4 m long
    assert gaps[1] < 3.0 * given, f"{gaps[1] * 1e3:.3f} mm apart, stretch {given * 1e3:.3f} mm"
    # First order in 1 / EA: half the gap at twice the stiffness, cables' own swings aside.
    assert 0.35 < gaps[1] / gaps[0] < 0.65, f"{gaps} m apart"


def test_a_slack_cable_does_not_push():
    model = inca()
    start = at(elastic_rest(model, STILL, Stretch(3000.0)))
    bits = np.random.default_rng(3).integers(0, 2, (6, 8))
    references = np.repeat(2.5 * bits, 70, axis=0)
    found = simulate_elastic(model, start, references, 1000.0, Stretch(3000.0), currents_A=STILL)
    rigid = simulate_driven(model, start, references, 1000.0, currents_A=STILL)
    assert rigid.slack.any(), "no cable would have pushed: nothing was compared"
    assert found.tensions_N.min() >= 0.0
    assert found.slack.any()


def test_what_cannot_be_followed_is_refused():
    model = inca()
    start, references = at(elastic_rest(model, STILL, Stretch(5000.0))), np.zeros((3, 8))
    with pytest.raises(ValueError, match="leave the elasticity out"):
        simulate_elastic(model, start, references, 1000.0, Stretch(1e12))
    with pytest.raises(ValueError, match="must be > 0"):
        simulate_elastic(model, start, references, 1000.0, Stretch(0.0))


def test_the_effect_is_the_stiffness():
    model = inca(("cable_elasticity",))
    theta = model.theta({"cable_elasticity.mass_over_stiffness_s2_m": 0.289 / 5000.0})
    references, pose = gentle(80), rest_pose(model, STILL, theta)
    found = simulate(model, at(pose), references, 1000.0, theta, currents_A=STILL)
    expected = simulate_elastic(
        inca(), at(elastic_rest(inca(), STILL, Stretch(5000.0))), references, 1000.0,
        Stretch(5000.0), currents_A=STILL,
    )  # fmt: skip
    assert np.allclose(found.turns, expected.turns, atol=1e-9)
    rigid = simulate(model, at(pose), references, 1000.0, currents_A=STILL)
    assert rigid.lengths_out_m is None
    gap = np.abs(found.angles_rad(CENTRE) - rigid.angles_rad(CENTRE)).max()
    assert gap > 0.01, f"{gap} rad: nothing was compared"


def test_damped_cables_swing_less():
    model, references = inca(), np.repeat([[0.0] * 8, [1.0] * 8], 100, axis=0)
    theta = model.theta({"coulomb_N_m": 0.0, "viscous_N_m_s": 0.0})
    start = at(elastic_rest(model, STILL, Stretch(3000.0), theta))
    swings = []
    for relaxation in (0.0, 3e-3):
        stretch = Stretch(3000.0, relaxation)
        found = simulate_elastic(model, start, references, 1000.0, stretch, theta, currents_A=STILL)
        swings.append(np.abs(np.diff(found.tensions_N[160:], n=2, axis=0)).max())
    assert swings[1] < 0.5 * swings[0], swings
