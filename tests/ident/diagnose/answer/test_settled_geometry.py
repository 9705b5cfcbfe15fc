"""What lengths have settled is held, and what they leave open widens all else."""

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.known_values import with_known
from freeswing.ident.diagnose.answer import settled_geometry as module
from freeswing.ident.diagnose.answer.settled_geometry import cut, settled_places, with_settled
from freeswing.ident.diagnose.leave_one_out import Evidence
from freeswing.ident.likelihood.blocks import effect_values, free_of, model_unknowns
from freeswing.ident.likelihood.fit_swings import Swings
from freeswing.ident.likelihood.joint_problem import State
from freeswing.ident.likelihood.payload_runs import Loads
from tests.oracle.scenes.robots import declared_robot

PLACES = np.arange(3, 6)
KNOWN = np.array([[4.0, 1.0, 0.0], [1.0, 9.0, 0.0], [0.0, 0.0, 1.0]]) * 1e-6


def known_model():
    """Attachment 2 is known by lengths, rotational drag is not."""
    model = build_model(declared_robot("bologna-4"), ("attachment_offset", "rotational_drag"))
    return with_known(model, PLACES, np.array([2e-3, -5e-3, -4e-3]), KNOWN, "cable lengths")


def held(free_geometry):
    model = known_model()
    count = len(model.parameters)
    free = np.zeros(9 + count, dtype=bool)
    free[:9] = free[9 + count - 1] = True
    free[9 + PLACES] = free_geometry
    rng = np.random.default_rng(0)
    triangles = rng.normal(size=(4, 40, 10 + count))
    state = State(np.ones(9), np.ones(count), np.ones((1, 12)), np.ones(2))
    unknowns = model_unknowns(model, Loads.of([None]), state, free)
    swings = Swings(model, (), np.ones(2))
    fit = SimpleNamespace(
        model=model, free=free, inertia=np.ones(9), values=np.ones(count),
        unknowns=unknowns, swings=swings,
    )  # fmt: skip
    names = ("a", "b", "c", "d")
    evidence = Evidence(names, triangles, np.full(4, 40.0), np.zeros((0, 10 + count)))
    return SimpleNamespace(fit=fit, evidence=evidence)


def test_settled_are_the_values_that_lengths_know():
    assert settled_places(known_model()).tolist() == PLACES.tolist()
    plain = build_model(declared_robot("bologna-4"), ("attachment_offset",))
    assert settled_places(plain).tolist() == []


def test_the_fit_goes_on_with_the_geometry_at_what_lengths_say(monkeypatch):
    one = held(True)
    seen = {}

    def fitted(swings, unknowns, how):
        seen.update(values=effect_values(unknowns, one.fit.model))
        seen.update(free=free_of(unknowns, one.fit.model))
        return one.fit

    monkeypatch.setattr(module, "fit", fitted)
    monkeypatch.setattr(module, "rescored", lambda *_: "scored")
    monkeypatch.setattr(module, "colour_of", lambda *_: 1.0)
    assert cut(one, np.ones(2)) == "scored"  # pyright: ignore[reportArgumentType]
    assert seen["values"][PLACES] == pytest.approx([2e-3, -5e-3, -4e-3])
    assert np.delete(seen["values"], PLACES) == pytest.approx(1.0)
    assert not seen["free"][9 + PLACES].any()
    assert seen["free"][:9].all()
    before = free_of(one.fit.unknowns, one.fit.model)
    assert before[9 + PLACES].all()  # the fit that was handed over stays as it is


def test_what_lengths_leave_open_is_told_and_widens_the_rest():
    one = held(False)
    exact = np.diag(np.where(one.fit.free, 1e-8, 0.0))
    wider = with_settled(exact, one)  # pyright: ignore[reportArgumentType]
    assert wider[np.ix_(9 + PLACES, 9 + PLACES)] == pytest.approx(KNOWN)
    rows = one.evidence.triangles.reshape(-1, one.evidence.triangles.shape[-1])
    rng = np.random.default_rng(1)
    free = np.flatnonzero(one.fit.free)
    answers = []
    for geometry in rng.multivariate_normal(np.zeros(3), KNOWN, 4000):
        right = rows[:, 9 + PLACES] @ geometry
        answers.append(np.linalg.lstsq(rows[:, free], -right, rcond=None)[0])
    spread = np.cov(np.array(answers).T)
    added = (wider - exact)[np.ix_(free, free)]
    assert np.sqrt(np.diag(added)) == pytest.approx(np.sqrt(np.diag(spread)), rel=0.05)
    untouched = np.setdiff1d(np.arange(len(exact)), [*free, *(9 + PLACES)])
    assert not wider[untouched].any()
