"""Panel: before and after, on the same curves and the same held-out runs."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from freeswing.report.figures import AFTER, BEFORE, FAINT, Draw, figures
from freeswing.report.material import Material
from freeswing.report.motion import motion_figures, residual_figures, residual_rms
from freeswing.report.words import millimetres, number
from freeswing.results.diagnosis import HeldOut, HeldOutRun
from freeswing.results.identification import ValidatedRun
from freeswing.results.motion import RunMotion

MOST_RUNS = 2
BELOW_FLOOR = (
    "An error a little below the noise floor is no miracle: each run's start and cable lengths are "
    "fitted to the very samples that are predicted, which takes some of their noise up."
)
SIGMA = (
    "σ⊥ is the scatter of measured accelerations: differentiating the samples' noise makes most of "
    "it, so it hardly falls where the predicted path comes far closer."
)


class Change:
    """How the held-out runs were predicted before, and how they are now."""

    name = "change"
    title = "Before and after"

    def values(self, material: Material) -> dict[str, Any] | None:
        """What fell, by run, and the measured beside the predicted motion."""
        runs = _runs(material)
        if not runs and material.motion is None:
            return None
        motions = [] if material.motion is None else list(material.motion.runs)
        diagnosis = material.diagnosis
        return {
            "summary": _summary(diagnosis.before, diagnosis.after) if diagnosis else "",
            "rows": _rows(runs),
            "chart": _chart(runs),
            "notes": [
                *([BELOW_FLOOR] if _is_below(runs) else []),
                *([SIGMA] if any(one.sigma_perp is not None for one, _ in runs) else []),
            ],
            "motions": [(one.run, motion_figures(one)) for one in motions[:MOST_RUNS]],
            "shown": min(len(motions), MOST_RUNS),
            "total": len(motions),
            "fitted": [
                (one.run, residual_figures(one)) for one in material.fitted_runs[:MOST_RUNS]
            ],
            "fitted_rows": [_fitted_row(one) for one in material.fitted_runs],
        }


Pair = tuple[HeldOutRun | ValidatedRun, HeldOutRun | None]


def _runs(material: Material) -> list[Pair]:
    """Each held-out run before, and after where effects were accepted."""
    diagnosis = material.diagnosis
    if diagnosis is not None and diagnosis.before is not None and diagnosis.before.runs:
        found = diagnosis.after if diagnosis.accepted and diagnosis.after else HeldOut()
        after = {run.run: run for run in found.runs}
        return [(run, after.get(run.run)) for run in diagnosis.before.runs]
    identification = material.identification
    return [(run, None) for run in identification.validation] if identification else []


def _summary(before: HeldOut | None, after: HeldOut | None) -> str:
    if before is None or before.prediction_rmse_m is None:
        return ""
    floor = f"the samples' own noise leaves {millimetres(before.noise_floor_m)}"
    told = f"On runs that were never fitted, the predicted path is off by {{}} ({floor})."
    if after is None or after.prediction_rmse_m is None or after == before:
        return told.format(millimetres(before.prediction_rmse_m))
    change = f"{millimetres(before.prediction_rmse_m)} before and "
    return told.format(change + f"{millimetres(after.prediction_rmse_m)} after")


def _is_below(runs: list[Pair]) -> bool:
    last = [after or before for before, after in runs]
    known = [(one.prediction_rmse_m, one.noise_floor_m) for one in last]
    return any(error is not None and floor is not None and error < floor for error, floor in known)


def _rows(runs: list[Pair]) -> list[dict[str, str]]:
    """A row a run; the scatter of accelerations where one has it."""
    scattered = any(before.sigma_perp is not None for before, _ in runs)
    return [_row(before, after, scattered) for before, after in runs]


def _row(
    before: HeldOutRun | ValidatedRun, after: HeldOutRun | None, scattered: bool
) -> dict[str, str]:
    row = {"run": before.run, "error before": _error(before)}
    if after is not None:
        row["error after"] = _error(after)
    row["noise floor"] = _floor(before)
    if scattered:
        row["σ⊥ before (m/s²)"] = number(before.sigma_perp)
    if after is not None and scattered:
        row["σ⊥ after (m/s²)"] = number(after.sigma_perp)
    return row


def _fitted_row(run: RunMotion) -> dict[str, str]:
    metres, radians = residual_rms(run)
    return {
        "run": run.run,
        "rms of positions": millimetres(metres),
        "rms of angles (mrad)": number(None if radians is None else 1e3 * radians),
    }


def _error(run: HeldOutRun | ValidatedRun) -> str:
    other = getattr(run, "prediction_rmse", None)
    if other is None:
        return millimetres(run.prediction_rmse_m)
    return f"{number(other)} of {getattr(run, 'column', '')}"


def _floor(run: HeldOutRun | ValidatedRun) -> str:
    other = getattr(run, "noise_floor", None)
    return number(other) if other is not None else millimetres(run.noise_floor_m)


def _chart(runs: list[Pair]) -> object:
    if not any(before.prediction_rmse_m is not None for before, _ in runs):
        return ""
    has_after = any(after is not None for _, after in runs)
    caption = "Prediction error of each held-out run" + (
        ": before (hatched) and after (filled); the grey line is the samples' noise."
        if has_after
        else "; the grey line is the samples' noise."
    )
    height = 0.7 + 0.3 * len(runs) * (1 + has_after) / 2
    return figures([_bars(runs)], height, caption, 4.6)


def _bars(runs: list[Pair]) -> Draw:
    def draw(sheet: Figure) -> None:
        axes = sheet.subplots()
        for place, (before, after) in enumerate(runs):
            sizes = [(before, BEFORE, "////")] + ([(after, AFTER, "")] if after else [])
            high = 0.8 / len(sizes)
            for k, (one, colour, hatch) in enumerate(sizes):
                value = 1e3 * (one.prediction_rmse_m or 0.0)
                where = place - 0.4 + (k + 0.5) * high
                filled = "none" if hatch else colour
                axes.barh(
                    where, value, height=high, facecolor=filled, edgecolor=colour, hatch=hatch
                )
            if before.noise_floor_m is not None:
                floor = 1e3 * before.noise_floor_m
                axes.plot([floor, floor], [place - 0.45, place + 0.45], color=FAINT, lw=2.5)
        axes.set_yticks(range(len(runs)), [before.run for before, _ in runs])
        axes.invert_yaxis()
        axes.set_xlabel("prediction error (mm)")

    return draw
