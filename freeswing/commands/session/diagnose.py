"""Find what the model lacks, judged on held-out runs: an effect, a group of them, or none."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING, Any

from freeswing.commands.arguments import add_session, add_workers, crew_of, open_session
from freeswing.console import Console

if TYPE_CHECKING:
    from freeswing.cdpr.robot import Robot
    from freeswing.results.diagnosis import Diagnosis
    from freeswing.session.made import Made
    from freeswing.session.session_file import Session
    from freeswing.workers.crew import Crew


def add_arguments(parser: ArgumentParser) -> None:
    """The session and the candidates."""
    add_session(parser)
    add_workers(parser)
    parser.add_argument(
        "--only",
        metavar="EFFECT",
        action="append",
        help="consider this effect; may be repeated (default: the whole catalogue)",
    )


def run(options: Namespace, console: Console) -> None:
    """Diagnose and say before and after."""
    from freeswing.commands.session.drive import diagnose as diagnose_drive
    from freeswing.session.drive_session import drive_path
    from freeswing.session.stages import DIAGNOSE

    driven = drive_path(options.session)
    if driven is not None:
        diagnose_drive(driven, options.results, options.only, console)
        return
    session = open_session(options)
    with crew_of(options, session) as crew:
        result = DIAGNOSE.take(session, console, {"only": options.only}, crew)
    console.say(str(result))
    console.show_file(result)


def make(session: Session, console: Console, settings: dict[str, Any], crew: Crew) -> Made:
    """diagnosis.json and diagnosis_motion.json as documents."""
    import os

    from freeswing.cdpr.effects import catalogue
    from freeswing.cdpr.files.documents import InputError
    from freeswing.cdpr.system.threads import threads
    from freeswing.doctor.refused_runs import refuse_wrong_runs
    from freeswing.ident.diagnose.diagnose import diagnose
    from freeswing.results.diagnosis import Diagnosis
    from freeswing.results.motion_from_results import ladder_motions
    from freeswing.session.load_bench import is_bench
    from freeswing.session.load_swings import load_robot, load_swings, load_target
    from freeswing.session.made import Made

    only = settings["only"]
    for name in only or ():
        if name not in catalogue():
            raise InputError(f"--only {name}: not one of {', '.join(sorted(catalogue()))}")
    robot = load_robot(session)
    if is_bench(session, robot):
        if crew.processes or crew.executor is not None:
            console.say(
                "note: a bench's fits follow one another in this process: --workers and --cluster "
                "change nothing"
            )
        return _make_bench(session, console, robot, only)
    count = crew.processes or os.cpu_count() or 1
    candidates = None if only is None else tuple(only)
    with threads(count):
        swings = list(load_swings(session, robot, load_target(session)))
        refuse_wrong_runs(session, swings, robot)
        found = diagnose(swings, robot, console.progress, count, candidates, crew.executor)
    document = Diagnosis.from_json(found.document())
    _summarise(document, console)
    motions = ladder_motions(found.ladder)
    return Made((("diagnosis.json", document), ("diagnosis_motion.json", motions)))


def _make_bench(session: Session, console: Console, robot: Robot, only: list[str] | None) -> Made:
    """The same of a bench: all its runs in one fit."""
    from freeswing.doctor.bench_runs import refuse_wrong_bench_runs
    from freeswing.ident.bench.diagnose.diagnose import diagnose_bench
    from freeswing.ident.bench.diagnose.document import bench_document
    from freeswing.report.bench_words import diagnosis_lines
    from freeswing.results.diagnosis import Diagnosis
    from freeswing.results.motion import Motion
    from freeswing.session.load_bench import load_bench
    from freeswing.session.load_swings import load_target
    from freeswing.session.made import Made

    bench = load_bench(session, robot, load_target(session))
    refuse_wrong_bench_runs(bench, robot)
    found = diagnose_bench(bench, robot, console.progress, only)
    told = bench_document(found)
    if only is not None:
        told["candidates"] = [row for row in told["candidates"] if row["effect"] in only]
    document = Diagnosis.from_json(told)
    for line in diagnosis_lines(document):
        console.say(f"  {line}")
    return Made((("diagnosis.json", document), ("diagnosis_motion.json", Motion())))


def _summarise(document: Diagnosis, console: Console) -> None:
    from freeswing.report.panels.answer import verdict
    from freeswing.report.panels.ladder import seen_directions
    from freeswing.report.words import millimetres, motion_words, number, plain

    for entry in document.accepted:
        values = ", ".join(f"{p.name} {number(p.value, 4)}" for p in entry.parameters)
        console.say(f"  accepted: {plain(entry.effect)} ({values})")
        if entry.motion:
            console.say(f"    fitted {motion_words(entry.motion)}")
        for sentence in seen_directions(entry.directions):
            console.say(f"    {sentence}")
    for place in document.lengths.wrong if document.lengths else ():
        if place.equilibria is not None and place.equilibria.agrees:
            console.say(
                f"    {plain(place.part.replace(':', ' '))}: cable lengths, and where "
                "the platform hangs, say so each by itself, and agree"
            )
    for sentence in verdict(document):
        console.say(f"  {sentence}")
    before, after = document.before, document.after
    if before is not None and after is not None:
        console.say(
            f"  held-out runs: off by {millimetres(before.prediction_rmse_m)} before, "
            f"{millimetres(after.prediction_rmse_m)} after "
            f"(noise floor {millimetres(after.noise_floor_m)})"
        )
