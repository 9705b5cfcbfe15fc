"""The page of a driven robot's session: estimates, Table 2, curves, evidence, what is left."""
# Documents are written as plain JSON.
# pyright: reportArgumentType=false

from __future__ import annotations

import json

import pytest

from freeswing.report.material import read_material
from freeswing.report.page import driven_panels, render_page
from freeswing.report.words import unit_of
from freeswing.results.driven.motion import DriveMotion


def parameter(name, value, std, **more):
    return {
        "name": name,
        "value": value,
        "std": std,
        "identifiable": True,
        "on_bound": False,
    } | more


def estimates():
    """What `drive` writes of a robot with two cables."""
    joint = [
        parameter("drum_m", 0.0175, 1e-6),
        parameter("coulomb_N_m", 4.4e-3, 2e-6, on_bound=True),
        parameter("Ixx_kg_m2", None, None, identifiable=False),
    ]
    kinematic = {"parameters": joint[:1], "rms_rad": 4e-4, "condition": 9.0, "stopped": "converged"}
    fit = {"run": "val_b", "role": "validate", "rms_rad": 4.4e-4}
    fit |= {"equation_22": [99.99, 99.98], "matlab": [99.5, None]}
    own = fit | {"run": "ident", "role": "identify"}
    ramp = {"run": "ramp_5", "motor": "5", "slope_A_s": 1.0, "moved_s": 0.091}
    ramp |= {"ramp_N_m": 5.5e-3, "estimate_on_this_ramp_N_m": 5.45e-3, "estimate_N_m": 4.4e-3}
    ramp |= {"slope_costs_N_m": 1.05e-3, "breakaway_s": 0.073}
    slack = {"run": "val_b", "samples": 9, "cables": ["2"], "from_s": 1.25, "in_model": False}
    return {
        "format": "freeswing-drive-result/1",
        "session": "made",
        "estimates": {
            "kinematic": kinematic | {"equation_18": kinematic},
            "joint": {"parameters": joint, "correlation": [[1, 0.7, 0], [0.7, 1, 0], [0, 0, 1]]},
        },
        "fit_percent": [own, fit],
        "initial_fit_percent": [fit | {"matlab": [12.0, 13.0]}],
        "used": [{"run": "ident", "seconds": 1.23, "whole": False}],
        "ramps": [ramp],
        "slack": [slack | {"least_tension_N": -0.43}],
        "saturated": [{"run": "ident", "samples": 7, "motors": ["1"]}],
        "residual": {"times_noise": {"ident": 1.02, "val_b": 1.01}, "autocorrelation_10_ms": {}},
    }


def motion():
    """The curves beside it."""
    rows = 40
    run = {"run": "val_b", "role": "validate", "times_s": [0.01 * k for k in range(rows)]}
    run |= {"angles_rad": [[0.1 * k, -0.1 * k] for k in range(rows)]}
    run |= {"residuals_rad": [[4e-4, -4e-4]] * rows, "tensions_N": [[4.0, 3.0]] * rows}
    run |= {"slack_share": [0.0, 0.05], "spectrum_hz": [1.0, 10.0, 100.0]}
    run |= {"spectrum_rad2_hz": [1e-9, 1e-10, 1e-10]}
    return {
        "format": "freeswing-drive-motion/1",
        "cables": ["1", "2"],
        "tension_limits_N": [[1.48, 18.5], [1.48, 18.5]],
        "angle_noise_rad": 4.4e-4,
        "runs": [run, run | {"run": "ident", "role": "identify"}],
    }


def diagnosis():
    held_out = {"prediction_rmse_m": 1e-3, "noise_floor_m": 1e-3}
    effect = {"effect": "coulomb_friction", "part": "5"}
    effect["parameters"] = [{"name": "added_5_N_m", "value": 2.4e-3, "std": 1e-5}]
    effect["evidence"] = [{"run": "val_b", "from_s": 0.5, "to_s": 1.0, "share": 0.62}]
    candidate = {"effect": "coulomb_friction", "part": "5", "verdict": "accepted"}
    candidate |= {"delta_bic": -900.0, "held_out_gain": 0.9, "confounded_with": []}
    asked = [{"name": "drum_m", "value": 0.0175, "std": 1e-6}]
    return {
        "format": "freeswing-diagnosis/1",
        "session": "made",
        "before": held_out,
        "candidates": [candidate],
        "accepted": [effect],
        "after": held_out,
        "parameters_before": asked,
        "parameters_after": asked,
        "unexplained": {"present": True, "signature": "motor 2 at 7 Hz", "evidence": {}},
    }


