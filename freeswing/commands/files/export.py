"""Export the identified platform for other programs: URDF, MJCF or JSON."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from freeswing.commands.arguments import add_session, open_session, positive
from freeswing.console import Console

if TYPE_CHECKING:
    from pathlib import Path

    from freeswing.cdpr.robot import Robot
    from freeswing.export.write_exports import Inertia
    from freeswing.session.session_file import Session

SUFFIXES = {"urdf": ".urdf", "mjcf": ".xml", "plain": ".json"}


def add_arguments(parser: ArgumentParser) -> None:
    """The session, the format and the mass."""
    add_session(parser)
    kinds = parser.add_mutually_exclusive_group()
    kinds.add_argument("--urdf", dest="kind", action="store_const", const="urdf")
    kinds.add_argument("--mjcf", dest="kind", action="store_const", const="mjcf")
    kinds.add_argument("--plain", dest="kind", action="store_const", const="plain", help="JSON")
    parser.add_argument(
        "--mass-kg", type=positive, help="mass, where neither payload runs nor robot.toml tell it"
    )


def run(options: Namespace, console: Console) -> None:
    """Write results/platform.urdf, .xml or .json."""
    from freeswing.cdpr.files.documents import InputError, replace_file, write_json
    from freeswing.export import write_exports as exports
    from freeswing.session.drive_session import drive_path
    from freeswing.session.load_swings import load_robot

    # `--json` names the format here, besides its use in every command: the file on stdout.
    kind = options.kind or ("plain" if options.json else None)
    if kind is None:
        raise InputError("freeswing export: choose one of --urdf, --mjcf and --json")
    driven = drive_path(options.session)
    if driven is not None:
        _driven(driven, options, kind, console)
        return
    session = open_session(options)
    robot = load_robot(session)
    _refuse_stale(session)
    inertia = _inertia(options, session.results, robot)
    path = session.results / f"platform{SUFFIXES[kind]}"
    if kind == "plain":
        write_json(path, exports.plain(robot, inertia).to_json())
    else:
        text = getattr(exports, kind)(robot, inertia)
        replace_file(path, text.encode("utf-8"))
    console.say(str(path))
    console.show_file(path)


def _driven(path: Path, options: Namespace, kind: str, console: Console) -> None:
    """A driven robot with its estimated numbers; MJCF alone has motors and springs."""
    import numpy as np

    from freeswing.cdpr.driven.constants import constants
    from freeswing.cdpr.driven.statics import static_pose
    from freeswing.cdpr.files.documents import DataError, InputError, replace_file
    from freeswing.export.driven_mjcf import driven_mjcf
    from freeswing.results.driven.estimates import joint_numbers
    from freeswing.session.drive_session import read_drive_session

    if kind != "mjcf":
        raise InputError(f"{path}: a driven robot is exported as --mjcf alone")
    file = read_drive_session(path, options.results)
    found = file.results / "drive.json"
    values = joint_numbers(found)
    if values is None:
        raise DataError(f"{found}: nothing is identified yet; run freeswing drive first")
    model, asked = file.session.model, file.session.asked
    lost = [name for name in asked.names if values.get(name) is None]
    if lost:
        raise DataError(f"{found}: has no value of {', '.join(lost)}; declare or excite it")
    theta = asked.put(model, model.declared, np.array([values[n] for n in asked.names], float))
    pose = static_pose(model, np.zeros(model.n_cables), theta).pose
    try:
        text = driven_mjcf(model.robot, constants(model, theta), pose)
    except ValueError as error:
        raise DataError(f"{path}: {error}") from error
    result = file.results / "robot.xml"
    replace_file(result, text.encode("utf-8"))
    console.say(str(result))
    console.show_file(result)


def _refuse_stale(session: Session) -> None:
    """What was found for another robot, or from other recordings, is not handed on."""
    from freeswing.cdpr.files.documents import DataError
    from freeswing.session.freshness import stale_results

    used = ("identification.json", "diagnosis.json")
    stale = [one.sentence() for one in stale_results(session) if one.file in used]
    if stale:
        raise DataError("; ".join(stale))


def _inertia(options: Namespace, results: Path, robot: Robot) -> Inertia:
    from freeswing.cdpr.files.documents import DataError
    from freeswing.export.write_exports import inertia_from
    from freeswing.results.diagnosis import Diagnosis
    from freeswing.results.files import read_document
    from freeswing.results.identification import Identification

    identification = read_document(results / "identification.json", Identification)
    diagnosis = read_document(results / "diagnosis.json", Diagnosis)
    if identification is None or identification.best is None:
        raise DataError(f"{results}: nothing is identified yet; run freeswing identify first")
    best = identification.estimates[identification.best].parameters
    rows = (diagnosis.parameters_after if diagnosis else ()) or best
    values = {row.name: row.value for row in [*best, *rows] if row.value is not None}
    mass = options.mass_kg or values.get("mass_kg") or robot.platform.mass_kg
    if not mass or mass <= 0.0:
        raise DataError("swings alone do not tell the mass: give --mass-kg, or payload runs")
    return inertia_from(values, float(mass))
