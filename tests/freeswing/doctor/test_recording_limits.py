"""When the doctor speaks of repeated frames: both sides, without a film."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from freeswing.calib.footage.first_frames import Condition
from freeswing.doctor import footage


@pytest.mark.parametrize(("copies", "told"), [(27, False), (33, True)])
def test_three_in_a_hundred_frames_may_repeat_the_one_before(monkeypatch, copies, told) -> None:
    """Of a thousand frames: a platform that turns round leaves some."""
    times = SimpleNamespace(remarks=(), source="csv")
    monkeypatch.setattr(
        "freeswing.calib.footage.frame_times.frame_times", lambda recording, rate: times
    )
    monkeypatch.setattr(
        "freeswing.calib.footage.first_frames.condition_of",
        lambda recording, least: Condition(1000, copies, is_torn=False),
    )
    recording = SimpleNamespace(path=Path("a.mp4"), name="a")
    found = list(footage._recording_findings("run a", recording, None))
    assert any("repeat the one before" in one.text for one in found) == told