@pytest.fixture
def results(tmp_path):
    documents = {"drive": estimates(), "drive_motion": motion(), "diagnosis": diagnosis()}
    for name, table in documents.items():
        (tmp_path / f"{name}.json").write_text(json.dumps(table))
    return tmp_path


def rendered(results):
    material = read_material("made", results)
    return render_page(material, driven_panels(material))


def test_everything_that_was_found_is_on_the_page(results):
    page = rendered(results)
    for text in (
        "Ixx_kg_m2 is not determined by these recordings",
        "coulomb_N_m ended on a bound of the search",
        "cables 2 would have had to push from 1.25 s on",
        "motors 1 were asked for more than their limits",
        "identify, its first 1.23 s",
        "99.50, –",
        "cannot follow",
        "Friction from ramps",
        "Before and after what was missing",
        "Correlations of the parameters",
        "Where each accepted effect is seen",
        "None of the known effects explains what remains: motor 2 at 7 Hz.",
        "the paper&#39;s Fig. 7",
        "Spectrum of the angles",
        "coulomb friction (5)",
    ):
        assert text in page, text
    assert page.index("Run val_b: motor angles") < page.index("Run ident: motor angles")


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("angles_rad", [[0.1, 0.2]], "run val_b: rows and columns are not as many"),
        ("slack_share", [0.0], "run val_b: rows and columns are not as many"),
        ("times_s", [], "run val_b: rows and columns are not as many"),
        ("tensions_N", "none", "tensions_N"),
    ],
)
def test_curves_that_do_not_fit_are_named(results, key, value, says):
    table = motion()
    table["runs"][0][key] = value
    (results / "drive_motion.json").write_text(json.dumps(table))
    said = read_material("made", results).absent["drive"]
    assert "drive_motion.json: " in said
    assert says in said
    assert said.endswith("delete it and run freeswing drive again")


def test_curves_are_written_as_they_are_read():
    assert DriveMotion.from_json(motion()).to_json() == {"session": "", **motion()}


def test_without_curves_and_a_diagnosis_the_numbers_stand_alone(results):
    (results / "drive_motion.json").unlink()
    (results / "diagnosis.json").unlink()
    page = rendered(results)
    assert "The driven robot" in page
    assert "motor by motor" not in page
    assert "What was missing" not in page


def test_what_was_not_looked_for_is_said(results):
    (results / "diagnosis.json").unlink()
    page = rendered(results)
    assert "What the model lacks was not looked for: freeswing diagnose." in page


def test_a_result_of_another_version_is_named(results):
    broken = estimates()
    del broken["residual"]
    (results / "drive.json").write_text(json.dumps(broken))
    material = read_material("made", results)
    assert material.drive is None
    assert "drive.json: it lacks residual; delete it" in material.absent["drive"]
    (results / "drive.json").write_text("{}")
    material = read_material("made", results)
    assert material.drive is None
    assert "must be 'freeswing-drive-result/1'" in material.absent["drive"]


@pytest.mark.parametrize(
    ("name", "effect", "unit"),
    [
        ("coulomb_N_m", "", "mN m"),
        ("spring_N_m", "", "N/m"),
        ("added_8_N_m", "spring_constant", "N/m"),
        ("added_8_N_m", "coulomb_friction", "mN m"),
        ("viscous_N_m_s", "", "mN m s"),
        ("torque_constant_N_m_A", "", "mN m/A"),
        ("drum_m", "", "mm"),
    ],
)
def test_units_of_motors(name, effect, unit):
    assert unit_of(name, effect)[2] == unit
