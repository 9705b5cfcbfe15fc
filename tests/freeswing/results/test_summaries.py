"""What a command says of its result: every summary reads the typed document."""

from __future__ import annotations

import pytest

from freeswing.commands.session import diagnose, identify, track
from freeswing.console import Console
from freeswing.results.identification import ValidatedRun
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


def test_many_held_out_runs_are_told_by_the_usual_and_the_worst() -> None:
    """Twenty lines of figures hide the one that matters; few runs have a line each."""
    runs = tuple(
        ValidatedRun(run=f"r{k}", sigma_perp=0.1 * (k == 4), prediction_rmse_m=1e-3 * (1 + k))
        for k in range(identify.MOST_LISTED + 1)
    )
    told = identify._held_out_lines(runs)
    assert [line.partition(":")[0] for line in told] == ["9 held-out runs", "r8", "r4"]
    assert "off by 5.00 mm in the median" in told[0]
    assert len(identify._held_out_lines(runs[1:])) == identify.MOST_LISTED
