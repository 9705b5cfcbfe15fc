"""Results side by side: values, standard deviations, and differences over both of them."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.robot import INERTIA_NAMES
from freeswing.results.codec import Document, Entry, Numbers, entry
from freeswing.results.common import Parameter
from freeswing.results.diagnosis import Diagnosis
from freeswing.results.files import read_document
from freeswing.results.identification import ESTIMATE_ORDER, Identification

NOTABLE_Z = 3.0  # of nine parameters one passes 3 by chance in 2.4 % of comparisons


@entry
class Side(Entry):
    """One result: its name, where its numbers are from, and the parameters."""

    name: str
    source: str = ""
    parameters: tuple[Parameter, ...] = ()


@entry
class Row(Entry):
    """One parameter on all sides.

    Attributes:
        name: with its unit.
        values: a side each; None where a side lacks it.
        stds: standard deviations; None where none was stated, as for a truth.
        z: difference from the first side over both standard deviations; None where there are none.
    """

    name: str
    values: Numbers
    stds: Numbers
    z: Numbers


@entry
class Comparison(Document):
    """Two or more results; the first is what the others are held against."""

    kind: ClassVar[str] = "comparison"

    sides: tuple[Side, ...]
    rows: tuple[Row, ...]
    verdicts: tuple[str, ...]


def read_side(name: str) -> Side:
    """A result by its place: a session, a results folder, or a file; `:ESTIMATE` picks one.

    A truth.json (of `freeswing demo`, of a sample) serves too: it has no deviations.

    The diagnosis' parameters are taken where there is one and no estimate is named, since they
    count the effects that the model lacked.

    Raises:
        InputError: where nothing is identified there, or the estimate is not among those found.
    """
    place, _, estimate = name.partition(":") if not Path(name).exists() else (name, "", "")
    path = Path(place)
    if path.is_file() and path.suffix == ".json":
        return _from_file(name, path, estimate)
    folder = path.parent if path.is_file() else path
    folder = folder / "results" if (folder / "results").is_dir() else folder
    diagnosis = read_document(folder / "diagnosis.json", Diagnosis)
    if diagnosis is not None and diagnosis.parameters_after and not estimate:
        return Side(name=name, source="diagnosis", parameters=diagnosis.parameters_after)
    return _from_file(name, folder / "identification.json", estimate)


def _from_file(name: str, path: Path, estimate: str) -> Side:
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
        kind = table.get("format", "")
    except FileNotFoundError:
        raise InputError(f"{path}: no such result; run freeswing identify first") from None
    except (OSError, ValueError, AttributeError, RecursionError) as error:
        raise InputError(f"{path}: not a result ({str(error)[:120]})") from None
    if kind == Diagnosis.format():
        found = read_document(path, Diagnosis)
        rows = () if found is None else found.parameters_after
        return Side(name=name, source="diagnosis", parameters=rows)
    truth = _truth(table)
    if truth:
        return Side(name=name, source="truth", parameters=truth)
    document = read_document(path, Identification)
    estimates = {} if document is None else document.ranked
    chosen = estimate or next(iter(estimates), "")
    if chosen not in estimates:
        there = ", ".join(one for one in ESTIMATE_ORDER if one in estimates) or "none"
        raise InputError(f"{path}: estimate {chosen or 'any'}: it holds {there}")
    return Side(name=name, source=chosen, parameters=estimates[chosen].parameters)


def _truth(table: dict[str, Any]) -> tuple[Parameter, ...]:
    """The nine parameters of a truth.json, without deviations; empty where it is none."""
    known = table.get("parameters")
    if not isinstance(known, dict):
        com, inertia = table.get("com_m"), table.get("specific_inertia_m2")
        if not (isinstance(com, list) and isinstance(inertia, list)):
            return ()
        known = dict(zip(INERTIA_NAMES, [*com, *inertia], strict=False))
    found = {name: known.get(name) for name in INERTIA_NAMES}
    return tuple(
        Parameter(name=name, value=float(value))
        for name, value in found.items()
        if isinstance(value, int | float)
    )


def compare(sides: Sequence[Side]) -> Comparison:
    """Every parameter of the first side on all sides, with z against the first.

    Errors that two results share (the same recordings, the same geometry) make z too small or too
    large; for results from other recordings it is what it says.
    """
    first = sides[0]
    rows = []
    for one in first.parameters:
        others = [next((p for p in s.parameters if p.name == one.name), None) for s in sides]
        values = tuple(None if p is None else p.value for p in others)
        stds = tuple(None if p is None else p.std for p in others)
        z = tuple(_z(one, other) for other in others[1:])
        rows.append(Row(name=one.name, values=values, stds=stds, z=z))
    verdicts = tuple(_verdict(side, first, k, rows) for k, side in enumerate(sides[1:]))
    return Comparison(sides=tuple(sides), rows=tuple(rows), verdicts=verdicts)


def _z(first: Parameter, other: Parameter | None) -> float | None:
    if other is None or first.value is None or other.value is None:
        return None
    spread = math.hypot(first.std or 0.0, other.std or 0.0)
    return (other.value - first.value) / spread if spread > 0.0 else None


def _verdict(side: Side, first: Side, k: int, rows: Sequence[Row]) -> str:
    told = f"{side.name} ({side.source}) against {first.name} ({first.source})"
    known = {row.name: row.z[k] for row in rows if row.z[k] is not None}
    if not known:
        return f"{told}: nothing to compare by: no standard deviations, or other parameters"
    apart = [name for name, z in known.items() if z is not None and abs(z) > NOTABLE_Z]
    if not apart:
        return f"{told}: they agree within {NOTABLE_Z:g} standard deviations"
    return f"{told}: they differ beyond {NOTABLE_Z:g} standard deviations in {', '.join(apart)}"
