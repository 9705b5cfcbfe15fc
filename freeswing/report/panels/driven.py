"""Panel: a driven robot's estimates: by every method, before and after, correlations, Table 2."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from freeswing.report.figures import INK, MARKS, SERIES, Draw, figure, figures, interval_axes, key
from freeswing.report.material import Material
from freeswing.report.panels.sure import draw_correlation
from freeswing.report.words import HALF_WIDTH_95, number, parameter_row, plain, unit_of
from freeswing.results.common import Parameter
from freeswing.results.diagnosis import Diagnosis
from freeswing.results.driven.estimates import (
    DriveNumber,
    DriveResult,
    Estimates,
    Joint,
    Method,
    OfPublished,
    RampRead,
    SaturatedRun,
    SlackRun,
)

# Methods in the order in which they are taken, and where each stands in the document.
METHODS: Mapping[str, Callable[[Estimates], Method | OfPublished | Joint | None]] = {
    "the paper's (18)": lambda told: told.kinematic and told.kinematic.equation_18,
    "static poses": lambda told: told.kinematic,
    "inverse dynamics": lambda told: told.inverse_dynamics,
    "output error": lambda told: told.output_error,
    "joint estimate": lambda told: told.joint,
}
MEANT = "Noise alone leaves 1; above 1.5 something is missing in the model."


class DrivenEstimates:
    """Geometry, inertia, friction and springs, and how well every run is predicted with them."""

    name = "driven"
    title = "The driven robot"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Tables and charts; None where no driven robot was identified."""
        if material.drive is None:
            return None
        found = material.drive.estimates
        joint = found.estimates.joint
        diagnosis = material.diagnosis
        lost = [one.name for one in joint.parameters if not one.identifiable]
        return {
            "rows": [_row(one) for one in joint.parameters],
            "lost": lost,
            "bounds": [one.name for one in joint.parameters if one.on_bound],
            "intervals": _intervals(found.estimates),
            "changed": _changed(diagnosis),
            "correlation": _correlation(joint),
            "fits": _fits(found),
            "meant": MEANT,
            "slack": [_slack(one) for one in found.slack if not one.in_model],
            "saturated": [_saturated(one) for one in found.saturated],
            "ramps": [_ramp(one) for one in found.ramps],
        }


def _row(one: DriveNumber) -> dict[str, str]:
    row = parameter_row(_parameter(one))
    tied = f" = {', '.join(one.tied)}" if one.tied else ""
    return {
        "parameter": plain(row["name"]) + tied,
        "value": row["value"],
        "± 95 %": row["half_width"],
        "unit": row["unit"],
        "± 95 % of the value (%)": row["percent"],
        "remark": _remark(one),
    }


def _remark(one: DriveNumber) -> str:
    if not one.identifiable:
        return "these recordings do not determine it"
    return "on a bound of the search: no estimate" if one.on_bound else ""


def _parameter(one: DriveNumber) -> Parameter:
    return Parameter(name=one.name, value=one.value, std=one.std)


def _intervals(estimates: Estimates) -> Markup:
    """Each parameter by every method, less the joint estimate, in per cent of it."""
    joint = {name: at for name, at in estimates.joint.values.items() if at}
    points: dict[str, list[tuple[int, DriveNumber]]] = {name: [] for name in joint}
    for place, told in enumerate(METHODS.values()):
        method = told(estimates)
        for one in () if method is None else method.parameters:
            if one.name in points and one.value is not None:
                points[one.name].append((place, one))
    names = [(label, SERIES[k], MARKS[k]) for k, label in enumerate(METHODS)]
    draws = [_interval(name, entries, joint[name]) for name, entries in points.items()]
    caption = (
        "Each parameter by each method with its 95 % interval, in per cent off the joint estimate."
    )
    return figures([*draws, key(names)], 1.45, caption) if draws else Markup()


