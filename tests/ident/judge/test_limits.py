"""From which numbers on a run or a result is no free swing's: both sides of each limit."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.ident.judge import free_swing_law
from freeswing.ident.judge.free_swing_law import fidim_complaint, is_lawless


@pytest.mark.parametrize(
    ("explained", "refuted", "lawless"),
    [(0.26, False, False), (0.24, False, True), (0.76, True, False), (0.74, True, True)],
)
def test_how_much_of_a_run_must_be_explained(explained, refuted, lawless) -> None:
    share = np.array([np.sqrt(1.0 - explained)])
    assert is_lawless(share, refuted).tolist() == [lawless]


def complaint(monkeypatch, unexplained, refuted, supported, lawless=False):
    """What is said of a result whose best run leaves that share of its accelerations."""
    monkeypatch.setattr(
        free_swing_law, "unexplained_acceleration", lambda *_: unexplained, raising=True
    )
    consistency = SimpleNamespace(is_refuted=refuted, size=lambda: "by far")
    found = SimpleNamespace(values=None, consistency=consistency)
    return fidim_complaint(None, [None, None], found, supported, lawless)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("unexplained", "supported", "refused"),
    [(0.49, False, False), (0.51, False, True), (0.51, True, False)],
)
def test_equations_that_miss_the_accelerations(monkeypatch, unexplained, supported, refused):
    text = complaint(monkeypatch, unexplained, refuted=False, supported=supported)
    assert bool(text) == refused, text
    assert ("or too small or too few" in text) == refused


@pytest.mark.parametrize(
    ("unexplained", "lawless", "refused"),
    [(0.29, False, False), (0.31, False, True), (0.01, True, True)],
)
def test_an_inertia_that_no_body_has(monkeypatch, unexplained, lawless, refused) -> None:
    text = complaint(monkeypatch, unexplained, True, True, lawless)
    assert bool(text) == refused, text
    assert ("no body can have its inertia" in text) == refused


def test_equations_alone_are_no_answer_where_no_motion_follows_a_run(monkeypatch) -> None:
    text = complaint(monkeypatch, 0.01, refuted=False, supported=False, lawless=True)
    assert "no motion that it predicts follows a run" in text
