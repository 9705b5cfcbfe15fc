"""Panel: what was missing. Every candidate, what it gained on held-out runs, and the verdict."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from matplotlib.figure import Figure

from freeswing.report.figures import AFTER, BEFORE, FAINT, figure
from freeswing.report.material import Material
from freeswing.report.words import millimetres, motion_words, number, parameter_row, plain
from freeswing.results.common import FoundEffect, SeenDirection
from freeswing.results.diagnosis import Candidate

ORDER = ("accepted", "confounded", "rejected", "not_identifiable")
_STYLE = {"accepted": (AFTER, ""), "confounded": (BEFORE, "////")}
MOST_SHOWN = 12
# Of what remains, what its sentence says already.
IN_SIGNATURE = ("coordinate", "rms", "frequency_hz", "hint")


class EffectLadder:
    """The candidates for what the model lacks."""

    name = "ladder"
    title = "What was missing, and how sure that is"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Candidates by verdict and gain, and what no candidate explains."""
        diagnosis = material.diagnosis
        if diagnosis is None or not diagnosis.candidates:
            return None
        candidates = sorted(diagnosis.candidates, key=_rank)
        remaining = diagnosis.unexplained
        evidence = {
            plain(key): _told(value)
            for key, value in (remaining.evidence if remaining else {}).items()
            if key not in IN_SIGNATURE
        }
        return {
            "effects": [row for entry in diagnosis.accepted for row in effect_rows(entry)],
            "directions": [
                line for entry in diagnosis.accepted for line in seen_directions(entry.directions)
            ],
            "rivals": [_rival(one) for one in told_once(candidates)],
            "rows": _rows(candidates),
            "chart": _chart(candidates),
            "signature": remaining.signature if remaining and remaining.present else "",
            "evidence": evidence,
        }


def _told(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{plain(key)} {number(one)}" for key, one in value.items())
    return number(value) if isinstance(value, int | float) else str(value)


def effect_rows(effect: FoundEffect) -> list[dict[str, str]]:
    """The numbers of an accepted effect with their 95 % intervals."""
    name = _named(effect)
    rows = []
    for parameter in effect.parameters:
        row = parameter_row(parameter, effect.effect)
        size = f"{row['value']} ± {row['half_width']} {row['unit']}"
        rows.append({"effect": name, "number": row["name"], "value ± 95 %": size})
    if effect.motion:
        rows.append(
            {"effect": name, "number": "motion", "value ± 95 %": motion_words(effect.motion)}
        )
    return rows


def _rank(entry: Candidate) -> tuple[int, float]:
    verdict = entry.verdict
    return (ORDER.index(verdict) if verdict in ORDER else len(ORDER), -_gain(entry))


def _gain(entry: Candidate) -> float:
    return float("-inf") if entry.held_out_gain is None else entry.held_out_gain


def told_once(candidates: Iterable[Candidate]) -> list[Candidate]:
    """The confounded ones, of those that are taken for each other the first."""
    groups: dict[frozenset[str], Candidate] = {}
    for one in candidates:
        if one.verdict == "confounded":
            groups.setdefault(frozenset((one.effect, *one.confounded_with)), one)
    return list(groups.values())


def _rival(entry: Candidate) -> str:
    others = ", ".join(plain(name) for name in entry.confounded_with)
    tail = f" {as_sentence(entry.experiment)}" if entry.experiment else ""
    return as_sentence(f"{_named(entry)} cannot be told from {others}.{tail}")


def as_sentence(text: str) -> str:
    """With a capital letter at its start."""
    return text[:1].upper() + text[1:]


def _named(one: Candidate | FoundEffect) -> str:
    """An effect with the cable or motor that it is of."""
    return plain(one.effect) + (f" ({one.part})" if one.part else "")


def _rows(candidates: list[Candidate]) -> list[dict[str, str]]:
    """A row a candidate, those with a probability and those without under the same headings."""
    rows = [_row(entry) for entry in candidates]
    keys = dict.fromkeys(key for row in sorted(rows, key=len, reverse=True) for key in row)
    return [{key: row.get(key, "–") for key in keys} for row in rows]


def _row(entry: Candidate) -> dict[str, str]:
    row = {
        "candidate": _named(entry),
        "verdict": plain(entry.verdict),
        "error taken away on held-out runs (%)": _percent(entry.held_out_gain),
    }
    if entry.probability is not None:
        row["probability (%)"] = _percent(entry.probability)
    return {
        **row,
        "ΔBIC": number(entry.delta_bic, 4),
        "not told apart from": ", ".join(plain(name) for name in entry.confounded_with),
        "why": ". ".join(text for text in (entry.reason, entry.experiment) if text),
    }


def _percent(share: float | None) -> str:
    if share is None:
        return "–"
    return "0.0" if abs(share) < 5e-4 else f"{100.0 * share:.1f}"


def _chart(candidates: list[Candidate]) -> object:
    judged = [one for one in candidates if one.probability is not None]
    shown = (judged or [one for one in candidates if _gain(one) > float("-inf")])[:MOST_SHOWN]
    if not shown:
        return ""
    what = "probability (%)" if judged else "error taken away on held-out runs (%)"

    def draw(sheet: Figure) -> None:
        axes = sheet.subplots()
        for place, one in enumerate(shown):
            share = one.probability if one.probability is not None else _gain(one)
            colour, hatch = _STYLE.get(one.verdict, (FAINT, ""))
            filled = "none" if hatch else colour
            axes.barh(place, 100.0 * share, facecolor=filled, edgecolor=colour, hatch=hatch)
            # A bar of no length is named too: words, not colour alone, tell the verdict.
            axes.annotate(
                plain(one.verdict),
                (max(100.0 * share, 0.0), place),
                xytext=(3, 0),
                textcoords="offset points",
                va="center",
                fontsize=7.5,
            )
        axes.set_yticks(range(len(shown)), [_named(one) for one in shown])
        axes.invert_yaxis()
        axes.margins(x=0.25)
        if judged:
            axes.set_xticks(range(0, 101, 20))
        axes.set_xlabel(what)
        axes.grid(visible=False, axis="y")

    caption = f"The leading candidates by {what}: accepted filled, confounded hatched, others grey."
    return figure(draw, 4.6, 0.7 + 0.22 * len(shown), caption)


def seen_directions(directions: tuple[SeenDirection, ...]) -> list[str]:
    """Along which directions a displaced point is known best and worst, a sentence a point."""
    points: dict[str, list[SeenDirection]] = {}
    for one in directions:
        points.setdefault(one.point, []).append(one)
    return [
        f"{plain(point)}: known to {_along(ones[0])}, to {_along(ones[-1])}"
        for point, ones in points.items()
    ]


def _along(one: SeenDirection) -> str:
    axis = ", ".join(f"{part:.2f}" for part in one.direction)
    return f"{millimetres(one.std_m)} along ({axis})"
