"""Panel: what the constancy of cable lengths says of the geometry, whatever forces act."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from freeswing.report.figures import AFTER, FAINT, figure
from freeswing.report.material import Material
from freeswing.report.words import HALF_WIDTH_95, millimetres, number, plain
from freeswing.results.diagnosis import LengthWay, LengthWitness, RunLengths, WrongLengths

MOST_SHOWN = 10
CAPTION = "How probable it is that a part of the geometry is off, by cable lengths along the runs."


class Geometry:
    """Which parts of the geometry are off, how surely, and which runs deserve less trust."""

    name = "geometry"
    title = "What cable lengths say of the geometry"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Places that are off, probabilities of all, and each run's lengths before and after."""
        diagnosis = material.diagnosis
        if diagnosis is None or diagnosis.lengths is None:
            return None
        lengths = diagnosis.lengths
        return {
            "places": [row for one in lengths.wrong for row in _place(one)],
            "chart": _chart(lengths.probabilities),
            "rows": [_run(one) for one in lengths.runs],
        }


def _place(one: WrongLengths) -> list[dict[str, str]]:
    ways = [one, *one.rivals]
    witness = one.equilibria if len(ways) == 1 else None
    rows = []
    for k, way in enumerate(ways):
        name, _, part = way.part.partition(":")
        rows.append(
            {
                "place": ("or " if k else "") + plain(name) + (f" of {part}" if part else ""),
                "off by ± 95 % (mm or mrad)": _sizes(way),
                "probability (%)": "–"
                if way.probability is None
                else f"{100.0 * way.probability:.1f}",
                **({} if witness is None else {"by where it hangs alone": _said(witness)}),
            }
        )
    return rows


def _sizes(told: WrongLengths | LengthWay | LengthWitness) -> str:
    pairs = zip(told.values, told.std, strict=False)
    known = [(1e3 * v, 1e3 * s) for v, s in pairs if v is not None and s is not None]
    return "; ".join(f"{number(v)} ± {number(HALF_WIDTH_95 * s)}" for v, s in known)


def _said(witness: LengthWitness) -> str:
    """What the equilibria say of a place without any cable length."""
    return _sizes(witness) + ("" if witness.agrees else " (contradicts: not used)")


def _run(one: RunLengths) -> dict[str, str]:
    return {
        "run": one.run,
        "lengths vary by": millimetres(one.before_m),
        "with the joint geometry": millimetres(one.after_m),
        "slow errors over the usual": "–" if one.slow_errors is None else f"{one.slow_errors:.1f}",
    }


def _chart(probabilities: Mapping[str, float]) -> object:
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
