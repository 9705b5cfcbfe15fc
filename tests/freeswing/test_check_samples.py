"""Stamps and samples that the recording program made, through the command line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from freeswing.main import main


def edit(session: Path, change, name: str = "swing-01") -> None:
    """Write a run's csv again, its numbers changed."""
    path = session / "runs" / f"{name}.csv"
    head, *rows = path.read_text(encoding="utf-8").strip().split("\n")
    values = change(np.array([[float(cell) for cell in row.split(",")] for row in rows]))
    text = "\n".join(",".join(repr(float(v)) for v in row) for row in values)
    path.write_text(f"{head}\n{text}\n", encoding="utf-8")


def findings(session: Path) -> tuple[int, str]:
    status = main(["check", str(session), "--quiet"])
    found = json.loads((session / "results" / "check.json").read_text(encoding="utf-8"))["findings"]
    return status, "\n".join(f"{f['level']} {f['subject']}: {f['text']}" for f in found)


def scaled(factor: float, offset: float = 0.0):
    def change(values: np.ndarray) -> np.ndarray:
        values[:, 0] = offset + factor * values[:, 0]
        return values

    return change


@pytest.mark.parametrize(("factor", "is_said"), [(1.01, True), (1.0015, True), (1.0002, False)])
def test_stamps_off_the_declared_rate_are_named(session: Path, factor, is_said) -> None:
    edit(session, scaled(factor))
    _, said = findings(session)
    assert (f"samples come at {100.0 / factor:.2f} Hz, the session says 100 Hz" in said) == is_said


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "milliseconds"), (1e6, "microseconds")])
def test_stamps_in_another_unit_are_named(session: Path, factor, unit) -> None:
    edit(session, scaled(factor))
    status, said = findings(session)
    assert status == 1
    assert f"as {unit} that is 100 Hz: times are in seconds" in said
    assert main(["identify", str(session), "--quiet"]) == 2


def test_a_stalled_capture_and_a_wild_sample_are_named(session: Path) -> None:
    def change(values: np.ndarray) -> np.ndarray:
        values[:, 1:4] += 1e-5 * np.random.default_rng(0).normal(size=(len(values), 3))
        values[100:131, 1:] = values[100, 1:]
        values[300, 1] += 0.5
        return values

    edit(session, change)
    _, said = findings(session)
    assert "warning run swing-01: the same sample stands from 1.00 s on for 0.30 s" in said
    assert "warning run swing-01: the sample at 3.00 s is 500.0 mm off its neighbours in x" in said
    assert "run check-01: the s" not in said
