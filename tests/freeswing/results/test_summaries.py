"""What a command says of its result: every summary reads the typed document."""

from __future__ import annotations

import pytest

from freeswing.commands.session import diagnose, identify, track
from freeswing.console import Console
from tests.freeswing.report.report_material import whole_material


def test_summaries_read_their_documents(capsys: pytest.CaptureFixture[str]) -> None:
    material = whole_material()
    assert material.diagnosis is not None
    assert material.identification is not None
    assert material.tracking is not None
    diagnose._summarise(material.diagnosis, Console())
    identify._summarise(material.identification, "ml_full", Console())
    track._summarise(material.tracking, Console())
    told = capsys.readouterr().out
    assert "The model lacked: translational drag." in told
    assert "off by 11.0 mm before, 0.200 mm after" in told
    assert "check-00: off by 4.00 mm" in told
    assert "swing-01: 198 of 200 samples" in told
