"""Panel: a bench's bodies, its channels, and the classic formula beside the fit."""

from __future__ import annotations

from typing import Any

from freeswing.report.bench_words import HALF_WIDTH_95, changed_objects, classic_why, untold
from freeswing.report.material import Material
from freeswing.report.words import number, parameter_row
from freeswing.results.identification import (
    PLATFORM,
    Body,
    BodyParameter,
    Budget,
    ChannelGain,
    ClassicRow,
)


class BenchPanel:
    """Absolute inertia of platform and objects; what the textbook formula would have said."""

    name = "bench"
    title = "The bench"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Rows by body, channel and run; None where the session is no bench."""
        found = material.identification
        if found is None or not found.objects or not found.classic:
            return None
        # What was asked for leads: the object, then the platform that carried it.
        bodies = sorted(found.objects, key=_carries)
        changed = changed_objects(material.diagnosis) if material.diagnosis else []
        changed.sort(key=lambda one: one[0] == PLATFORM)
        return {
            "changed": [{"body": name, "without, with": text} for name, text in changed],
            "objects": [
                {
                    "name": one.name,
                    "rows": [_row(row) for row in one.parameters if row.value is not None],
                    "untold": ", ".join(untold(one.parameters)),
                }
                for one in bodies
            ],
            "channels": [
                {
                    "name": one.name,
                    "noise": number(one.noise),
                    "rows": [_gain(g) for g in one.gains if "*" not in g.name],
                    "bends": [_gain(g) for g in one.gains if "*" in g.name],
                }
                for one in found.channels or ()
            ],
            "budgets": [
                {
                    "name": one.name,
                    "rows": [
                        {"from": share.what, "kg m²": number(share.std_kg_m2, 2)}
                        for share in one.shares
                    ],
                }
                for one in sorted(found.budgets or (), key=_carries)
            ],
            "classic": [_classic(row) for row in found.classic],
        }


def _carries(body: Body | Budget) -> bool:
    return body.name == PLATFORM


def _row(row: BodyParameter) -> dict[str, str]:
    told = parameter_row(row)
    return {
        "parameter": told["name"],
        "value ± 95 %": f"{told['value']} ± {told['half_width']} {told['unit']}",
        "remark": "" if row.identifiable else "as given: the runs tell no more",
    }


def _gain(row: ChannelGain) -> dict[str, str]:
    half = number(HALF_WIDTH_95 * row.std, 2) if row.std else "–"
    held = "held: as given, or it names the scale" if row.std == 0.0 else ""
    return {"entry": row.name, "gain": number(row.value, 5), "± 95 %": half, "remark": held}


def _classic(row: ClassicRow) -> dict[str, str]:
    return {
        "run": row.run,
        "period (s)": number(row.period_s, 5),
        "formula (kg m²)": number(row.Izz_kg_m2, 5),
        "fit (kg m²)": number(row.fitted_Izz_kg_m2, 5),
        "off (%)": f"{row.off_percent:+.2f}",
        "why": classic_why(row),
    }
