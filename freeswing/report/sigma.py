"""Panel: sigma-perp by run (the paper's Fig. 3) and what each held-out run says."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from freeswing.report.figures import AFTER, BEFORE, figure
from freeswing.report.material import Document, Material
from freeswing.report.words import millimetres, number

FEW_RUNS = 5
UNEVEN = 20.0  # times the middle value from which on a logarithmic axis shows more


class SigmaByRun:
    """How well the estimate explains each held-out run."""

    name = "sigma"
    title = "σ⊥ and prediction error by run"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Bars and a table over the validation runs."""
        diagnosed = material.diagnosis.get("before") or {}
        before = list(diagnosed.get("runs") or material.identification.get("validation") or [])
        if not before:
            return None
        found = material.diagnosis if material.diagnosis.get("accepted") else {}
        after = {str(r["run"]): r for r in (found.get("after") or {}).get("runs") or []}
        rows = [_row(entry, after.get(str(entry["run"]), {})) for entry in before]
        return {"rows": rows, "chart": _chart(before, after), "has_after": bool(after)}


def _row(entry: Document, after: Document) -> dict[str, str]:
    return {
        "run": str(entry["run"]),
        "sigma": number(entry.get("sigma_perp")),
        "sigma_after": number(after.get("sigma_perp")),
        "rmse": millimetres(entry.get("prediction_rmse_m")),
        "rmse_after": millimetres(after.get("prediction_rmse_m")),
        "floor": millimetres(entry.get("noise_floor_m")),
    }


def _chart(before: list[Document], after: dict[str, Document]) -> object:
    runs = [str(entry["run"]) for entry in before]
    series = [("before", BEFORE, [_sigma(entry) for entry in before])]
    if after:
        series.append(("after", AFTER, [_sigma(after.get(run, {})) for run in runs]))

    def draw(sheet: Figure) -> None:
        axes = sheet.subplots()
        width = 0.8 / len(series)
        for index, (label, colour, values) in enumerate(series):
            places = [place + (index + 0.5) * width - 0.4 for place in range(len(runs))]
            axes.bar(places, values, width=width, color=colour, label=label)
        axes.set_xticks(range(len(runs)), runs, rotation=60 if len(runs) > 6 else 0)
        axes.set_ylabel("σ⊥")
        beyond = 0.5 * max(FEW_RUNS - len(runs), 0)  # one bar shall not fill the page
        axes.set_xlim(-0.6 - beyond, len(runs) - 0.4 + beyond)
        shown = [value for _, _, values in series for value in values if value > 0.0]
        if shown and max(shown) > UNEVEN * sorted(shown)[len(shown) // 2]:
            axes.set_yscale("log")
        if after:
            sheet.legend(loc="outside upper right", ncols=2)

    caption = "σ⊥ of each held-out run: the scatter of what the model leaves over."
    return figure(draw, 7.0, 2.8, caption)


def _sigma(entry: Document) -> float:
    value = entry.get("sigma_perp")
    return float(value) if isinstance(value, int | float) else float("nan")
