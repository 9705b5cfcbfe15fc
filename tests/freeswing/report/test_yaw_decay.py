"""Amplitude against time on the page of a bench."""

from __future__ import annotations

import dataclasses

from freeswing.report.page import render_page
from freeswing.results.identification import Identification
from tests.freeswing.report.report_material import whole_material

RUN = {
    "run": "tare-1",
    "times_s": [2.0, 6.0, 10.0],
    "measured_rad": [0.1, 0.08, 0.064],
    "std_rad": [1e-4, 1e-4, None],
    "linear_rad": [0.1, 0.08, 0.064],
    "quadratic_rad": [0.1, 0.079, 0.066],
    "dry_rad": [0.1, 0.082, 0.062],
}


def page_of(decay: dict | None) -> str:
    """The page of a bench: no diagnosis, and its identification with this decay."""
    told = {"format": "freeswing-identification/1"}
    identification = Identification.from_json(told | ({"yaw_decay": decay} if decay else {}))
    whole = whole_material()
    return render_page(
        dataclasses.replace(whole, diagnosis=None, identification=identification, motion=None)
    )


def test_a_bench_shows_how_its_yaw_dies_away() -> None:
    page = page_of({"laws": {"linear": 0.9, "dry": 0.02, "quadratic": 0.08}, "runs": [RUN]})
    assert "Amplitude of yaw in parts of the run" in page
    assert "linear drag 90 %, quadratic drag 8 %, dry friction 2 %" in page
    assert "36" in page, "lost, measured"


def test_no_envelope_no_section() -> None:
    assert "How the swings die away" not in page_of(None)
    assert "How the swings die away" not in page_of({"laws": {}, "runs": []})
