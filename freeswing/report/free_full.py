"""Panel: free coordinates against full poses, method against method."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from freeswing.report.figures import SERIES, figure
from freeswing.report.material import ESTIMATE_ORDER, Document, Material
from freeswing.report.words import ESTIMATES, HALF_WIDTH_95, number, plain


class FreeAgainstFull:
    """Do the free coordinates alone tell the same as full poses?"""

    name = "free_full"
    title = "Free coordinates against full poses"

    def values(self, material: Material) -> dict[str, Any] | None:
        """A small multiple for each parameter and the table of differences."""
        estimates = material.estimates
        if not estimates:
            return None
        comparison = material.identification.get("comparison") or {}
        tables = [
            {"method": method, "rows": [_difference(row) for row in comparison[key]]}
            for key, method in (("ml", "maximum likelihood"), ("fidim", "FIDIM"))
            if comparison.get(key)
        ]
        return {
            "chart": _chart(estimates),
            "tables": tables,
            "summary": [_summary(name, entry) for name, entry in estimates.items()],
        }


def _difference(row: Document) -> dict[str, str]:
    return {
        "name": str(row["name"]),
        "difference": number(row.get("difference_percent"), 3),
        "z": number(row.get("z"), 2),
    }


def _summary(name: str, estimate: Document) -> dict[str, str]:
    samples = estimate.get("samples")
    return {
        "name": ESTIMATES[name],
        "sigma_W": number(estimate.get("sigma_W"), 3),
        "cost_C": number(estimate.get("cost_C"), 3),
        "samples": f"{samples:,}".replace(",", " ") if isinstance(samples, int) else "–",
    }


def _chart(estimates: dict[str, Document]) -> object:
    by_name: dict[str, list[tuple[int, float, float]]] = {}
    for estimate_name, estimate in estimates.items():
        for entry in estimate.get("parameters") or []:
            value, std = entry.get("value"), entry.get("std")
            if isinstance(value, int | float):
                half_width = HALF_WIDTH_95 * std if isinstance(std, int | float) else 0.0
                point = (ESTIMATE_ORDER.index(estimate_name), float(value), half_width)
                by_name.setdefault(str(entry["name"]), []).append(point)
    if not by_name:
        return ""
    rows = -(-len(by_name) // 3)

    def draw(sheet: Figure) -> None:
        grid = sheet.subplots(rows, 3, squeeze=False)
        for axes in grid.flat[len(by_name) :]:
            axes.set_visible(False)
        for axes, (name, points) in zip(grid.flat, by_name.items(), strict=False):
            for kind, value, half_width in points:
                axes.errorbar(
                    value, -kind, xerr=half_width, fmt="o", ms=4, capsize=3, color=SERIES[kind]
                )
            stem, _, unit = name.rpartition("_")
            title = f"{plain(stem)} ({unit.replace('m2', 'm²')})"
            axes.set_title(title, fontsize=9, loc="left")
            axes.set_yticks([-kind for kind, *_ in points], [""] * len(points))
            axes.margins(y=0.25)
            axes.locator_params(axis="x", nbins=4)
        handles = [
            grid.flat[0].plot([], [], "o", ms=4, color=SERIES[ESTIMATE_ORDER.index(name)])[0]
            for name in estimates
        ]
        labels = [ESTIMATES[name] for name in estimates]
        sheet.legend(handles, labels, loc="outside lower left", ncols=2, fontsize=8)

    caption = "Each estimate of each parameter with its 95 % interval."
    return figure(draw, 7.0, 1.0 + 1.15 * rows, caption)
