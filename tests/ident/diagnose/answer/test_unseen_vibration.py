"""Cables that stretch vibrate: what that makes of values counts where runs do not show it."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.ident.diagnose.answer import unseen_vibration as room
from freeswing.ident.diagnose.answer.unseen_vibration import unseen_vibration
from freeswing.ident.diagnose.springs.full_motion import Vibrating

STRETCH, VIBRATION = "cable_elasticity", "cable_vibration"


def found(value: float, std: float, *effects: str) -> SimpleNamespace:
    """A fit with a compliance and a damping known so well."""
    fit = SimpleNamespace(
        value=lambda _: np.array([1.0, value]), std=lambda _: np.array([1.0, std])
    )
    return SimpleNamespace(fit=fit, effects=effects)


@pytest.mark.parametrize(("away", "counts"), [(2.9, True), (-2.9, True), (3.1, False)])
def test_the_same_stretch_with_its_vibration_counts_as_sure(monkeypatch, away, counts) -> None:
    """One that rings with a line of the noise was 13 deviations off."""
    slow, full = found(0.0, 3.0, STRETCH), found(5.0 * away, 4.0, STRETCH, VIBRATION)
    monkeypatch.setattr(room, "vibrating", lambda *_: Vibrating(full, 0.3, "not seen"))
    monkeypatch.setattr(room, "colour_of", lambda *_: 1.0)
    told = unseen_vibration(slow, np.ones(2))
    assert (told is not None) == counts
    for one in filter(None, [told]):
        assert [(way.places, way.probability, way.fit) for way in one.exchange.ways] == [
            ((VIBRATION,), 1.0, full)
        ]
        assert one.exchange.fits == (slow,)


@pytest.mark.parametrize(("chance", "counts"), [(0.49, False), (0.51, True)])
def test_another_stretch_counts_where_runs_speak_for_it(monkeypatch, chance, counts) -> None:
    slow, full = found(0.0, 1.0, STRETCH), found(50.0, 1.0, STRETCH, VIBRATION)
    monkeypatch.setattr(room, "vibrating", lambda *_: Vibrating(full, chance, "not seen"))
    monkeypatch.setattr(room, "colour_of", lambda *_: 1.0)
    assert (unseen_vibration(slow, np.ones(2)) is not None) == counts


@pytest.mark.parametrize(
    ("chance", "said"),
    [(0.49, "these runs do not show that cables vibrate"), (0.51, "likelier than none (0.51)")],
)
def test_a_vibration_that_is_likely_at_the_end_is_not_said_to_be_unseen(
    monkeypatch, chance, said
) -> None:
    """Beside effects that came later runs may show what they did not when stretch was found."""
    slow, full = found(0.0, 1.0, STRETCH), found(0.5, 1.0, STRETCH, VIBRATION)
    monkeypatch.setattr(room, "vibrating", lambda *_: Vibrating(full, chance, "not seen"))
    monkeypatch.setattr(room, "colour_of", lambda *_: 1.0)
    (note,) = [one.note for one in [unseen_vibration(slow, np.ones(2))] if one]
    assert note.startswith("cable_elasticity is told by its slow part")
    assert said in note


def test_what_cannot_be_followed_or_is_in_the_model_does_not(monkeypatch) -> None:
    monkeypatch.setattr(room, "vibrating", lambda *_: Vibrating(None, 0.0, "no motion"))
    monkeypatch.setattr(room, "colour_of", lambda *_: 1.0)
    for effects in ((STRETCH,), (STRETCH, VIBRATION), ("gravity_tilt",), ()):
        assert unseen_vibration(found(0.0, 1.0, *effects), np.ones(2)) is None
