"""Panel: the effect ladder. Every candidate, what it gained on held-out runs, and the verdict."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from freeswing.report.figures import AFTER, FAINT, figure
from freeswing.report.material import Document, Material
from freeswing.report.words import number, plain

ORDER = ("accepted", "confounded", "rejected", "not_identifiable")


class EffectLadder:
    """The candidates for what the model lacks."""

    name = "ladder"
    title = "The effect ladder"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Candidates by verdict and gain, and what no candidate explains."""
        diagnosis = material.diagnosis
        candidates = sorted(diagnosis.get("candidates") or [], key=_rank)
        if not candidates:
            return None
        unexplained = diagnosis.get("unexplained") or {}
        evidence = {
            plain(str(key)): number(value) if isinstance(value, int | float) else str(value)
            for key, value in (unexplained.get("evidence") or {}).items()
        }
        return {
            "rows": [_row(entry) for entry in candidates],
            "chart": _chart(candidates),
            "unexplained": {**unexplained, "evidence": evidence},
        }


def _rank(entry: Document) -> tuple[int, float]:
    verdict = str(entry.get("verdict", ""))
    return (ORDER.index(verdict) if verdict in ORDER else len(ORDER), -_gain(entry))


def _gain(entry: Document) -> float:
    gain = entry.get("held_out_gain")
    return float(gain) if isinstance(gain, int | float) else float("-inf")


def _row(entry: Document) -> dict[str, str]:
    return {
        "effect": plain(str(entry["effect"])),
        "verdict": str(entry.get("verdict", "")),
        "label": plain(str(entry.get("verdict", ""))),
        "delta_bic": number(entry.get("delta_bic"), 4),
        "gain": number(entry.get("held_out_gain"), 3),
        "confounded": ", ".join(plain(str(n)) for n in entry.get("confounded_with") or []),
        "why": ". ".join(str(entry[key]) for key in ("reason", "experiment") if entry.get(key)),
    }


def _chart(candidates: list[Document]) -> object:
    shown = [entry for entry in candidates if _gain(entry) > float("-inf")][:24]
    if not shown:
        return ""

    def draw(sheet: Figure) -> None:
        axes = sheet.subplots()
        colours = [AFTER if e.get("verdict") == "accepted" else FAINT for e in shown]
        axes.barh(range(len(shown)), [100 * _gain(e) for e in shown], color=colours)
        axes.set_yticks(range(len(shown)), [plain(str(e["effect"])) for e in shown])
        axes.invert_yaxis()
        axes.set_xlabel("error taken away on held-out runs (%)")

    caption = "What each candidate effect takes away on held-out runs; accepted ones in blue."
    return figure(draw, 6.4, 0.8 + 0.22 * len(shown), caption)
