"""What was found, as a notebook shows it: a table in text and HTML, and a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

from freeswing.report.panels.answer import verdict
from freeswing.report.words import ESTIMATES, parameter_row
from freeswing.results.common import Parameter
from freeswing.results.diagnosis import Diagnosis
from freeswing.results.identification import Identification

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEAD = ("parameter", "value", "± 95 %", "unit")


@dataclass(frozen=True, slots=True)
class Found:
    """Parameters with their intervals, and the document that they are from.

    Attributes:
        source: where they are from, in words.
        parameters: the numbers, in the unit of each name's suffix.
        document: the whole result, as its file holds it.
        sentences: what belongs beside the numbers.
    """

    source: str
    parameters: tuple[Parameter, ...]
    document: Identification | Diagnosis
    sentences: tuple[str, ...] = ()

    def value(self, name: str) -> float:
        """A parameter's value by its name, such as `com_z_m`.

        Raises:
            KeyError: where it was not found, with the names that were.
        """
        for one in self.parameters:
            if one.name == name and one.value is not None:
                return one.value
        raise KeyError(f"{name}: not among {', '.join(one.name for one in self.parameters)}")

    def rows(self) -> list[dict[str, Any]]:
        """Name, value and standard deviation of each parameter; pandas.DataFrame takes them."""
        return [{"name": p.name, "value": p.value, "std": p.std} for p in self.parameters]

    def plot(self) -> Figure:
        """Each parameter by each method with its 95 % interval, as the report draws it."""
        from freeswing.report.panels.sure import interval_sheet

        identified = self.document if isinstance(self.document, Identification) else None
        estimates = {} if identified is None else identified.ranked
        return interval_sheet(estimates, () if estimates else self.parameters)

    def __str__(self) -> str:
        lines = [self.source, *(_line(row) for row in self._table())]
        return "\n".join([*lines, *self.sentences])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{name}</th>" for name in HEAD)
        body = "".join(
            f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>"
            for row in self._table()
        )
        told = "".join(f"<p>{escape(text)}</p>" for text in self.sentences)
        table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
        return f"<p>{escape(self.source)}</p>{table}{told}"

    def _table(self) -> list[tuple[str, str, str, str]]:
        rows = [parameter_row(one) for one in self.parameters]
        return [(row["name"], row["value"], row["half_width"], row["unit"]) for row in rows]


def _line(row: Sequence[str]) -> str:
    name, value, half_width, unit = row
    return f"  {name:8} {value:>12} ± {half_width:<10} {unit}"


def identified(document: Identification) -> Found:
    """The best estimate of an identification."""
    best = document.best or ""
    estimate = document.estimates.get(best)
    parameters = () if estimate is None else estimate.parameters
    notes = (*document.notes, *(() if estimate is None else estimate.notes))
    return Found(ESTIMATES.get(best, "nothing identified"), parameters, document, notes)


def diagnosed(document: Diagnosis) -> Found:
    """The parameters with the effects that the model lacked, and the verdict."""
    told = (*verdict(document), *document.notes)
    return Found("with the effects found", document.parameters_after, document, told)
