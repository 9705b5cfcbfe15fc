"""When the doctor doubts axes and memory: both sides of each limit."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.doctor import cable_lengths as lengths
from freeswing.doctor import machine


@pytest.mark.parametrize(("gigabytes", "level"), [(1.9, "warning"), (2.1, "note")])
def test_two_gigabytes_are_comfortable(monkeypatch, gigabytes, level) -> None:
    told = {"SC_PAGE_SIZE": 1000, "SC_PHYS_PAGES": gigabytes * 1e6}
    monkeypatch.setattr(machine.os, "sysconf", told.__getitem__, raising=False)
    assert machine._memory().level == level


@pytest.mark.parametrize(
    ("found_m", "share", "said"),
    [(0.0105, 0.19, 1), (0.0095, 0.19, 0), (0.0105, 0.21, 0), (0.0095, 0.0, 0)],
)
def test_axes_are_turned_where_a_fifth_is_left_of_a_centimetre(monkeypatch, found_m, share, said):
    """How much cables change as recorded, and how much of it with the axis y up."""
    spreads = iter([found_m, *(share * found_m if a == "y" else found_m for a in lengths.UP_TURNS)])
    monkeypatch.setattr(
        lengths, "build_model", lambda _: SimpleNamespace(lengths=0, start_values=0)
    )
    monkeypatch.setattr(lengths, "moved_trajectory", lambda *_: SimpleNamespace(values=np.zeros(3)))
    monkeypatch.setattr(lengths, "evaluate", lambda *_: [np.zeros(3)])
    monkeypatch.setattr(lengths, "_spread", lambda _: next(spreads))
    part = SimpleNamespace(take=lambda known: None, is_known=None)
    findings = list(lengths._turned("run a", part, None, np.zeros((3, 1))))
    assert len(findings) == said
    assert all('up = "y"' in one.remedy for one in findings)
