"""Panel: the answer. Parameters with honest intervals, the verdict, before and after."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from freeswing.report.material import Material
from freeswing.report.words import ESTIMATES, millimetres, number, parameter_row, plain


class Answer:
    """The parameters to take away and how far to trust them."""

    name = "answer"
    title = "The answer"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Best parameters, the verdict in a sentence, and before/after on the held-out runs."""
        estimates = material.estimates
        if not estimates and not material.diagnosis:
            return None
        best = next(iter(estimates), None)
        corrected = material.diagnosis.get("parameters_after") or []
        parameters = corrected or (estimates[best].get("parameters", []) if best else [])
        source = "after the accepted effects" if corrected else ESTIMATES.get(best or "", "")
        return {
            "source": source,
            "parameters": [parameter_row(entry) for entry in parameters],
            "verdict": verdict(material),
            "comparison": before_and_after(material.diagnosis),
            "accepted": [_effect(entry) for entry in material.diagnosis.get("accepted") or []],
        }


def verdict(material: Material) -> list[str]:
    """What the diagnosis says, one plain sentence each."""
    diagnosis = material.diagnosis
    if not diagnosis:
        return ["Missing effects have not been looked for yet: run freeswing diagnose."]
    accepted = [plain(str(entry["effect"])) for entry in diagnosis.get("accepted") or []]
    confounded = [
        plain(str(entry["effect"]))
        for entry in diagnosis.get("candidates") or []
        if entry.get("verdict") == "confounded"
    ]
    sentences = []
    if accepted:
        sentences.append(f"The model lacked: {', '.join(accepted)}.")
    if confounded:
        sentences.append(f"These data cannot tell apart: {', '.join(confounded)}.")
    unexplained = diagnosis.get("unexplained") or {}
    if unexplained.get("present"):
        sentences.append(f"Something remains unexplained: {unexplained.get('signature', '')}")
    if not sentences:
        sentences.append("The model explains the held-out runs; no effect is missing.")
    return sentences


def before_and_after(diagnosis: Mapping[str, Any]) -> list[dict[str, str]]:
    """The three held-out measures, without and with the accepted effects."""
    before, after = diagnosis.get("before") or {}, diagnosis.get("after") or {}
    if not before:
        return []
    rows = (
        ("prediction error", "prediction_rmse_m", millimetres),
        ("noise floor", "noise_floor_m", millimetres),
        ("σ⊥ of the free motion", "sigma_perp", number),
    )
    return [
        {"what": what, "before": show(before.get(key)), "after": show(after.get(key))}
        for what, key, show in rows
    ]


def _effect(entry: Mapping[str, Any]) -> dict[str, Any]:
    parameters = []
    for parameter in entry.get("parameters") or []:
        value, std = number(parameter.get("value"), 4), number(parameter.get("std"), 2)
        parameters.append({"name": str(parameter["name"]), "value": value, "std": std})
    return {"name": plain(str(entry["effect"])), "parameters": parameters}
