"""What an answer takes back because its own values do not show it."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.answer import taken_back as module
from freeswing.ident.diagnose.answer.deviations import honest_covariance
from freeswing.ident.diagnose.answer.taken_back import taken_back, unseen
from freeswing.ident.diagnose.decision import Decision
from freeswing.ident.diagnose.diagnose import diagnose
from freeswing.ident.diagnose.refit import polished, refit
from freeswing.ident.diagnose.search import Round
from freeswing.session.load_swings import load_robot, load_swings, load_target
from freeswing.session.session_file import read_session
from tests.oracle.recorded.sessions import make_session
from tests.oracle.scenes.robots import declared_robot

WHITE = np.ones(2)


def won(name: str, before: Any = "before", by_lengths: bool = False, others: tuple = ()) -> Any:
    decision = SimpleNamespace(key=name, group=(name, *others))
    return SimpleNamespace(by_lengths=by_lengths, decision=decision, before=before)


def fit_of() -> Any:
    return SimpleNamespace(fit="fit")


def told(**deviations: float) -> tuple[Any, Array]:
    """A fit with effects of one value each, so many deviations from nothing."""
    names = tuple(deviations)
    model = build_model(declared_robot("three-cable"), names)
    blocks = {
        n: SimpleNamespace(value=np.array([d]), mask=np.ones(1, bool))
        for n, d in deviations.items()
    }
    unknowns = SimpleNamespace(block=blocks.get, columns=lambda n: np.array([names.index(n)]))
    return SimpleNamespace(model=model, unknowns=unknowns), np.eye(len(names))


@pytest.mark.parametrize(("deviations", "believed"), [(1.9, False), (2.0, True)])
def test_no_last_effect_is_told_whose_values_are_nothing_within_their_deviations(
    deviations, believed
):
    """On a clean session a force of (23 +- 28, 36 +- 130, 15 +- 180) um/s2 was told as accepted."""
    before = SimpleNamespace(effects=())
    rounds = [won("rotational_drag", before)]
    found, covariance = told(rotational_drag=deviations)
    fewer = taken_back(rounds, fit_of(), found, covariance, WHITE)
    assert (fewer is None) == believed, fewer
    if fewer is not None:
        assert fewer.last is before
        assert not fewer.accepted
        assert "not accepted" in fewer.note


@pytest.mark.parametrize(("others", "asked"), [(("pulley_axis",), False), ((), True)])
def test_the_last_is_asked_first_and_a_group_of_lengths_is_believed(others, asked):
    """Poses 20 ms late were found; a point that lengths moved beside them was told as nothing."""
    found, covariance = told(rotational_drag=0.5, swivel_viscous=1.5, pulley_friction=1.0)
    rounds = [
        won("rotational_drag", by_lengths=True, others=others),
        won("pulley_friction"),
        won("swivel_viscous"),
    ]
    assert [name for name, _ in unseen(rounds, found, covariance)] == [
        "swivel_viscous",
        *(["rotational_drag"] if asked else []),
        "pulley_friction",
    ]


@pytest.mark.parametrize("as_good", [True, False])
def test_an_earlier_effect_that_is_nothing_goes_where_the_model_is_as_good_without(
    monkeypatch, as_good
):
    asked = []
    monkeypatch.setattr(module, "without", lambda fit, name, _: asked.append(name) or "fewer")
    monkeypatch.setattr(module, "is_no_worse", lambda *_: as_good)
    found, covariance = told(rotational_drag=1.0, swivel_viscous=9.0)
    rounds = [won("rotational_drag"), won("swivel_viscous")]
    fewer = taken_back(rounds, fit_of(), found, covariance, WHITE)
    assert asked == ["rotational_drag"]
    assert (fewer is not None) == as_good
    if fewer is not None:
        assert fewer.last == "fewer"
        assert fewer.accepted == rounds[1:]
        assert "beside swivel_viscous: taken back" in fewer.note


def test_what_was_taken_back_does_not_return_with_the_fit_before_the_last(monkeypatch):
    monkeypatch.setattr(module, "without", lambda fit, name, _: f"without {name}")
    found, covariance = told(rotational_drag=9.0, swivel_viscous=1.0)
    before = SimpleNamespace(effects=("rotational_drag", "gravity_tilt", "platform_frame"))
    # The tilt stood for the drag's group until it was asked again.
    rounds = [won("rotational_drag", others=("gravity_tilt",)), won("swivel_viscous", before)]
    fewer = taken_back(rounds, fit_of(), found, covariance, WHITE)
    assert fewer is not None
    assert fewer.last == "without swivel_viscous"


@pytest.mark.slow
@pytest.mark.parametrize(("there", "goes"), [("gravity_tilt", "translational_drag"), ("both", "")])
def test_a_spurious_effect_goes_and_a_true_one_stays_however_wide_it_is_told(tmp_path, there, goes):
    """Widened tenfold, the true drag looks like nothing too: runs left out keep it."""
    effects = {"gravity_tilt": "large"}
    effects |= {"translational_drag": "small"} if there == "both" else {}
    make_session(tmp_path, 24, "bologna-4", effects, n_runs=6, duration_s=4.0)
    session = read_session(tmp_path)
    robot = load_robot(session)
    runs = list(load_swings(session, robot, load_target(session)))
    base = diagnose(runs, robot, workers=1, candidates=()).final
    drag = refit(base, "translational_drag", np.array([0.0, 0.5]), WHITE, 100.0)
    both = polished(refit(drag.fit, "gravity_tilt", np.zeros(2), WHITE, 1.0).fit, WHITE)
    rounds = [
        Round(drag, Decision((), drag, "translational_drag", ("translational_drag",))),
        Round(drag, Decision((), both, "gravity_tilt", ("gravity_tilt",))),
    ]
    spread = honest_covariance(both.fit, both)
    columns = both.fit.unknowns.columns("translational_drag")
    spread[columns, columns] *= 1e4
    fewer = taken_back(rounds, both, both.fit, spread, WHITE)
    assert (fewer is not None) == bool(goes), fewer
    assert fewer is None or fewer.last.effects == ("gravity_tilt",)
