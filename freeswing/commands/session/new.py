"""Begin a session: commented files with the numbers still missing marked, from what there is."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from freeswing.commands.arguments import positive
from freeswing.console import Console
from freeswing.starter.kinds import KINDS

FILMED_RUNS = 6
FILES = ("robot.toml", "target.toml", "session.toml")


def add_arguments(parser: ArgumentParser) -> None:
    """The folder, what hangs, and what measures it."""
    parser.add_argument("folder", metavar="DIR", help="a new folder, or one without these files")
    told = "; ".join(f"{name}: {kind.says}" for name, kind in KINDS.items())
    parser.add_argument("--kind", choices=tuple(KINDS), default="cable-robot", help=told)
    parser.add_argument("--cables", type=int, metavar="N", help="how many, 1 to 5; as the kind has")
    parser.add_argument("--mass-kg", type=positive, help="of the platform, where it was weighed")
    parser.add_argument(
        "--mocap",
        nargs="+",
        metavar="FILE",
        help=".trc or .c3d recordings, one a swing: markers and rate are read, the files copied",
    )
    parser.add_argument(
        "--tag-m", type=positive, default=0.08, help="side of the printed tags (0.08), for cameras"
    )


def run(options: Namespace, console: Console) -> None:
    """Write the files and say what to do next; nothing that is there is written over."""
    from freeswing.cdpr.files.documents import InputError, replace_file
    from freeswing.starter.kinds import robot_toml

    folder, kind = Path(options.folder), KINDS[options.kind]
    cables = kind.cables if options.cables is None else options.cables
    if not 1 <= cables <= 5:
        raise InputError(f"--cables {cables}: 1 to 5 strings leave a free motion to record")
    name = folder.resolve().name
    there = [str(folder / file) for file in FILES if (folder / file).exists()]
    if there:
        raise InputError(f"{', '.join(there)}: already there; name a new folder")
    target, session, recordings = _measured(options, name, console)
    for file, data in recordings.items():
        replace_file(folder / "runs" / file, data)
    texts = (robot_toml(name, kind, cables, options.mass_kg), target, session)
    for file, text in zip(FILES, texts, strict=True):
        replace_file(folder / file, text.encode("utf-8"))
        console.say(str(folder / file))
    console.say_json({"format": "freeswing-new/1", "folder": str(folder)})
    prints = f"freeswing board {folder} draws tags and board to scale. " if not recordings else ""
    console.say(
        f"{prints}Replace every nan in robot.toml by what you measure, then: "
        f"freeswing check {folder}"
    )


def _measured(options: Namespace, name: str, console: Console) -> tuple[str, str, dict[str, bytes]]:
    """target.toml, session.toml, and recordings to copy, by their names."""
    from freeswing.cdpr.files.documents import InputError
    from freeswing.starter import files

    if not options.mocap:
        from freeswing.starter.markers import role

        runs = [(f"swing-{k + 1:02d}", role(k, FILMED_RUNS)) for k in range(FILMED_RUNS)]
        return files.tag_target(options.tag_m), files.filmed_session(name, runs), {}
    from freeswing.starter.markers import look_over

    found = look_over([Path(file) for file in options.mocap])
    names = [file.stem for file in found.files]
    if len(set(names)) < len(names):
        raise InputError("--mocap: two recordings have the same name; rename one")
    console.say(
        f"{len(found.files)} recordings of {', '.join(found.names)} at {found.rate_hz:g} Hz; the "
        f"markers keep their distances to {1e3 * found.spread_m:.2f} mm"
    )
    copies = {file.name: file.read_bytes() for file in found.files}
    return files.marker_target(found), files.marker_session(name, found), copies
