"""The report's main tables as CSV: SI units in the headings, full digits, 95 % half widths."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

from freeswing.report.material import Material
from freeswing.report.panels.answer import best_parameters
from freeswing.report.words import HALF_WIDTH_95

Row = Sequence[object]


def csv_tables(material: Material) -> dict[str, str]:
    """The tables that there is something for, by file name."""
    parameters, _ = best_parameters(material)
    effects = [
        (effect.effect, one.name, one.value, _half_width(one.std))
        for effect in (material.diagnosis.accepted if material.diagnosis else ())
        for one in effect.parameters
    ]
    tables: dict[str, tuple[Row, Sequence[Row]]] = {
        "report-parameters.csv": (
            ("parameter", "value", "half_width_95"),
            [(one.name, one.value, _half_width(one.std)) for one in parameters],
        ),
        "report-effects.csv": (("effect", "parameter", "value", "half_width_95"), effects),
        "report-held-out.csv": (
            ("run", "error_before_m", "error_after_m", "noise_floor_m"),
            _held_out(material),
        ),
    }
    return {name: _csv(head, rows) for name, (head, rows) in tables.items() if rows}


def _held_out(material: Material) -> list[Row]:
    diagnosis, identification = material.diagnosis, material.identification
    if diagnosis is not None and diagnosis.before is not None and diagnosis.before.runs:
        runs = diagnosis.after.runs if diagnosis.accepted and diagnosis.after else ()
        after = {one.run: one.prediction_rmse_m for one in runs}
        before = diagnosis.before.runs
    else:
        after, before = {}, identification.validation if identification else ()
    return [(r.run, r.prediction_rmse_m, after.get(r.run), r.noise_floor_m) for r in before]


def _half_width(std: float | None) -> float | None:
    return None if std is None else HALF_WIDTH_95 * std


def _csv(head: Row, rows: Sequence[Row]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([["" if cell is None else cell for cell in row] for row in rows])
    return text.getvalue()
