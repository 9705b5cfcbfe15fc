"""Look a session over before anything is computed: one line a finding, with what to do."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from freeswing.commands.arguments import add_session, open_session
from freeswing.console import Console


def add_arguments(parser: ArgumentParser) -> None:
    """The session."""
    add_session(parser)


def run(options: Namespace, console: Console) -> None:
    """Examine the session; fails where a finding keeps a command from a result."""
    from freeswing.cdpr.files.documents import DataError, write_json
    from freeswing.commands.session.drive import check as check_drive
    from freeswing.doctor.examine import examine
    from freeswing.doctor.finding import counted
    from freeswing.results.check import Check, Found
    from freeswing.session.drive_session import drive_path

    driven = drive_path(options.session)
    if driven is not None:
        check_drive(driven, options.results, console)
        return
    session = open_session(options)
    findings = examine(session, console.progress)
    result = session.results / "check.json"
    found = Check(findings=tuple(Found.from_json(finding.entry()) for finding in findings))
    write_json(result, found.to_json())
    for finding in findings:
        console.say(finding.line())
    console.show_file(result)
    errors = sum(finding.level == "error" for finding in findings)
    if errors:
        raise DataError(f"{session.path}: {counted(errors)} to mend before a result")
    console.say(f"{session.name}: nothing keeps it from a result ({counted(len(findings))})")
