"""Who leaves a fit because no free swing explains it, and who comes back."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.ident.judge import lawful_runs
from freeswing.ident.judge.free_swing_law import LawlessError
from freeswing.ident.judge.lawful_runs import best_ml_estimate

# Unexplained shares beyond 0.87 are lawless.
LAWFUL = 0.1


def kept_of(monkeypatch, fits, by_others):
    """Which runs stay and leave, where fits leave so much and the others' inertia so much."""
    names = tuple(sorted({name for fit in fits for name in fit}))
    runs = [SimpleNamespace(name=name) for name in names]

    def from_starts(_, kept, __, starts, dropped, *___):
        named = [run.name for run in kept]
        shares = next(fit for fit in fits if set(fit) == set(named))
        found = SimpleNamespace(
            samples=[SimpleNamespace(name=name) for name in named],
            shares=np.array([shares[name] for name in named]),
        )
        return SimpleNamespace(values=np.zeros(9), dropped=dropped, starts=starts), found

    def predict(_, run, *__):
        measured = np.array([[-1.0], [1.0]])
        left = by_others[run.name]
        if left is None:
            raise ValueError("cannot be simulated")
        return SimpleNamespace(measured=measured, predicted=(1.0 - left) * measured)

    monkeypatch.setattr(lawful_runs, "from_starts", from_starts)
    monkeypatch.setattr(lawful_runs, "unexplained_motion", lambda found: found.shares)
    monkeypatch.setattr(lawful_runs, "is_refuted", lambda *_: False)
    monkeypatch.setattr(lawful_runs, "predict", predict)
    entry, found = best_ml_estimate(None, runs, None, [np.zeros(9)])  # type: ignore[arg-type]
    kept = [run.name for run in found.samples]
    dropped = [drop.run for drop in entry.dropped]
    assert all(drop.lawless and "explains" in drop.why for drop in entry.dropped)
    assert sorted(kept + dropped) == list(names)
    return kept, dropped


ALL = {"a": 0.5, "b": 0.97, "c": 0.4, "made": 0.9}
WITHOUT_B = {"a": 0.4, "c": 0.3, "made": 0.95}
GOOD = {"a": LAWFUL, "c": LAWFUL}
BACK = {"a": LAWFUL, "b": LAWFUL, "c": LAWFUL}


def test_a_good_run_that_left_first_comes_back(monkeypatch) -> None:
    fits = [ALL, WITHOUT_B, GOOD, BACK]
    kept, dropped = kept_of(monkeypatch, fits, {"b": 0.2, "made": 0.95})
    assert kept == ["a", "b", "c"]
    assert dropped == ["made"]


@pytest.mark.parametrize("of_b", [0.9, None])
def test_a_run_that_the_others_do_not_explain_stays_out(monkeypatch, of_b) -> None:
    fits = [ALL, WITHOUT_B, GOOD]
    kept, dropped = kept_of(monkeypatch, fits, {"b": of_b, "made": 0.95})
    assert kept == ["a", "c"]
    assert dropped == ["b", "made"]


def test_runs_that_spoil_the_fit_again_stay_out(monkeypatch) -> None:
    fits = [ALL, WITHOUT_B, GOOD, {**BACK, "b": 0.95}]
    kept, dropped = kept_of(monkeypatch, fits, {"b": 0.2, "made": 0.95})
    assert kept == ["a", "c"]
    assert dropped == ["b", "made"]


@pytest.mark.parametrize(("share", "together"), [(0.96, True), (0.94, False)])
def test_runs_nearly_as_bad_leave_together(monkeypatch, share, together) -> None:
    fits = [{"a": 0.4, "b": share * 0.98, "c": 0.4, "made": 0.98}, {**BACK}, GOOD]
    kept, _ = kept_of(monkeypatch, fits, {"b": 0.95, "made": 0.95})
    assert kept == (["a", "c"] if together else ["a", "b", "c"])


def test_no_run_swings_freely(monkeypatch) -> None:
    with pytest.raises(LawlessError, match="of b, which comes closest"):
        kept_of(monkeypatch, [{"a": 0.99, "b": 0.9}], {})
