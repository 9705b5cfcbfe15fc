"""The page: panels in reading order, put into one HTML file that needs nothing else."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Any, Protocol

from jinja2 import Environment, PackageLoader, StrictUndefined, UndefinedError
from markupsafe import Markup

from freeswing.cdpr.files.documents import InputError, replace_file
from freeswing.report.answer import Answer
from freeswing.report.cameras import Cameras
from freeswing.report.dropped import Dropped
from freeswing.report.free_full import FreeAgainstFull
from freeswing.report.ladder import EffectLadder
from freeswing.report.markers import Markers
from freeswing.report.material import Material
from freeswing.report.motion import Motion
from freeswing.report.provenance import Provenance
from freeswing.report.sigma import SigmaByRun
from freeswing.report.swings import Swings

# What numbers, tables and texts in each other's place lead to.
ODD_VALUES = (TypeError, ValueError, LookupError, AttributeError, ArithmeticError)


class Panel(Protocol):
    """One section of the page."""

    name: str
    title: str

    def values(self, material: Material) -> dict[str, Any] | None:
        """What the template `<name>.html` shows, or None where nothing is there to show."""
        ...


PANELS: tuple[Panel, ...] = (
    Answer(),
    EffectLadder(),
    FreeAgainstFull(),
    SigmaByRun(),
    Motion(),
    Swings(),
    Cameras(),
    Markers(),
    Dropped(),
    Provenance(),
)


def render_page(material: Material) -> str:
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
    sections = [_section(environment, panel, material) for panel in PANELS]
    style = (files("freeswing.report") / "templates" / "page.css").read_text(encoding="utf-8")
    page = environment.get_template("page.html")
    return page.render(title=material.title, sections=sections, style=Markup(style))


def write_page(path: Path, material: Material) -> None:
    """Render the report and put it in the place of an older one."""
    replace_file(path, render_page(material).encode("utf-8"))


def _section(environment: Environment, panel: Panel, material: Material) -> dict[str, Any]:
    """One section; its body is None where there is nothing to show."""
    try:
        values = panel.values(material)
        body = None
        if values is not None:
            body = Markup(environment.get_template(f"{panel.name}.html").render(values))
    except (*ODD_VALUES, UndefinedError) as failure:
        kind = type(failure).__name__
        raise InputError(
            f"the report's section {panel.title!r}: a result is not as this version writes it "
            f"({kind}: {str(failure)[:200]}); delete the results' .json files and run again"
        ) from failure
    return {"name": panel.name, "title": panel.title, "body": body}
