"""Identify the inertial parameters from the swings, and check them on held-out runs."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from statistics import median
from typing import TYPE_CHECKING, Any

from freeswing.commands.arguments import add_session, open_session, positive
from freeswing.console import Console

if TYPE_CHECKING:
    from freeswing.cdpr.robot import Robot
    from freeswing.ident.likelihood.cable_ends import GeometryPriors
    from freeswing.ident.runs import SwingRun
    from freeswing.results.identification import Identification, ValidatedRun
    from freeswing.session.made import Made
    from freeswing.session.marker_runs import MarkerRuns
    from freeswing.session.session_file import Session
    from freeswing.workers.crew import Crew

MOST_LISTED = 8  # held-out runs with a line each
FURTHER = ("consistent", "entry_std_m", "attachment_std_m")  # settings that are absent by default


def add_arguments(parser: ArgumentParser) -> None:
    """The session and the method."""
    add_session(parser)
    parser.add_argument(
        "--weighting",
        choices=("published", "covariance"),
        default="published",
        help="of FIDIM: as published, or weighted by the samples' covariance",
    )
    parser.add_argument(
        "--fidim-only",
        action="store_true",
        help="leave out the maximum-likelihood fit and the simulated predictions",
    )
    parser.add_argument(
        "--consistent",
        action="store_true",
        help="hold the inertia to what a body can have (positive definite pseudo-inertia)",
    )
    for flag, what in (("entry", "pulley entry"), ("attachment", "platform attachment")):
        parser.add_argument(
            f"--{flag}-std-m",
            type=positive,
            metavar="STD",
            help=f"how well every coordinate of the {what} points is known: they are then "
            "estimated too, by maximum likelihood; default exactly",
        )


def run(options: Namespace, console: Console) -> None:
    """Identify and say the parameters with their 95 % intervals."""
    from freeswing.session.stages import IDENTIFY

    session = open_session(options)
    settings = {"weighting": options.weighting, "likelihood": not options.fidim_only}
    further = {name: getattr(options, name) for name in FURTHER}
    settings |= {name: value for name, value in further.items() if value}
    result = IDENTIFY.take(session, console, settings)
    console.say(str(result))
    console.show_file(result)


def make(session: Session, console: Console, settings: dict[str, Any], crew: Crew) -> Made:
    """identification.json and motion.json as documents."""
    import os

    from freeswing.cdpr.system.threads import threads
    from freeswing.doctor.refused_runs import refuse_wrong_runs
    from freeswing.ident.identify import IdentifySettings, identify
    from freeswing.ident.swing_places import swing_places
    from freeswing.results.identification import Identification
    from freeswing.results.markers import marker_document
    from freeswing.results.motion_from_results import predicted_motions
    from freeswing.session.load_bench import is_bench
    from freeswing.session.load_swings import load_robot, load_swings, load_target
    from freeswing.session.made import Made
    from freeswing.session.marker_runs import read_marker_runs

    robot = load_robot(session)
    if is_bench(session, robot):
        return _make_bench(session, console, robot, settings)
    target = load_target(session)
    count = crew.processes or os.cpu_count() or 1
    with threads(count):
        markers = read_marker_runs(session, target)
        swings = load_swings(session, robot, target, markers)
    refuse_wrong_runs(session, swings, robot)
    geometry = _geometry(settings)
    chosen = IdentifySettings(
        weighting=settings["weighting"],
        maximum_likelihood=settings["likelihood"],
        predict=settings["likelihood"],
        consistent=settings.get("consistent", False),
        geometry=geometry,
    )
    with threads(count):
        found = identify(list(swings), robot, chosen, console.progress)
    noted = _recording_notes(session, swings, markers)
    told = found.document()
    document = Identification.from_json(
        {
            **told,
            "notes": [*told["notes"], *noted],
            "swings": swing_places(robot, found),
            "entries_m": robot.entries_m,
            "markers": marker_document(markers),
        }
    )
    _summarise(document, found.best, console)
    for sentence in document.estimates[found.best].notes:
        console.say(f"  {sentence}")
    return Made((("identification.json", document), ("motion.json", predicted_motions(found))))


def _geometry(settings: dict[str, Any]) -> GeometryPriors:
    """How well the cables' ends are known."""
    from freeswing.cdpr.files.documents import InputError
    from freeswing.ident.likelihood.cable_ends import GeometryPriors

    try:
        return GeometryPriors(settings.get("entry_std_m"), settings.get("attachment_std_m"))
    except ValueError as error:
        raise InputError(f"--{str(error).replace('_', '-', 2)}") from error


