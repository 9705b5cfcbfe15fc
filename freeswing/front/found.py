"""What was found, as a notebook shows it: a table in text and HTML, pictures, other libraries."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

from freeswing.front.exchange import to_arviz, to_dataframe
from freeswing.report.panels.answer import verdict
from freeswing.report.words import ESTIMATES, parameter_row
from freeswing.results.common import Parameter
from freeswing.results.diagnosis import Diagnosis
from freeswing.results.identification import Identification
from freeswing.results.motion import Motion

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEAD = ("parameter", "value", "± 95 %", "unit")
PICTURES = ("intervals", "residuals", "spectra", "correlation")


@dataclass(frozen=True, slots=True)
class Found:
    """Parameters with their intervals, and the document that they are from.

    Attributes:
        source: where they are from, in words.
        parameters: the numbers, in the unit of each name's suffix.
        document: the whole result, as its file holds it.
        sentences: what belongs beside the numbers.
        motion: measured beside predicted samples, where there are any.
        correlation: of the nine inertial parameters, (9, 9) as rows; empty where not known.
    """

    source: str
    parameters: tuple[Parameter, ...]
    document: Identification | Diagnosis
    sentences: tuple[str, ...] = ()
    motion: Motion | None = None
    correlation: tuple[tuple[float | None, ...], ...] = ()

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
        """Name, value and standard deviation of each parameter."""
        return [{"name": p.name, "value": p.value, "std": p.std} for p in self.parameters]

    def to_dataframe(self) -> Any:
        """The same as a pandas.DataFrame with the names as its index.

        Raises:
            ImportError: without pandas.
        """
        return to_dataframe(self.rows())

    def to_arviz(self, draws: int = 2000, seed: int = 0) -> Any:
        """Draws of the Gaussian that the estimate is: ArviZ's DataTree (InferenceData before 1).

        Raises:
            ImportError: without ArviZ.
            ValueError: where the result keeps no correlations.
        """
        return to_arviz(self.parameters, self.correlation, draws, seed)

    def plot(self, what: str = "intervals") -> Figure:
        """A picture as the report draws it.

        Args:
            what: `intervals` of each parameter by each method, `residuals` of the runs and their
                `spectra`, or `correlation` of the parameters.

        Raises:
            ValueError: another word, or a picture for which the result holds no numbers.
        """
        from freeswing.report.panels.sure import correlation_sheet, interval_sheet

        if what not in PICTURES:
            raise ValueError(f"plot({what!r}): not one of {', '.join(PICTURES)}")
        if what == "intervals":
            identified = self.document if isinstance(self.document, Identification) else None
            estimates = {} if identified is None else identified.ranked
            return interval_sheet(estimates, () if estimates else self.parameters)
        if what == "correlation":
            if not self.correlation:
                raise ValueError("this result keeps no correlations; identify's does")
            return correlation_sheet(self.correlation)
        if self.motion is None or not (self.motion.runs or self.motion.fitted):
            raise ValueError("this result holds no motions; run identify with likelihood=True")
        from freeswing.report.motion import residual_sheet

        return residual_sheet(self.motion, spectra=what == "spectra")

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


def identified(document: Identification, motion: Motion | None = None) -> Found:
    """The best estimate of an identification."""
    best = document.best or ""
    estimate = document.estimates.get(best)
    source = ESTIMATES.get(best, "nothing identified")
    if estimate is None:
        return Found(source, (), document, document.notes, motion)
    notes = (*document.notes, *estimate.notes)
    return Found(source, estimate.parameters, document, notes, motion, estimate.correlation)


def diagnosed(document: Diagnosis, motion: Motion | None = None) -> Found:
    """The parameters with the effects that the model lacked, and the verdict."""
    told = (*verdict(document), *document.notes)
    return Found("with the effects found", document.parameters_after, document, told, motion)
