"""Panel: what the constancy of cable lengths says of the geometry, whatever forces act."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from freeswing.report.figures import AFTER, FAINT, figure
from freeswing.report.material import Material
from freeswing.report.words import HALF_WIDTH_95, millimetres, number, plain

MOST_SHOWN = 10
CAPTION = "How probable it is that a part of the geometry is off, by cable lengths along the runs."


class Geometry:
    """Which parts of the geometry are off, how surely, and which runs deserve less trust."""

    name = "geometry"
    title = "What cable lengths say of the geometry"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Places that are off, probabilities of all, and each run's lengths before and after."""
        diagnosis = material.diagnosis
        if diagnosis is None or not diagnosis.lengths:
            return None
        lengths = diagnosis.lengths
        return {
            "places": [row for one in lengths.get("wrong", ()) for row in _place(one)],
            "chart": _chart(lengths.get("probabilities", {})),
            "rows": [_run(one) for one in lengths.get("runs", ())],
        }


def _place(one: dict[str, Any]) -> list[dict[str, str]]:
    ways = [one, *one.get("rivals", ())]
    witness = one.get("equilibria") if len(ways) == 1 else None
    rows = []
    for k, way in enumerate(ways):
        name, _, part = way["part"].partition(":")
        rows.append(
            {
                "place": ("or " if k else "") + plain(name) + (f" of {part}" if part else ""),
                "off by ± 95 % (mm or mrad)": _sizes(way),
                "probability (%)": f"{100.0 * way['probability']:.1f}",
                **({} if witness is None else {"by where it hangs alone": _said(witness)}),
            }
        )
    return rows


def _sizes(told: dict[str, Any]) -> str:
    pairs = [(1e3 * v, 1e3 * s) for v, s in zip(told["values"], told["std"], strict=True)]
    return "; ".join(f"{number(v)} ± {number(HALF_WIDTH_95 * s)}" for v, s in pairs)


def _said(witness: dict[str, Any]) -> str:
    """What the equilibria say of a place without any cable length."""
    return _sizes(witness) + ("" if witness["agrees"] else " (contradicts: not used)")


def _run(one: dict[str, Any]) -> dict[str, str]:
    return {
        "run": one["run"],
        "lengths vary by": millimetres(one["before_m"]),
        "with the joint geometry": millimetres(one["after_m"]),
        "slow errors over the usual": f"{one['slow_errors']:.1f}",
    }


def _chart(probabilities: dict[str, float]) -> object:
    shown = sorted(probabilities.items(), key=lambda one: -one[1])[:MOST_SHOWN]
    if not shown:
        return ""

    def draw(sheet: Figure) -> None:
        axes = sheet.subplots()
        for place, (_, chance) in enumerate(shown):
            axes.barh(place, 100.0 * chance, color=AFTER if chance > 0.5 else FAINT)
        names = [plain(key.replace(":", " of ")) for key, _ in shown]
        axes.set_yticks(range(len(shown)), names)
        axes.invert_yaxis()
        axes.set_xlim(0.0, 100.0)
        axes.set_xlabel("probability that it is off (%)")
        axes.grid(visible=False, axis="y")

    return figure(draw, 4.6, 0.7 + 0.22 * len(shown), CAPTION)
