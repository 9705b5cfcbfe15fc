"""Panel: what hangs there. Mass if known, centre of mass, inertia, principal axes, a drawing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from freeswing.report.body import (
    body_about_com,
    hanging,
    is_told,
    principal_rows,
    tensor_rows,
)
from freeswing.report.material import Material
from freeswing.report.panels.ladder import told_once
from freeswing.report.space import in_space
from freeswing.report.words import ESTIMATES, parameter_row, plain, unit_of
from freeswing.results.common import Parameter
from freeswing.results.diagnosis import Diagnosis
from freeswing.results.identification import PLATFORM, Body

NOTHING_MISSING = (
    "The model explains the held-out runs; of the effects looked for, none that they would show is "
    "missing."
)
IZZ_ABOUT = {"Izz_kg_m2": "about its own centre", "Izz_P_kg_m2": "about P"}


class Answer:
    """The body to take away, and the verdict on the model in a sentence or two."""

    name = "answer"
    title = "What hangs there"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Best parameters, the body about its centre of mass, and the verdict."""
        parameters, source = best_parameters(material)
        if not parameters and material.diagnosis is None:
            return None
        body, mass_kg = body_about_com(parameters), known_mass_kg(material, parameters)
        identification = material.identification
        entries = np.zeros((0, 3))
        if identification is not None and identification.entries_m:
            entries = np.array(identification.entries_m, dtype=np.float64)
        swings = () if identification is None else identification.swings
        motions = [*material.fitted_runs, *(material.motion.runs if material.motion else ())]
        return {
            "source": source,
            "verdict": verdict(material.diagnosis),
            "objects": objects_told(material),
            "mass": mass_sentence(material, mass_kg),
            "parameters": _shown([parameter_row(one) for one in told(parameters)]),
            "untold": untold(parameters),
            "tensor": [] if body is None else tensor_rows(body, mass_kg),
            "principal": principal_rows(body, mass_kg) if body and is_told(body) else [],
            "drawing": "" if body is None else hanging(body, material.robot, swings, entries),
            "space": in_space(material.robot, swings, motions),
        }


def objects_told(material: Material) -> list[str]:
    """Izz of each object of a bench, with the effects that were found."""
    found, diagnosis = material.identification, material.diagnosis
    bodies = () if found is None else found.objects or ()
    if diagnosis is not None and diagnosis.accepted and diagnosis.objects_after:
        bodies = diagnosis.objects_after
    return [f"{one.name}: {_izz(one)}" for one in bodies if one.name != PLATFORM]


def _izz(body: Body) -> str:
    """What runs tell of it before what was given, about the object's own centre before about P."""
    rows = {row.name: row for row in body.parameters if row.value is not None}
    known = [(rows[name], where) for name, where in IZZ_ABOUT.items() if name in rows]
    if not known:
        return "Izz is not told by these runs."
    row, where = min(known, key=lambda one: not one[0].identifiable)
    shown = parameter_row(row)
    weak = "" if row.identifiable else " (as given: the runs tell no more)"
    return f"Izz {where} {shown['value']} ± {shown['half_width']} {shown['unit']}, 95 %{weak}."


def told(parameters: Sequence[Parameter]) -> list[Parameter]:
    """Those that have a value."""
    return [one for one in parameters if one.value is not None]


def untold(parameters: Sequence[Parameter]) -> str:
    """Names of those that have none."""
    return ", ".join(plain(unit_of(one.name)[0]) for one in parameters if one.value is None)


def _shown(rows: list[dict[str, str]]) -> list[dict[str, str]]:
    remarks = any(row["weak"] for row in rows)
    return [
        {
            "parameter": row["name"],
            "value ± 95 %": f"{row['value']} ± {row['half_width']} {row['unit']}",
            "± of value (%)": row["percent"],
            "to copy (SI)": row["raw"],
            **({"remark": row["weak"]} if remarks else {}),
        }
        for row in rows
    ]


def best_parameters(material: Material) -> tuple[tuple[Parameter, ...], str]:
    """The nine parameters to take away, and where they are from."""
    estimates = material.estimates
    best = next(iter(estimates), "")
    own = tuple(estimates[best].parameters) if best else ()
    corrected = material.diagnosis.parameters_after if material.diagnosis else ()
    if corrected:
        names = {one.name for one in corrected}
        more = tuple(one for one in own if one.name not in names)
        found = material.diagnosis is not None and material.diagnosis.accepted
        source = "with the effects that the model lacked" if found else "no effect was missing"
        return (*corrected, *more), source
    return own, ESTIMATES.get(best, "")


def known_mass_kg(material: Material, parameters: Sequence[Parameter]) -> float | None:
    """The mass that payload runs tell, else the declared one."""
    found = next((one.value for one in parameters if one.name == "mass_kg"), None)
    if found:
        return found
    return None if material.robot is None else material.robot.platform.mass_kg


def mass_sentence(material: Material, mass_kg: float | None) -> str:
    """Where the mass comes from; swings alone do not tell it."""
    if not mass_kg:
        return (
            "The mass is not known: swings tell inertia over mass. Weigh the platform and state "
            "platform.mass_kg in robot.toml, or record a run with a known payload."
        )
    declared = material.robot is not None and material.robot.platform.mass_kg == mass_kg
    source = "as stated in robot.toml" if declared else "from the runs with a payload"
    return f"Mass {mass_kg:.5g} kg, {source}."


def verdict(diagnosis: Diagnosis | None) -> list[str]:
    """What the diagnosis says, one plain sentence each."""
    if diagnosis is None:
        return ["Missing effects have not been looked for yet: run freeswing diagnose."]
    accepted = [plain(entry.effect) for entry in diagnosis.accepted]
    sentences = []
    if accepted:
        sentences.append(f"The model lacked: {', '.join(accepted)}.")
    for one in told_once(diagnosis.candidates):
        rivals = ", ".join(plain(name) for name in one.confounded_with) or "others"
        sentences.append(f"These data cannot tell {plain(one.effect)} from {rivals}.")
    unexplained = diagnosis.unexplained
    if unexplained is not None and unexplained.present:
        sentences.append(f"Something remains unexplained: {unexplained.signature}")
    if unexplained is not None and unexplained.reliance:
        sentences.append(f"{unexplained.reliance[:1].upper()}{unexplained.reliance[1:]}.")
    untold = _untold(diagnosis)
    if untold:
        return [*sentences, untold]
    return sentences or [NOTHING_MISSING]


def _untold(diagnosis: Diagnosis) -> str:
    """Where no run was predicted: what these data can say of effects at all; else nothing."""
    untold = [one for one in diagnosis.candidates if one.verdict == "not_identifiable"]
    if diagnosis.before is not None or not untold:
        return ""
    seen = [plain(one.effect) for one in diagnosis.candidates if one not in untold]
    if not seen:
        return "These data cannot tell whether an effect is missing."
    return f"Beside {', '.join(seen)}, these data cannot tell whether an effect is missing."
