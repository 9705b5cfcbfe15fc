"""A fan among modes that stand out of the residual more than it does."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.model.equations import build_model
from freeswing.ident.diagnose import refit as refits
from freeswing.ident.diagnose import search as module
from freeswing.ident.diagnose.diagnose import diagnose
from freeswing.ident.diagnose.search import Search
from freeswing.ident.likelihood.blocks import first_unknowns
from freeswing.session.load_swings import load_robot, load_swings, load_target
from freeswing.session.session_file import read_session
from tests.oracle.recorded.sessions import make_session
from tests.oracle.scenes.robots import declared_robot

KEY = "harmonic_force"
LINES_HZ = (1.4, 2.3, 0.8)


def test_a_line_is_where_a_fit_starts_and_what_is_known_of_it() -> None:
    """Without an amplitude its frequency has no other pull than what is known beforehand."""
    model = build_model(declared_robot("three-cable"))
    unknowns = first_unknowns(model, np.zeros(9), np.zeros((2, 12)), [None, None])
    values = np.array([p.start for p in effect_named(KEY).parameters(model.robot)])
    values[-1] = 2.3
    joined, begun = refits._joined(model, unknowns, KEY, values, 2)
    assert joined.parameters[-1].start == 2.3
    block = begun.block(KEY)
    assert block.value[-1] == 2.3
    assert block.prior is not None
    assert block.prior.mean[-1] == 2.3
    assert joined.parameters[-1].prior_std == pytest.approx(12.6, abs=0.1)
    assert [p.start for p in joined.parameters[:-1]] == [0.0] * 6


def test_of_several_lines_the_one_that_leaves_least_is_fitted(monkeypatch) -> None:
    left = {1.4: 900.0, 2.3: 500.0, 0.8: 950.0}
    asked: list[float] = []

    def screened(found, groups, scales, colour) -> Any:
        asked.extend(shapes[KEY]["frequency_hz"] for _, shapes in groups)
        return [SimpleNamespace(with_candidate=lambda _, hz=hz: left[hz], hz=hz) for hz in asked]

    def clues(*_) -> Any:
        return SimpleNamespace(common_frequencies_hz=lambda: LINES_HZ)

    monkeypatch.setattr(module, "Residual", clues)
    monkeypatch.setattr(module, "screens", screened)
    monkeypatch.setattr(module, "score", lambda cost: SimpleNamespace(cost=cost))
    fit: Any = SimpleNamespace(model=SimpleNamespace(robot=declared_robot("three-cable")))
    chosen: Any = Search(np.ones(2), (KEY,), workers=1)._screens(fit, [KEY], 1.0)[KEY]
    assert asked == list(LINES_HZ)
    assert chosen.hz == 2.3


@pytest.mark.parametrize("name", ["translational_drag", "quadratic_drag"])
def test_a_drag_is_looked_for_where_the_platform_turns_and_where_it_does_not(
    monkeypatch, name
) -> None:
    """A quadratic drag at P took 75 of the squares, midway 11, and was not fitted."""
    left = {0.5: 1000.0, 0.0: 935.0}

    def screened(found, groups, scales, colour) -> Any:
        places = [shapes[name]["centre_fraction"] for _, shapes in groups]
        return [
            SimpleNamespace(with_candidate=lambda _, place=place: left[place], place=place)
            for place in places
        ]

    monkeypatch.setattr(module, "Residual", lambda *_: None)
    monkeypatch.setattr(module, "screens", screened)
    monkeypatch.setattr(module, "score", lambda cost: SimpleNamespace(cost=cost))
    fit: Any = SimpleNamespace(model=SimpleNamespace(robot=declared_robot("three-cable")))
    chosen: Any = Search(np.ones(2), (name,), workers=1)._screens(fit, [name], 1.0)[name]
    assert chosen.place == 0.0


@pytest.mark.slow
def test_a_fan_whose_line_is_not_the_strongest_is_found(tmp_path) -> None:
    """Of 0.1 N, by x, y and chi alone: 2 % over the noise."""
    make_session(
        tmp_path, 20262, "three-cable", {KEY: "medium"}, n_runs=7, duration_s=8.0, pose=False
    )
    session = read_session(tmp_path)
    robot = load_robot(session)
    runs = list(load_swings(session, robot, load_target(session)))
    found = diagnose(runs, robot, workers=1).document()
    assert [one["effect"] for one in found["accepted"]] == [KEY], found["accepted"]
