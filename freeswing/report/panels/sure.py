"""Panel: how sure. Intervals of every method, what they count, and what is taken as exact."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from freeswing.cdpr.robot import INERTIA_NAMES, Array
from freeswing.report.figures import INK, MARKS, SERIES, Draw, figures, interval_axes, key
from freeswing.report.material import Material
from freeswing.report.words import ESTIMATES, HALF_WIDTH_95, number, plain, unit_of
from freeswing.results.common import Parameter
from freeswing.results.identification import ESTIMATE_ORDER, Estimate

OF_BENCHES = (
    "Counted are the samples' noise as it was found, the start and drag of every run, the wires' "
    "lengths, masses and centres of mass as far as the session leaves them open, channels' gains, "
    "{ends}and scatter between runs where there is any.",
    "Taken as exact: {ends}places and masses of the payloads, gravity's size and direction, and "
    "the time stamps.",
)
WIRE_ENDS = "where the wires' ends are"  # of a budget
ENDS_COUNTED = "where wires are hung up and clamped as far as that is stated, "
ENDS_EXACT = (
    "where wires are hung up and clamped (entries and attachments of robot.toml; how far they may "
    "be off counts with --entry-std-m and --attachment-std-m, yet only where a run measures a part "
    "of the pose: channels alone cannot count it), "
)


class HowSure:
    """How far the numbers can be trusted."""

    name = "sure"
    title = "How sure"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Intervals side by side, differences between methods, and the assumptions."""
        estimates = material.estimates
        if not estimates or material.identification is None:
            return None
        comparison = material.identification.comparison
        diagnosis = material.diagnosis
        after = diagnosis.parameters_after if diagnosis and diagnosis.accepted else ()
        tables = [
            {"method": method, "rows": [_difference(row) for row in comparison[kind]]}
            for kind, method in (("ml", "maximum likelihood"), ("fidim", "FIDIM"))
            if comparison.get(kind)
        ]
        return {
            "chart": _chart(estimates, after),
            "tables": tables,
            "summary": _summaries(estimates),
            "exact": exact(material),
            "correlation": _correlation(next(iter(estimates.values()))),
            "notes": [
                note if len(estimates) == 1 else f"{ESTIMATES[name]}: {note}"
                for name in list(estimates)[:1]
                for note in estimates[name].notes
            ],
        }


def exact(material: Material) -> list[str]:
    """What the intervals take as exactly known, and what they count."""
    identification = material.identification
    best = material.estimates[identification.best or ""] if identification else Estimate()
    if identification is not None and identification.objects:
        budgets = identification.budgets or ()
        counted = any(share.what == WIRE_ENDS for one in budgets for share in one.shares)
        told = (ENDS_COUNTED, "") if counted else ("", ENDS_EXACT)
        return [one.format(ends=ends) for one, ends in zip(OF_BENCHES, told, strict=True)]
    told = best.further
    taken = []
    if "geometry" not in told and not any("std" in str(one) for one in told):
        taken.append(
            "pulley entries, attachments and pulley radii as in robot.toml (their uncertainty "
            "counts with --entry-std-m and --attachment-std-m)"
        )
    taken.append("gravity's size and direction, and the time stamps")
    if material.tracking is None:
        taken.append("the frame of the recorded motion: that its axes are those of robot.toml")
    counted = "Counted are the samples' noise as it was found, the start of every run"
    calibrated = best.calibration_modes is not None or best.calibration_std is not None
    counted += ", its cable lengths" + (" and the cameras' calibration." if calibrated else ".")
    return [counted, f"Taken as exact: {'; '.join(taken)}."]


def _difference(row: Any) -> dict[str, str]:
    return {
        "parameter": plain(unit_of(row.name)[0]),
        "full less free (%)": number(row.difference_percent, 3),
        "over both standard deviations": number(row.z, 2),
    }


def _summaries(estimates: dict[str, Estimate]) -> list[dict[str, str]]:
    """A row an estimate; none where there is but one, without costs of FIDIM."""
    alone = [one for one in estimates.values() if one.sigma_W is None and one.cost_C is None]
    if len(estimates) == len(alone) == 1:
        return []
    return [_summary(name, entry) for name, entry in estimates.items()]


def _summary(name: str, estimate: Estimate) -> dict[str, str]:
    samples = estimate.samples
    return {
        "estimate": ESTIMATES[name],
        "samples": f"{samples:,}".replace(",", " ") if samples is not None else "–",
        "σ_W (FIDIM)": number(estimate.sigma_W, 3),
        "cost C (FIDIM)": number(estimate.cost_C, 3),
    }


