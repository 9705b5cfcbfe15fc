"""The swing that parts two models of losses best, of a made-up pair of fits."""

# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.cdpr.simulation.free_swing import simulate
from freeswing.ident.diagnose.answer import next_swing as chosen
from freeswing.ident.diagnose.leave_one_out import Evidence
from freeswing.ident.likelihood.samples_and_noise import prepare
from tests.ident.swings import TRUE_INERTIA, paper_model, recorded, swing

DURATION_S = 1.5


def fitted(name, value):
    """A fit of one swing with one loss, the recordings of which know nothing yet."""
    plain = swing(3, duration_s=DURATION_S)
    model = build_model(paper_model().robot, (name,))
    values = model.start_values.copy()
    values[0] = value
    motion = simulate(
        model, plain.zetas[0], plain.rates[0], (0.0, DURATION_S), TRUE_INERTIA, values, 1e-7
    )
    run = recorded(plain, "a", coordinates=POSE_COORDINATES)
    samples = replace(prepare(run, run.window_s), lengths_m=None)
    fit = SimpleNamespace(
        model=model,
        values=values,
        motions=(motion,),
        samples=(samples,),
        free=np.ones(9 + len(values), dtype=bool),
    )
    size = 10 + len(values)
    evidence = Evidence(("a",), 1e3 * np.eye(size)[None], np.ones(1), np.zeros((0, size)))
    return SimpleNamespace(fit=fit, evidence=evidence)


@pytest.fixture(autouse=True)
def white(monkeypatch):
    monkeypatch.setattr(chosen, "colour_of", lambda *_: 1.0)


def test_losses_of_other_shapes_part_on_a_large_and_long_swing():
    linear, quadratic = fitted("translational_drag", 0.05), fitted("quadratic_drag", 0.4)
    found = chosen.next_swing(linear, quadratic, np.ones(2))
    assert found.like == "a"
    assert found.duration_s == pytest.approx(chosen.DURATIONS[-1] * DURATION_S, abs=0.02)
    assert 0.04 < found.reach_m < 0.06  # as far as the recorded one: nearer shows less
    assert found.times_better > 1.5
    assert f"--reach-m {found.reach_m:.3f} --duration-s 4" in str(found)
