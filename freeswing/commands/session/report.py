"""Put all results into one self-contained page, results/report.html."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from freeswing.commands.arguments import add_session, open_session
from freeswing.console import Console

if TYPE_CHECKING:
    from freeswing.cdpr.robot import Robot
    from freeswing.report.material import Material
    from freeswing.session.session_file import Session


def add_arguments(parser: ArgumentParser) -> None:
    """The session."""
    add_session(parser)
    parser.add_argument("--open", action="store_true", help="show the page in a browser")


def run(options: Namespace, console: Console) -> None:
    """Render what results there are; what is out of date or cannot be read is named."""
    from freeswing.cdpr.files.documents import InputError

    driven = _driven(options)
    if driven is not None:
        page, material = driven
    else:
        page, material = write_report(open_session(options))
    for warning in material.warnings:
        console.complain(warning)
    console.say(str(page))
    console.say_json({"format": "freeswing-report/1", "page": str(page)})
    if options.open:
        open_page(page, console)
    unreadable = [why for why in material.absent.values() if "not a result" in why]
    if unreadable:
        raise InputError("; ".join(dict.fromkeys(unreadable)))


def _driven(options: Namespace) -> tuple[Path, Material] | None:
    """The page of a driven robot; None for a session of free swings."""
    from freeswing.session.drive_session import drive_path

    given = Path(options.session)
    named = drive_path(given) or _driven_robot(given)
    return None if named is None else driven_page(named, options.results)


def driven_page(named: Path, folder: str | None) -> tuple[Path, Material]:
    """The page of a driven robot, and what it was made of.

    Args:
        named: its drive.toml or robot.toml.
        folder: of the results, None for `results` beside it.

    Raises:
        InputError: where neither an estimate nor a controller nor a run of one is there.
    """
    from freeswing.cdpr.files.documents import InputError
    from freeswing.cdpr.system.confine import results_folder
    from freeswing.report.material import read_material
    from freeswing.report.page import driven_panels, write_page

    results = results_folder(named.parent, folder)
    material = read_material(named.resolve().parent.name, results, folder=str(named.parent))
    if material.control is None and material.drive is None:
        why = material.why_absent("control", "drive")
        todo = f"freeswing design {named.parent}"
        if named.name == "robot.toml":
            todo += (
                f"; for swings or a bench {named.parent} lacks a session.toml, which freeswing new "
                "writes"
            )
        else:
            todo += f", or freeswing drive {named}"
        raise InputError(why or f"{results}: nothing to show of a driven robot yet: {todo}")
    page = results / "report.html"
    write_page(page, material, driven_panels(material))
    return page, material


def _driven_robot(given: Path) -> Path | None:
    """The robot.toml of a folder without a session, or the file itself."""
    if given.is_dir():
        alone = not (given / "session.toml").is_file()
        return given / "robot.toml" if alone and (given / "robot.toml").is_file() else None
    return given if given.name == "robot.toml" and given.is_file() else None


def write_report(
    session: Session,
    failures: Mapping[str, str] | None = None,
    refresh_s: float | None = None,
) -> tuple[Path, Material]:
    """Render the page; gives its path and what it was made of.

    Args:
        session: whose results are shown. Those that are out of date are named; where they do not
            belong to what stands beside them they are left out.
        failures: why stages came to no result just now, by the stage's name.
        refresh_s: the page reads itself anew so often; None: it stays as it is.
    """
    from freeswing.report.material import read_material
    from freeswing.report.page import write_page
    from freeswing.session.freshness import stale_results

    stale = stale_results(session)
    left_out = {one.file: f"{one.sentence()}. It is left out here." for one in stale if one.mixed}
    kinds = {"calibrate": "calibration", "track": "tracking", "identify": "identification"}
    kinds |= {"diagnose": "diagnosis"}
    absent = {kinds[name]: why for name, why in (failures or {}).items()}
    robot = _robot(session)
    if not any(run.role == "validate" for run in session.runs) and not _is_bench(session, robot):
        absent.setdefault("diagnosis", NO_VALIDATION)
    material = read_material(
        session.name,
        session.results,
        robot=robot,
        folder=str(session.folder),
        left_out=left_out,
        absent=absent,
        warnings=tuple(one.sentence() for one in stale if not one.mixed),
    )
    material = replace(material, refresh_s=refresh_s)
    page = session.results / "report.html"
    write_page(page, material)
    return page, material


NO_VALIDATION = (
    'No run has role = "validate": missing effects are judged on runs that are never fitted, so '
    "freeswing diagnose has nothing to judge by. Give a third of the runs that role."
)


def _is_bench(session: Session, robot: Robot | None) -> bool:
    """Whether `diagnose` leaves each run out in turn, where none has role validate."""
    from freeswing.session.load_bench import is_bench

    return robot is not None and is_bench(session, robot)


def open_page(page: Path, console: Console) -> None:
    """Show a page where there is a desktop."""
    import webbrowser

    from freeswing.console import has_desktop

    if not has_desktop() or not webbrowser.open(page.resolve().as_uri()):
        console.say("no desktop here: open the page yourself")


def _robot(session: Session) -> Robot | None:
    """The declared robot, for the drawing; None where its file cannot be read."""
    from freeswing.cdpr.files.documents import InputError
    from freeswing.session.load_swings import load_robot

    try:
        return load_robot(session)
    except InputError:
        return None
