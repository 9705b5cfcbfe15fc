"""End to end: a rendered session through calibrate, track and identify, against truth."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.robot import INERTIA_NAMES
from freeswing.demo.filmed import write_filmed_session
from freeswing.main import main

NO_DRAG = (0.0, 0.6)


@pytest.fixture(scope="module", params=[2, 3])
def session(request, tmp_path_factory) -> Path:
    """Filmed without any undeclared effect, calibrated, tracked and identified."""
    folder = tmp_path_factory.mktemp(f"seed-{request.param}")
    write_filmed_session(folder, request.param, effect_values=NO_DRAG)
    for command in ("calibrate", "track", "identify"):
        assert main([command, str(folder), "--quiet"]) == 0, command
    return folder


def errors(folder: Path, estimate: str) -> tuple[np.ndarray, np.ndarray]:
    """Errors of the essential parameters and their claimed standard deviations."""
    truth = json.loads((folder / "truth.json").read_text())["parameters"]
    document = json.loads((folder / "results" / "identification.json").read_text())
    rows = [
        row
        for row in document["estimates"][estimate]["parameters"]
        if row["name"] in INERTIA_NAMES and row["essential"]
    ]
    error = np.array([row["value"] - truth[row["name"]] for row in rows])
    return error, np.array([row["std"] for row in rows])


@pytest.mark.slow
@pytest.mark.parametrize("estimate", ["ml_full", "ml_free"])
def test_the_essential_parameters_are_off_as_far_as_is_claimed(session, estimate) -> None:
    """In deviations: root mean square of the nine, and the worst.

    Of honest claims nine go beyond 1.6 by root mean square six times in a thousand, and one of
    the 36 here beyond three deviations once in ten; seeds 3 to 8 have 0.94 over all and one of 108
    beyond three, at 3.1. Claims that were two times too small would give 2.
    """
    error, std = errors(session, estimate)
    z = error / std
    assert np.sqrt(np.mean(z**2)) < 1.6, f"z = {np.round(z, 2)}"
    assert np.abs(z).max() < 4.0, f"z = {np.round(z, 2)}"


@pytest.mark.slow
def test_the_centre_of_mass_is_known_to_micrometres(session) -> None:
    """The calibration shifts all poses by 50 um: taken for inertia, that would be 30 um here."""
    error, std = errors(session, "ml_full")
    assert np.abs(error[:3]).max() < 5e-6, f"{1e6 * error[:3]} um"
    assert std[:3].max() < 3e-6, f"{1e6 * std[:3]} um"


@pytest.mark.slow
def test_without_the_calibrations_modes_the_claim_would_be_false_or_wide(session) -> None:
    """The negative control: the same tracks where nothing is known of the calibration.

    Where runs contradict each other for it, they widen a deviation by much (seed 2: 14 times).
    """
    _, known = errors(session, "ml_full")
    path = session / "results" / "tracking.json"
    whole = path.read_text()
    document = json.loads(whole)
    for run in document["runs"]:
        assert len(run["calibration_errors"]["modes"]) > 6, run["run"]
        run["calibration_errors"] = None
    try:
        path.write_text(json.dumps(document))
        assert main(["identify", str(session), "--quiet"]) == 0
        error, std = errors(session, "ml_full")
    finally:
        path.write_text(whole)
    z, wider = np.abs(error / std), std / known
    assert z.max() > 4.0 or wider.max() > 4.0, f"z = {np.round(z, 2)}, wider {np.round(wider, 2)}"
