"""A bench's result in words, for the console and the report."""

from __future__ import annotations

from collections.abc import Sequence

from freeswing.report.panels.answer import verdict
from freeswing.report.words import millimetres, number, parameter_row, plain, unit_of
from freeswing.results.diagnosis import Diagnosis, HeldOut
from freeswing.results.identification import BodyParameter, BudgetShare, ClassicRow, Identification

HALF_WIDTH_95 = 1.959964
LEAST_SHARE = 0.01  # per cent of Izz: what two decimals show


def bench_lines(document: Identification) -> list[str]:
    """What `identify` says of a bench: bodies, the classic formula, held-out runs, notes."""
    lines = ["all runs of the bench in one fit, ± 95 %"]
    for one in document.objects or ():
        lines.append(one.name)
        lines += [f"  {object_row(row)}" for row in one.parameters if row.value is not None]
        missing = untold(one.parameters)
        lines += [f"  not told by these runs: {', '.join(missing)}"] if missing else []
    for budget in document.budgets or ():
        lines.append(f"  deviation of {budget.name}'s Izz_P, by source (kg m2, one deviation):")
        lines += [f"    {budget_row(share)}" for share in _counting(budget.shares)]
    for row in document.classic or ():
        lines.append(f"  classic formula, {row.run}: {classic_row(row)}")
    for run in document.validation:
        lines.append(
            f"  {run.run}: predicted {run.column} off by {number(run.prediction_rmse)} "
            f"(noise {number(run.noise_floor)})"
        )
    return [*lines, *(f"  note: {note}" for note in document.notes)]


def _counting(shares: tuple[BudgetShare, ...]) -> list[BudgetShare]:
    """The sources that count: down to a twentieth of the largest."""
    most = max((share.std_kg_m2 for share in shares), default=0.0)
    return [share for share in shares if share.std_kg_m2 >= 0.05 * most]


def untold(rows: Sequence[BodyParameter]) -> list[str]:
    """Names of a body's parameters that the runs do not tell."""
    return [plain(unit_of(row.name)[0]) for row in rows if row.value is None]


def budget_row(share: BudgetShare) -> str:
    """One source of a deviation."""
    return f"{number(share.std_kg_m2, 2):>9}  {share.what}"


def object_row(row: BodyParameter) -> str:
    """One parameter of a body."""
    told = parameter_row(row)
    if row.value is None or row.std is None:
        return f"{told['name']:6} not told by these runs"
    weak = "" if row.identifiable else "  as given: these runs tell no more"
    return f"{told['name']:6} {told['value']:>9} ± {told['half_width']:<8} {told['unit']}{weak}"


def classic_row(row: ClassicRow) -> str:
    """The classic formula's value beside the fit's, and why they differ."""
    return (
        f"{number(row.Izz_kg_m2, 5)} kg m2 against {number(row.fitted_Izz_kg_m2, 5)} "
        f"({row.off_percent:+.2f} %: {classic_why(row)})"
    )


def classic_why(row: ClassicRow) -> str:
    """Shares of what the formula is off by, the largest first; below a hundredth per cent none."""
    told = sorted(row.reasons, key=lambda one: -abs(one.percent))
    shares = [f"{one.what} {one.percent:+.2f} %" for one in told if abs(one.percent) >= LEAST_SHARE]
    return "; ".join(shares) or f"no share of {LEAST_SHARE} % or more"


def diagnosis_lines(document: Diagnosis) -> list[str]:
    """What `diagnose` says of a bench: effects with their numbers, bodies and errors, notes."""
    lines = []
    for found in document.accepted:
        name = plain(found.effect) + (f" ({found.part})" if found.part else "")
        rows = [parameter_row(one, found.effect) for one in found.parameters]
        values = [f"{r['name']} {r['value']} ± {r['half_width']} {r['unit']}".strip() for r in rows]
        lines.append(f"accepted: {name}: {', '.join(values)}")
        advice = [one.experiment for one in document.candidates if one.effect == found.effect]
        if found.confounded_with:
            others = ", ".join(plain(one) for one in found.confounded_with)
            lines.append(f"  not told from {others}: {'; '.join(filter(None, advice))}")
    lines += verdict(document)
    lines += [f"{name}: {change}" for name, change in changed_objects(document)]
    before, after = document.before, document.after
    if before is not None and after is not None:
        errors = [f"{_error(one)}" for one in (before, after)]
        lines.append(f"runs that were not fitted are off by {errors[0]} before, {errors[1]} after")
    return [*lines, *(f"note: {note}" for note in document.notes)]


def _error(one: HeldOut) -> str:
    metres, radians = one.prediction_rmse_m, one.prediction_rmse_rad
    told = [] if metres is None else [millimetres(metres)]
    told += [] if radians is None else [f"{number(1e3 * radians)} mrad"]
    return " and ".join(told) or "nothing that has a unit"


def changed_objects(document: Diagnosis) -> list[tuple[str, str]]:
    """Every body's Izz about its own centre without and with the effects that were found."""
    found = []
    pairs = zip(document.objects_before or (), document.objects_after or (), strict=True)
    for before, after in pairs if document.accepted else ():
        rows = [
            next((row for row in one.parameters if row.name == "Izz_kg_m2"), None)
            for one in (before, after)
        ]
        told = [" ".join(object_row(row).split()).removeprefix("Izz ") for row in rows if row]
        found.append((after.name, f"Izz {told[0]} before, {told[-1]} after"))
    return found