def _make_bench(session: Session, console: Console, robot: Robot, settings: dict[str, Any]) -> Made:
    """The same of a bench: all its runs in one fit."""
    from freeswing.doctor.bench_runs import refuse_wrong_bench_runs
    from freeswing.ident.bench.identify_bench import identify_bench
    from freeswing.report.bench_words import bench_lines
    from freeswing.results.identification import Identification
    from freeswing.results.motion import Motion
    from freeswing.session.load_bench import load_bench
    from freeswing.session.load_swings import load_target
    from freeswing.session.made import Made

    _refuse_settings_of_cable_robots(settings)
    bench = load_bench(session, robot, load_target(session))
    refuse_wrong_bench_runs(bench, robot)
    told = identify_bench(bench, robot, _geometry(settings)).document()
    document = Identification.from_json({**told, "entries_m": robot.entries_m})
    for line in bench_lines(document):
        console.say(line)
    return Made((("identification.json", document), ("motion.json", Motion())))


def _refuse_settings_of_cable_robots(settings: dict[str, Any]) -> None:
    from freeswing.cdpr.files.documents import InputError

    asked = {
        "--weighting covariance": settings["weighting"] != "published",
        "--fidim-only": not settings["likelihood"],
        "--consistent": settings.get("consistent", False),
    }
    given = [name for name, there in asked.items() if there]
    if given:
        raise InputError(
            f"{' and '.join(given)}: this session is a bench's (parallel wires, or runs that "
            "measure less than the free coordinates), whose runs are all in one maximum-likelihood "
            "fit of masses, centres and tensors; FIDIM and its settings are for cable robots. "
            "Leave it out"
        )


def _recording_notes(
    session: Session, swings: tuple[SwingRun, ...], markers: MarkerRuns
) -> list[str]:
    """What of the recordings was left out, put right or contradicts the session file."""
    from freeswing.doctor.markers import marker_findings
    from freeswing.doctor.time_stamps import stamp_findings

    found = list(marker_findings(markers))
    notes = []
    for run in swings:
        subject = f"run {run.name}"
        found += stamp_findings(subject, run.trajectory, session.frame_rate_hz)
        notes += [f"{subject}: {note}" for note in run.trajectory.notes]
    return notes + [finding.sentence() for finding in found if finding.level == "warning"]


def _summarise(document: Identification, best: str, console: Console) -> None:
    from freeswing.report.grouped_notes import grouped
    from freeswing.report.words import ESTIMATES, parameter_row

    console.say(f"{ESTIMATES[best]}, ± 95 %")
    for parameter in document.estimates[best].parameters:
        row = parameter_row(parameter)
        line = f"  {row['name']:6} {row['value']:>12} ± {row['half_width']:<10} {row['unit']}"
        console.say(f"{line}  {row['weak']}".rstrip())
    for dropped in document.estimates[best].dropped_runs:
        console.say(f"  run {dropped.run} left out: {dropped.why}")
    for line in _held_out_lines(document.validation):
        console.say(f"  {line}")
    for note in grouped(document.notes):
        console.say(f"  note: {note}")


def _held_out_lines(runs: tuple[ValidatedRun, ...]) -> list[str]:
    """A line for each held-out run; of many, the usual one and the worst."""
    from freeswing.report.words import millimetres, number

    lines = [_held_out_line(run) for run in runs]
    errors = [run.prediction_rmse_m or 0.0 for run in runs]
    scatter = [run.sigma_perp or 0.0 for run in runs]
    if len(runs) <= MOST_LISTED or not any(errors):
        return lines
    worst = dict.fromkeys([errors.index(max(errors)), scatter.index(max(scatter))])
    return [
        f"{len(runs)} held-out runs: off by {millimetres(median(errors))} in the median, "
        f"sigma_perp {number(median(scatter))}; the worst, each is in the report:",
        *(lines[k] for k in worst),
    ]


def _held_out_line(run: ValidatedRun) -> str:
    from freeswing.report.words import millimetres, number

    error, floor = millimetres(run.prediction_rmse_m), millimetres(run.noise_floor_m)
    predicted = f"off by {error} (noise {floor}), " if run.prediction_rmse_m else ""
    return f"{run.run}: {predicted}sigma_perp {number(run.sigma_perp)}"
