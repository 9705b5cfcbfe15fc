"""The page: panels in reading order, put into one HTML file that needs nothing else."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Any, Protocol

from jinja2 import Environment, PackageLoader, StrictUndefined, UndefinedError
from markupsafe import Markup

from freeswing.cdpr.files.documents import InputError, replace_file
from freeswing.report.material import Material
from freeswing.report.panels.advice import Advice
from freeswing.report.panels.answer import Answer
from freeswing.report.panels.bench import BenchPanel
from freeswing.report.panels.cameras import Cameras
from freeswing.report.panels.change import Change
from freeswing.report.panels.control import ControlPanel
from freeswing.report.panels.decay import SwingDecay
from freeswing.report.panels.driven import DrivenEstimates
from freeswing.report.panels.driven_motion import DrivenMotion
from freeswing.report.panels.dropped import Dropped
from freeswing.report.panels.geometry import Geometry
from freeswing.report.panels.ladder import EffectLadder
from freeswing.report.panels.markers import Markers
from freeswing.report.panels.provenance import Provenance
from freeswing.report.panels.sure import HowSure
from freeswing.report.panels.swings import Swings
from freeswing.report.tables import csv_tables

# The results that a section is made of, to say why it lacks something. Others (a bench's, markers')
# are left out, with their link, where a session has nothing for them.
MADE_OF = {
    "answer": ("identification",),
    "sure": ("identification",),
    "ladder": ("diagnosis",),
    "change": ("diagnosis", "motion"),
    "swings": ("identification",),
    "cameras": ("calibration", "tracking"),
}
# What numbers, tables and texts in each other's place lead to.
ODD_VALUES = (TypeError, ValueError, LookupError, AttributeError, ArithmeticError)


class Panel(Protocol):
    """One section of the page."""

    name: str
    title: str

    def values(self, material: Material) -> dict[str, Any] | None:
        """What the template `panels/<name>.html` shows, or None where nothing is there to show."""
        ...


PANELS: tuple[Panel, ...] = (
    Answer(),
    BenchPanel(),
    HowSure(),
    EffectLadder(),
    Geometry(),
    Change(),
    SwingDecay(),
    Advice(),
    Swings(),
    Cameras(),
    Markers(),
    Dropped(),
    ControlPanel(),
    Provenance(),
)


def driven_panels(material: Material) -> tuple[Panel, ...]:
    """The sections of a driven robot without a session of free swings."""
    looked_for = (EffectLadder(),) if material.diagnosis is not None else ()
    return (DrivenEstimates(), *looked_for, DrivenMotion(), ControlPanel())


def render_page(material: Material, panels: tuple[Panel, ...] = PANELS) -> str:
    """The report as one HTML document; every value is escaped.

    Raises:
        InputError: where the results are not as this version writes them.
    """
    environment = Environment(
        loader=PackageLoader("freeswing.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    sections = [_section(environment, panel, material) for panel in panels]
    sections = [one for one in sections if _is_shown(one, material)]
    style = (files("freeswing.report") / "templates" / "page.css").read_text(encoding="utf-8")
    page = environment.get_template("page.html")
    return page.render(
        title=material.title,
        sections=sections,
        style=Markup(style),
        warnings=material.warnings,
        refresh_s=material.refresh_s,
    )


def write_page(path: Path, material: Material, panels: tuple[Panel, ...] = PANELS) -> None:
    """Render the report and put it in the place of an older one, its tables as CSV beside it."""
    for name, rows in csv_tables(material).items():
        replace_file(path.with_name(name), rows.encode("utf-8"))
    replace_file(path, render_page(material, panels).encode("utf-8"))


def _is_shown(section: dict[str, Any], material: Material) -> bool:
    """Whether there is something to show, or a reason to say why not.

    An identification without tracked films came from other recordings: no cameras belong to it.
    """
    if section["body"] is not None or section["why"]:
        return True
    needs_cameras = section["name"] == "cameras"
    return section["name"] in MADE_OF and not (needs_cameras and material.identification)


def _section(environment: Environment, panel: Panel, material: Material) -> dict[str, Any]:
    """One section; its body is None where there is nothing to show, and then it says why."""
    try:
        values = panel.values(material)
        body = None
        if values is not None:
            body = Markup(environment.get_template(f"panels/{panel.name}.html").render(values))
    except (*ODD_VALUES, UndefinedError) as failure:
        kind = type(failure).__name__
        raise InputError(
            f"the report's section {panel.title!r}: a result is not as this version writes it "
            f"({kind}: {str(failure)[:200]}); delete the results' .json files and run again"
        ) from failure
    why = material.why_absent(*MADE_OF.get(panel.name, ()))
    return {"name": panel.name, "title": panel.title, "body": body, "why": why}
