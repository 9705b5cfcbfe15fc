"""Set two or more results side by side: before and after a repair, two days, two methods."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from freeswing.console import Console

if TYPE_CHECKING:
    from freeswing.results.comparison import Comparison


def add_arguments(parser: ArgumentParser) -> None:
    """Sessions or result files; the first is what the others are held against."""
    parser.add_argument(
        "results",
        metavar="RESULT",
        nargs="+",
        help="a session, its results folder, identification.json, diagnosis.json or truth.json; "
        "RESULT:ml_free and the like name one estimate",
    )
    parser.add_argument(
        "--picture", metavar="FILE", help="draw all intervals side by side (.svg, .png, .pdf)"
    )


def run(options: Namespace, console: Console) -> None:
    """Read, compare, and say what differs by more than its uncertainty."""
    from freeswing.cdpr.files.documents import InputError
    from freeswing.results.comparison import compare, read_side

    if len(options.results) < 2:
        raise InputError("freeswing compare: name at least two results to compare")
    found = compare([read_side(name) for name in options.results])
    for line in lines(found):
        console.say(line)
    if options.picture:
        from freeswing.report.comparison_picture import write_picture

        write_picture(Path(options.picture), found)
        console.say(options.picture)
    console.say_json(found.to_json())


def lines(found: Comparison) -> list[str]:
    """The comparison as a table and a sentence a side."""
    from freeswing.report.words import plain, unit_of, with_decimals

    names = [side.name for side in found.sides]
    width = max(16, *(len(Path(name).name) + 2 for name in names))
    head = "".join(f"{Path(name).name:>{width}}" for name in names)
    told = [f"{'':8}{head}{'worst z':>10}"]
    for row in found.rows:
        stem, scale, unit = unit_of(row.name)
        cells = [
            with_decimals(
                None if value is None else scale * value, None if std is None else scale * std
            )
            for value, std in zip(row.values, row.stds, strict=True)
        ]
        worst = max((abs(z) for z in row.z if z is not None), default=None)
        mark = "–" if worst is None else f"{worst:.1f}"
        told.append(
            f"{plain(stem):8}{''.join(f'{cell:>{width}}' for cell in cells)}{mark:>10}  {unit}"
        )
    return [*told, *found.verdicts]
