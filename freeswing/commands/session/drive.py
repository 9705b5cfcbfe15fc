"""Identify a driven robot: geometry, inertia, friction and springs, and check it on other runs."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from dataclasses import replace
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from freeswing.commands.arguments import add_effects, add_results
from freeswing.console import Console
from freeswing.ident.drive.trust import ABOVE_NOISE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from freeswing.results.driven.estimates import DriveResult
    from freeswing.session.drive_session import DriveFile


def add_arguments(parser: ArgumentParser) -> None:
    """The session."""
    parser.add_argument("session", metavar="SESSION", help="a session's folder or drive.toml")
    add_results(parser, "SESSION/results")
    add_effects(
        parser,
        "NAME[.PART]",
        "estimate the numbers of an effect too, of all motors or cables or of one, such as "
        "drum_radius.4; may be repeated",
        "where a number of an effect starts, or stays if it is not asked for",
    )


def run(options: Namespace, console: Console) -> None:
    """Look the recordings over, estimate, write, say."""
    from freeswing.session.drive_session import drive_path, read_drive_session

    path = drive_path(options.session)
    if path is None:
        named = Path(options.session)
        path = named / "drive.toml" if named.is_dir() else named
    identify(read_drive_session(path, options.results), console, options.effect, options.set)


def examined(file: DriveFile) -> None:
    """Refuse recordings with which any fit would be wrong.

    Raises:
        DataError: with every finding.
    """
    from freeswing.cdpr.files.documents import DataError
    from freeswing.ident.drive.records.mistaken_records import findings

    found = findings(file.session)
    if found:
        raise DataError("\n  ".join([f"{file.path}: {len(found)} to mend first", *found]))


def identify(
    file: DriveFile,
    console: Console,
    effects: Sequence[str] = (),
    starts: Sequence[tuple[str, float]] = (),
) -> Path:
    """drive.json of a session, its joint estimate with the numbers of `effects`.

    Raises:
        InputError: for an effect, or a number of one, that there is not.
        DataError: when the recordings cannot give a result.
    """
    from freeswing.cdpr.files.documents import DataError, InputError, write_json
    from freeswing.ident.drive.added_effects import with_effects
    from freeswing.ident.drive.identify import identify_drive
    from freeswing.ident.drive.identify_effects import identify_with_effects
    from freeswing.results.driven.drive import drive_document, drive_motion_document

    session, held = file.session, ()
    if effects or starts:
        try:
            larger = with_effects(session, effects, starts)
        except ValueError as error:
            raise InputError(str(error)) from error
        session, held = larger.session, larger.held
    examined(replace(file, session=session))
    for name in held:
        console.complain(
            f"{name} stays as the robot's file has it: the effects can do whatever it does"
        )
    identified = identify_with_effects if session.asked.added else identify_drive
    try:
        found = identified(session, console.progress)
    except ValueError as error:
        raise DataError(f"{file.path}: {error}") from error
    document = drive_document(file.name, session, found, effects, held)
    result = file.results / "drive.json"
    write_json(result, document.to_json())
    motion = drive_motion_document(file.name, session, found)
    write_json(file.results / "drive_motion.json", motion.to_json())
    _say(document, console)
    console.say(str(result))
    console.show_file(result)
    return result


def check(path: Path, results: str | None, console: Console) -> None:
    """check.json of a session of a driven robot.

    Raises:
        DataError: when a finding keeps it from a result.
    """
    from freeswing.cdpr.files.documents import DataError, write_json
    from freeswing.doctor.finding import Finding, counted
    from freeswing.doctor.robot_file.mass_and_inertia import mass_findings
    from freeswing.ident.drive.records.mistaken_records import findings
    from freeswing.session.drive_session import read_drive_session

    file = read_drive_session(path, results)
    told = [Finding("error", "", text) for text in findings(file.session)]
    units = [*mass_findings(file.session.model.robot)]
    entries = [one.entry() for one in (*told, *units)]
    write_json(file.results / "check.json", {"format": "freeswing-check/1", "findings": entries})
    for text in (*(one.text for one in told), *(one.line() for one in units)):
        console.say(text)
    console.show_file(file.results / "check.json")
    wrong = [*told, *(one for one in units if one.level == "error")]
    if wrong:
        raise DataError(f"{path}: {len(wrong)} to mend before a result")
    console.say(f"{file.name}: nothing keeps it from a result ({counted(len(entries))})")


def diagnose(path: Path, results: str | None, only: list[str] | None, console: Console) -> None:
    """diagnosis.json of a session of a driven robot.

    Raises:
        InputError: for an effect that driven robots do not have.
        DataError: when the recordings cannot give a result.
    """
    from freeswing.cdpr.effects import driven_catalogue
    from freeswing.cdpr.files.documents import DataError, InputError, write_json
    from freeswing.ident.drive.diagnose.diagnose import diagnose_drive
    from freeswing.results.driven.drive import drive_diagnosis_document
    from freeswing.session.drive_session import read_drive_session

    file, known = read_drive_session(path, results), driven_catalogue()
    for name in only or ():
        if name not in known:
            raise InputError(f"--only {name}: not one of {', '.join(sorted(known))}")
    examined(file)
    try:
        found = diagnose_drive(file.session, console.progress, only)
    except ValueError as error:
        raise DataError(f"{file.path}: {error}") from error
    document = drive_diagnosis_document(file.name, file.session, found)
    result = file.results / "diagnosis.json"
    write_json(result, document)
    _say_missing(document, console)
    console.say(str(result))
    console.show_file(result)


def _say_missing(document: dict[str, Any], console: Console) -> None:
    for entry in document["accepted"]:
        part = f" of {entry['part']}" if "part" in entry else ""
        console.say(f"  accepted: {entry['effect']}{part} ({_values(entry)})")
        for one in entry["evidence"][:2]:
            console.say(
                f"    seen in {one['run']} from {one['from_s']:g} to {one['to_s']:g} s "
                f"({100.0 * one['share']:.0f} % of what it explains)"
            )
    groups = {
        tuple(sorted([_label(entry), *entry["confounded_with"]]))
        for entry in document["candidates"]
        if entry["verdict"] == "confounded"
    }
    for group in groups:
        console.say(f"  these recordings cannot tell apart: {', '.join(group)}")
        for entry in document["candidates"]:
            if _label(entry) in group and "parameters" in entry:
                console.say(f"    if it is {_label(entry)}: {_values(entry)}")
    left = document["unexplained"]
    if left["present"]:
        console.complain(f"none of these explains what remains: {left['signature']}")
    elif not document["accepted"] and not groups:
        console.say("  nothing is missing: what the model leaves is noise")
    before, after = document["before"], document["after"]
    if "motor_rmse_rad" in before and "motor_rmse_rad" in after:
        console.say(
            f"  held-out runs: motor angles off by {before['motor_rmse_rad']:.2g} rad before, "
            f"{after['motor_rmse_rad']:.2g} after (counts leave {after['motor_noise_rad']:.2g})"
        )


def _values(entry: dict[str, Any]) -> str:
    """Numbers of an effect with their deviations."""
    return ", ".join(
        f"{p['name']} {p['value']:.4g} +- {p['std'] or float('nan'):.2g}"
        for p in entry["parameters"]
    )


def _label(entry: dict[str, Any]) -> str:
    return f"{entry['effect']}.{entry['part']}" if "part" in entry else entry["effect"]


def _say(document: DriveResult, console: Console) -> None:
    for entry in document.estimates.joint.parameters:
        if not entry.identifiable:
            console.complain(
                f"{entry.name} is not determined by these recordings: no run excites it enough"
            )
            continue
        bound = "  on a bound of the search: no estimate" if entry.on_bound else ""
        value, std = _number(entry.value), _number(entry.std)
        share = 100.0 * std / abs(value) if value else 0.0
        console.say(f"  {entry.name:24} {value:12.6g}  +- {std:.2g} ({share:.2g} %){bound}")
    lost = [e.name for e in document.estimates.joint.parameters if e.value is None]
    if len(lost) > 1:
        console.complain(
            f"of these {len(lost)} perhaps only combinations are determined (all torque constants "
            "with mass, friction and springs are, for one): take one whose value is known out of "
            "[unknown], or name one motor, as --effect torque_constant.1"
        )
    for fit in document.fit_percent:
        mean = sum(map(_number, fit.matlab)) / len(fit.matlab)
        times = _number(document.residual.times_noise[fit.run])
        console.say(
            f"  {fit.run} ({fit.role}): FIT {mean:.2f} %, angles {times:.2f} times their noise"
        )
    for one in document.ramps:
        moved = "never moved" if one.ramp_N_m is None else f"{one.ramp_N_m:.2e} N m"
        console.say(
            f"  ramp {one.run} (motor {one.motor}, {_number(one.slope_A_s):.3g} A/s): {moved}; "
            f"read of the estimate {_number(one.estimate_on_this_ramp_N_m):.2e}, off by "
            f"{_number(one.slope_costs_N_m):.1e} from its friction "
            f"{_number(one.estimate_N_m):.2e}"
        )
    _warn(document, console)


def _number(value: float | None) -> float:
    """The number, NaN where it is not finite."""
    return nan if value is None else value


def _warn(document: DriveResult, console: Console) -> None:
    """FIT alone passes nothing: what is left over is said."""
    for entry in document.slack:
        if entry.in_model:  # elastic cables go slack by themselves
            continue
        console.complain(
            f"run {entry.run}: cables {', '.join(entry.cables)} would have had to push at "
            f"{entry.samples} samples, first at {_number(entry.from_s):.3f} s: nothing is fitted "
            "to, or judged by, what follows in this run"
        )
    for entry in document.saturated:
        console.complain(
            f"run {entry.run}: motors {', '.join(entry.motors)} were asked for more than "
            f"current_limits_A at {entry.samples} samples: they are taken to give the limit"
        )
    times = document.residual.times_noise
    wrong = [f"{run} {value:.1f}" for run, value in times.items() if value and value > ABOVE_NOISE]
    if wrong:
        console.complain(
            f"the angles' residuals are above their noise (times: {', '.join(wrong)}): something "
            "is missing in the model, and the deviations above do not count it; see diagnose"
        )
    first = document.estimates.output_error
    apart = _number((first or document.estimates.joint).second_start_z)
    if apart > 1.0:
        what = "the joint estimate" if first is None else "output error"
        console.complain(
            f"{what} ends {apart:.1f} deviations elsewhere from a second start: another minimum; "
            "do not trust its numbers"
        )
