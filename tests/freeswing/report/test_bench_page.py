"""The report and the console of a bench: each number and each note once, what is untold by name."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

from freeswing.ident.bench.told import budget
from freeswing.report.bench_words import bench_lines
from freeswing.report.material import Material
from freeswing.report.page import render_page
from freeswing.report.panels import sure
from freeswing.report.panels.advice import steps
from freeswing.report.panels.answer import objects_told
from freeswing.report.panels.sure import exact
from freeswing.results.common import FoundEffect
from freeswing.results.diagnosis import Diagnosis
from freeswing.results.identification import (
    Body,
    BodyParameter,
    Budget,
    BudgetShare,
    Identification,
)

SAMPLES = BudgetShare(what="noise of the samples", std_kg_m2=1e-4)
NOTE = "the platform: no run shows its centre of mass"


def _parameter(name: str, value: float | None, std: float | None) -> dict[str, Any]:
    told = {"name": name, "value": value, "std": std}
    return {**told, "std_percent": None, "essential": value is not None, "identifiable": True}


def _material() -> Material:
    """A dot of unknown scale told Izz alone, and one run was kept apart."""
    document = {
        "format": "freeswing-identification/1",
        "estimates": {
            "ml_free": {
                "parameters": [
                    _parameter("com_x_m", None, None),
                    _parameter("Izz_m2", 0.28, 0.002),
                    _parameter("mass_kg", 0.875, 0.02),
                ],
                "samples": 2391,
                "notes": [NOTE],
            }
        },
        "comparison": {},
        "validation": [
            {
                "run": "r0.40",
                "sigma_perp": None,
                "prediction_rmse_m": None,
                "prediction_rmse": 0.531,
                "column": "dot_px",
                "noise_floor": 0.47,
            }
        ],
        "notes": [NOTE],
        "objects": [
            {
                "name": "platform",
                "parameters": [
                    {"name": "com_x_m", "value": None, "std": None, "identifiable": False},
                    {"name": "Izz_kg_m2", "value": 0.245, "std": 0.007, "identifiable": True},
                ],
            }
        ],
        "channels": [
            {
                "name": "dot",
                "noise": 1.3,
                "gains": [
                    {"name": "chi", "value": 5935.0, "std": 2400.0},
                    {"name": "x", "value": 2220.0, "std": 0.0},
                    {"name": "chi*chi", "value": -11608.0, "std": 9400.0},
                ],
            }
        ],
        "classic": [
            {"run": "r0.25", "period_s": 1.0, "Izz_kg_m2": 0.24, "fitted_Izz_kg_m2": 0.25}
            | {"off_percent": -3.8, "reasons": []}
        ],
    }
    return Material("kth", folder="kth", identification=Identification.from_json(document))


def test_what_runs_do_not_tell_is_named_once() -> None:
    page = render_page(_material())
    assert "Not told by these runs: com x." in page
    assert "Not told by these runs: com x." in page
    assert "not essential" not in page
    assert page.count(NOTE) == 1
    lines = bench_lines(_material().identification or Identification())
    assert lines.count("  not told by these runs: com x") == 1
    assert not any(line.startswith("  com x") for line in lines)


def test_a_held_gain_has_no_interval_and_bends_are_folded_away() -> None:
    page = render_page(_material())
    assert "held: as given, or it names the scale" in page
    assert page.index("Squares and cubes") < page.index("chi*chi")


def test_errors_of_channels_have_their_column() -> None:
    page = render_page(_material())
    assert "0.531 of dot_px" in page
    assert "0.470" in page
    assert "σ⊥" not in page


def test_the_next_steps_are_commands_that_run() -> None:
    commands = [command for _, command in steps(_material())]
    assert "freeswing diagnose kth" in commands
    assert "freeswing export kth --urdf --mass-kg 0.875" in commands


def test_the_object_that_was_asked_for_stands_before_the_platform() -> None:
    material = _material()
    assert material.identification is not None
    objects = (*(material.identification.objects or ()), *_of("cube"))
    budgets = [Budget(name=name, shares=(SAMPLES,)) for name in ("platform", "cube")]
    document = replace(material.identification, objects=objects, budgets=tuple(budgets))
    page = render_page(replace(material, identification=document))
    titles = re.findall(r"<h3>(cube|platform|Where the deviation of (?:cube|platform))", page)
    bodies = ["cube", "platform"]
    first = "cube: Izz about its own centre 12.00 ± 0.20 10⁻³ kg m², 95 %."
    assert page.index(first) < page.index("<h3>The platform</h3>") < page.index("Mass 0.875 kg")
    assert "<h3>The platform</h3>" not in render_page(material)
    assert titles == [*bodies, *(f"Where the deviation of {name}" for name in bodies)], titles


def test_of_an_object_that_is_not_told_nothing_is_said() -> None:
    """Held by what was given, or with no number at all; what a diagnosis found goes before."""
    material = _material()
    found = material.identification
    assert found is not None
    izz = BodyParameter(name="Izz_kg_m2", value=0.012, std=1e-4, identifiable=False)
    held, none = Body(name="held", parameters=(izz,)), Body(name="none", parameters=())
    objects = (*(found.objects or ()), held, none)
    material = replace(material, identification=replace(found, objects=objects))
    assert [one.split(": ", 1)[0] for one in objects_told(material)] == ["held", "none"]
    assert "as given: the runs tell no more" in objects_told(material)[0]
    assert objects_told(material)[1] == "none: Izz is not told by these runs."
    about_p = Body(
        name="held", parameters=(izz, replace(_of("")[0].parameters[0], name="Izz_P_kg_m2"))
    )
    objects = (about_p, Body(name="laid", parameters=about_p.parameters[1:]))
    by_yaw = replace(material, identification=replace(found, objects=objects))
    said = "Izz about P 12.00 ± 0.20 10⁻³ kg m², 95 %."
    assert objects_told(by_yaw) == [f"held: {said}", f"laid: {said}"]
    spring = FoundEffect(effect="torsion_spring")
    diagnosis = Diagnosis(accepted=(spring,), objects_after=_of("cube"))
    assert objects_told(replace(material, diagnosis=diagnosis))[0].startswith("cube: Izz about")


def _of(name: str) -> tuple[Body, ...]:
    izz = BodyParameter(name="Izz_kg_m2", value=0.012, std=1e-4, identifiable=True)
    return (Body(name=name, parameters=(izz,)),)


def test_whether_the_wires_ends_are_counted_is_said() -> None:
    material = _material()
    assert sure.WIRE_ENDS == budget.WIRE_ENDS
    assert "clamped (entries and attachments" in " ".join(exact(material)), exact(material)
    assert "channels alone cannot count it" in exact(material)[1], exact(material)
    assert material.identification is not None
    counted = Budget(name="platform", shares=(BudgetShare(what=budget.WIRE_ENDS, std_kg_m2=1e-4),))
    document = replace(material.identification, budgets=(counted,))
    told, taken = exact(replace(material, identification=document))
    assert "clamped as far as that is stated" in told, told
    assert "clamped" not in taken, taken