def _interval(name: str, entries: Sequence[tuple[int, DriveNumber]], middle: float) -> Draw:
    def draw(sheet: Figure) -> None:
        axes = sheet.subplots()
        for place, one in entries:
            off = 100.0 * ((one.value or 0.0) / middle - 1.0)
            half = 100.0 * HALF_WIDTH_95 * (one.std or 0.0) / abs(middle)
            axes.errorbar(off, -place, xerr=half, color=SERIES[place], marker=MARKS[place], ms=4)
        axes.axvline(0.0, color=INK, lw=0.6)
        interval_axes(axes, f"{plain(unit_of(name)[0])} (%)")

    return draw


def _changed(diagnosis: Diagnosis | None) -> list[dict[str, str]]:
    """The asked numbers before and after what was missing, with their intervals."""
    if diagnosis is None or not diagnosis.accepted:
        return []
    after = {one.name: parameter_row(one) for one in diagnosis.parameters_after}
    rows = []
    for one in diagnosis.parameters_before:
        before, then = parameter_row(one), after.get(one.name)
        if then is None:
            continue
        rows.append(
            {
                "parameter": plain(before["name"]),
                "unit": before["unit"],
                "before ± 95 %": f"{before['value']} ± {before['half_width']}",
                "with what was missing ± 95 %": f"{then['value']} ± {then['half_width']}",
            }
        )
    return rows


def _correlation(joint: Joint) -> Markup:
    names = [one.name for one in joint.parameters]
    rows = np.array(joint.correlation, dtype=float)
    caption = (
        "Correlations of the joint estimate: two that err together are blue, against each other "
        "orange and hatched."
    )
    return figure(lambda sheet: draw_correlation(sheet.subplots(), rows, names), 5.2, 4.8, caption)


def _fits(found: DriveResult) -> list[dict[str, str]]:
    """Table 2: FIT of every run by both definitions, of the declared numbers too."""
    initial = {one.run: one for one in found.initial_fit_percent}
    used = {one.run: one for one in found.used}
    rows = []
    for one in found.fit_percent:
        name, start = one.run, initial.get(one.run)
        part = used.get(name)
        rows.append(
            {
                "run": name,
                "role": one.role
                + ("" if part is None or part.whole else f", its first {part.seconds:.2f} s"),
                "FIT by motor (%)": ", ".join(_percent(value) for value in one.matlab),
                "FIT (%)": _mean(one.matlab),
                "FIT by (22) (%)": _mean(one.equation_22),
                "FIT as declared (%)": "cannot follow" if start is None else _mean(start.matlab),
                "angles off (mrad)": _milli(one.rms_rad),
                "over their noise": number(found.residual.times_noise[name]),
            }
        )
    return rows


def _percent(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def _mean(values: Sequence[float | None]) -> str:
    known = [value for value in values if value is not None]
    return f"{sum(known) / len(known):.2f}" if known else "–"


def _slack(one: SlackRun) -> str:
    cables = ", ".join(one.cables)
    return (
        f"Run {one.run}: cables {cables} would have had to push from {one.from_s:.2f} s on "
        f"({one.samples} samples, down to {one.least_tension_N:.2f} N). Rigid cables are "
        "wrong after that: nothing is fitted to, or judged by, what follows."
    )


def _saturated(one: SaturatedRun) -> str:
    motors = ", ".join(one.motors)
    return (
        f"Run {one.run}: motors {motors} were asked for more than their limits at "
        f"{one.samples} samples; they are taken to give the limit."
    )


def _ramp(one: RampRead) -> dict[str, str]:
    return {
        "run": one.run,
        "motor": one.motor,
        "slope (A/s)": number(one.slope_A_s),
        "moved after (ms)": number(None if one.moved_s is None else 1e3 * one.moved_s),
        "read off (mN m)": _milli(one.ramp_N_m),
        "the same of the estimate (mN m)": _milli(one.estimate_on_this_ramp_N_m),
        "off by the slope (mN m)": _milli(one.slope_costs_N_m),
        "the motor's own friction (mN m)": _milli(one.estimate_N_m),
    }


def _milli(value: float | None) -> str:
    return number(None if value is None else 1e3 * value)