def _chart(estimates: dict[str, Estimate], after: tuple[Parameter, ...]) -> Markup:
    """Each parameter by every method; the corrected values stand apart and are named so."""
    order = {name: k for k, name in enumerate(ESTIMATE_ORDER)}
    shown = list(_by_name(estimates, after).items())
    if not shown:
        return Markup()
    names = [(ESTIMATES[name], SERIES[order[name]], MARKS[order[name]]) for name in estimates]
    legend = [("with the missing effects", INK, "*"), *names] if after else names
    caption = "Each parameter by each method with its 95 % interval" + (
        "; the star is the value with the effects that the model lacked, the others are without."
        if after
        else "."
    )
    return figures([_interval(*one) for one in shown] + [key(legend)], 1.45, caption)


def _by_name(
    estimates: dict[str, Estimate], after: Sequence[Parameter]
) -> dict[str, list[tuple[int, Parameter]]]:
    """The points of each parameter."""
    order = {name: k for k, name in enumerate(ESTIMATE_ORDER)}
    found: dict[str, list[tuple[int, Parameter]]] = {}
    for name, estimate in estimates.items():
        for entry in (one for one in estimate.parameters if one.value is not None):
            found.setdefault(entry.name, []).append((order[name], entry))
    for entry in after:
        found.setdefault(entry.name, []).append((-1, entry))
    return found


def _correlation(best: Estimate) -> Markup:
    """The best estimate's correlations as a picture with numbers; empty where none are kept."""
    if not best.correlation:
        return Markup()
    rows = np.array(best.correlation, dtype=np.float64)
    caption = (
        "Correlations of the nine parameters: two that err together have a number near 1 (blue) or "
        "-1 (orange, hatched); what is known of one is then worth something for the other."
    )
    return figures([lambda sheet: draw_correlation(sheet.subplots(), rows)], 4.4, caption, 4.6)


def draw_correlation(axes: Axes, rows: Array, of: Sequence[str] = INERTIA_NAMES) -> None:
    """A square a pair, its size the correlation; its number where there is room or it is large."""
    names = [plain(unit_of(name)[0]) for name in of]
    crowded = len(names) > len(INERTIA_NAMES)
    least, digits, size = (0.5, 1, 5.5) if crowded else (0.0, 2, 6.5)
    for (i, k), value in np.ndenumerate(rows):
        side = 0.94 * np.sqrt(abs(value))
        colour, hatch = (SERIES[0], "") if value >= 0.0 else (SERIES[1], "////")
        corner = (k - side / 2.0, i - side / 2.0)
        drawn = {"facecolor": "none" if hatch else colour, "alpha": 0.45, "edgecolor": colour}
        axes.add_patch(Rectangle(corner, side, side, hatch=hatch, lw=0.5, **drawn))
        if i != k and abs(value) >= least:
            axes.text(k, i, f"{value:.{digits}f}", ha="center", va="center", fontsize=size)
    axes.set_xlim(-0.6, len(names) - 0.4)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.set_xticks(range(len(names)), names, rotation=60, ha="right")
    axes.set_yticks(range(len(names)), names)
    if crowded:
        axes.tick_params(labelsize=6.5)
    axes.set_aspect("equal")
    axes.grid(visible=False)


def correlation_sheet(rows: Sequence[Sequence[float | None]]) -> Figure:
    """The same as a figure of its own, for notebooks."""
    sheet = Figure(figsize=(5.2, 5.0), layout="constrained")
    draw_correlation(sheet.subplots(), np.array(rows, dtype=np.float64))
    return sheet


def _interval(name: str, points: list[tuple[int, Parameter]]) -> Draw:
    def draw(sheet: Figure) -> None:
        draw_interval(sheet.subplots(), name, points)

    return draw


def interval_sheet(estimates: dict[str, Estimate], after: Sequence[Parameter]) -> Figure:
    """The same as one figure, for notebooks."""
    shown = list(_by_name(estimates, after).items())
    across = 3
    sheet = Figure(figsize=(9.0, 0.3 + 1.3 * -(-len(shown) // across)), layout="constrained")
    for k, (name, points) in enumerate(shown):
        axes = sheet.add_subplot(-(-len(shown) // across), across, k + 1)
        draw_interval(axes, name, points)
    return sheet


def draw_interval(axes: Axes, name: str, points: list[tuple[int, Parameter]]) -> None:
    """One parameter by each method; the kind of a point is its method's rank, -1 the corrected."""
    stem, scale, unit = unit_of(name)
    for kind, entry in points:
        if entry.value is None:
            continue
        half = scale * HALF_WIDTH_95 * (entry.std or 0.0)
        colour, mark = (INK, "*") if kind < 0 else (SERIES[kind], MARKS[kind])
        size = 9 if kind < 0 else 5
        axes.errorbar(
            scale * entry.value, -kind, xerr=half, fmt=mark, ms=size, capsize=3, color=colour
        )
    interval_axes(axes, f"{plain(stem)} ({unit})")
