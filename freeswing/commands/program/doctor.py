"""Examine this machine: versions, codecs, cores, memory, compiled kernels, a cluster."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from freeswing.console import Console


def add_arguments(parser: ArgumentParser) -> None:
    """A cluster to call on, and whether to compile."""
    parser.add_argument(
        "--cluster", metavar="ADDRESS", help="see also whether a Dask cluster can be used from here"
    )
    parser.add_argument(
        "--compile",
        action="store_true",
        help="compile ahead what calibrating and tracking need, by a short session of its own",
    )


def run(options: Namespace, console: Console) -> None:
    """One line a finding; fails where something that every session needs is not there."""
    from freeswing.cdpr.files.documents import DataError
    from freeswing.doctor.machine import cluster_finding, machine_findings

    if options.compile:
        _compile(console)
    findings = list(machine_findings())
    if options.cluster:
        findings.append(cluster_finding(options.cluster))
    for finding in findings:
        console.say(finding.line())
    console.say_json(
        {"format": "freeswing-doctor/1", "findings": [one.entry() for one in findings]}
    )
    errors = [one.subject for one in findings if one.level == "error"]
    if errors:
        raise DataError(f"not usable here: {', '.join(errors)}")


def _compile(console: Console) -> None:
    """Film, calibrate and track: whatever that calls is compiled, or read."""
    from tempfile import TemporaryDirectory

    from freeswing.demo.rehearsal import compile_ahead

    with TemporaryDirectory() as folder:
        compile_ahead(Path(folder), console)
