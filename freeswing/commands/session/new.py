"""Begin a session: commented files with the numbers still missing marked, from what there is."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from freeswing.commands.arguments import positive
from freeswing.console import Console
from freeswing.starter.kinds import KINDS

if TYPE_CHECKING:
    from freeswing.starter.filmed import Filmed
    from freeswing.starter.questions import Answers

FILMED_RUNS = 6
FILES = ("robot.toml", "target.toml", "session.toml")
PAPERS = ("a4", "letter", "a3")
USUAL_KIND, USUAL_RATE_HZ, USUAL_TAG_M = "cable-robot", 30.0, 0.075


def add_arguments(parser: ArgumentParser) -> None:
    """The folder, what hangs, and what measures it."""
    parser.add_argument("folder", metavar="DIR", help="a new folder, or one without these files")
    told = "; ".join(f"{name}: {kind.says}" for name, kind in KINDS.items())
    parser.add_argument("--kind", choices=tuple(KINDS), help=f"{told} (default {USUAL_KIND})")
    parser.add_argument("--cables", type=int, metavar="N", help="how many, 1 to 5; as the kind has")
    parser.add_argument("--mass-kg", type=positive, help="of the platform, where it was weighed")
    parser.add_argument(
        "--mocap",
        nargs="+",
        metavar="FILE",
        help="recordings of markers (.trc .c3d, text of Motive, Vicon, QTM) or poses (.csv): "
        "markers, rate and free swings are read, the files copied; of benches any part of a pose, "
        "or uncalibrated columns (.csv)",
    )
    parser.add_argument(
        "--cameras",
        nargs="+",
        metavar="NAME",
        help="cameras or phones; one is enough, two are far better (default left right)",
    )
    parser.add_argument(
        "--above",
        action="store_true",
        help="one phone above a bench of two or three strings (--kind trifilar, bifilar): nothing "
        "to calibrate",
    )
    parser.add_argument("--rate-hz", type=positive, help=f"frames a second ({USUAL_RATE_HZ:g})")
    parser.add_argument(
        "--tag-m", type=positive, help=f"side of the platform's printed tags ({USUAL_TAG_M:g})"
    )
    parser.add_argument(
        "--paper", choices=PAPERS, default=PAPERS[0], help="what tags and board are printed on"
    )
    parser.add_argument(
        "--no-questions",
        action="store_true",
        help="at a terminal too: take what flags do not say as usual (so with --kind)",
    )


def run(options: Namespace, console: Console) -> None:
    """Write the files and say what to do next; nothing that is there is written over."""
    from freeswing.cdpr.files.documents import InputError, replace_file
    from freeswing.starter.bench_signals import are_signals
    from freeswing.starter.kinds import robot_toml

    folder = Path(options.folder)
    there = [str(folder / file) for file in FILES if (folder / file).exists()]
    if there:
        raise InputError(f"{', '.join(there)}: already there; name a new folder")
    answers = _answers(options)
    kind = KINDS[answers.kind or USUAL_KIND]
    cables = _cables(answers)
    if not 1 <= cables <= 5:
        raise InputError(f"--cables {cables}: 1 to 5 strings leave a free motion to record")
    name = folder.resolve().name
    beside = _above if answers.measured_by == "above" else _filmed
    beside = _recorded if answers.recordings else beside
    if answers.recordings and kind.is_bench and are_signals(answers.recordings):
        beside = _signals
    written = {
        "robot.toml": robot_toml(name, kind, cables, answers.mass_kg).encode("utf-8"),
        **beside(name, answers, options.paper, console),
    }
    for file, data in written.items():
        replace_file(folder / file, data)
        if not file.startswith("runs/"):
            console.say(str(folder / file))
    console.say_json(
        {
            "format": "freeswing-new/1",
            "folder": str(folder),
            "files": sorted(written),
            "missing": sum(data.count(b"nan") for f, data in written.items() if f in FILES),
        }
    )
    for line in _next(folder, written):
        console.say(line)


def _cables(answers: Answers) -> int:
    """How many strings: as said, else as the kind has."""
    kind = KINDS[answers.kind or USUAL_KIND]
    return kind.cables if answers.cables is None else answers.cables


def _answers(options: Namespace) -> Answers:
    """What flags say, and what a person at a terminal adds."""
    from freeswing.cdpr.files.documents import InputError
    from freeswing.starter.questions import Answers, ask, files_of

    recordings = files_of(options.mocap or ())
    for file in recordings:
        if not file.name.isprintable():
            raise InputError(f"--mocap {file.name!r}: holds a control character: rename it")
    for word in options.mocap or ():
        if not files_of([word]):
            raise InputError(f"--mocap {word}: no such file")
    if recordings and (options.cameras or options.above):
        raise InputError("--mocap, --cameras, --above: give one of them")
    if options.above and len(options.cameras or ()) > 1:
        raise InputError("--above: takes one camera; leave it out for several")
    said = Answers(
        kind=options.kind,
        cables=options.cables,
        mass_kg=options.mass_kg,
        measured_by=_measured_by(options, bool(recordings)),
        recordings=recordings,
        cameras=tuple(options.cameras or ()),
        rate_hz=options.rate_hz,
        tag_m=options.tag_m,
    )
    is_asked = options.kind is None and not options.no_questions
    is_asked = is_asked and sys.stdin.isatty() and sys.stderr.isatty()
    quiet = options.json or options.quiet
    told = ask(said) if is_asked and not quiet else said
    _check_names(told.cameras)
    return told


def _check_names(cameras: Sequence[str]) -> None:
    from freeswing.cdpr.files.documents import InputError
    from freeswing.session.session_file import as_run_name

    for camera in cameras:
        if as_run_name(camera) != camera:
            raise InputError(
                f"--cameras {camera[:40]!r}: its films are named so, which not every computer lets "
                f"files be: take letters, digits, spaces, . _ -, such as {as_run_name(camera)[:40]}"
            )


def _measured_by(options: Namespace, recorded: bool) -> str | None:
    if recorded:
        return "mocap"
    if options.above:
        return "above"
    return "cameras" if options.cameras else None


def _above(name: str, answers: Answers, paper: str, console: Console) -> dict[str, bytes]:
    """target.toml, session.toml and the sheet to print, for one phone above a bench."""
    from freeswing.cdpr.files.documents import InputError
    from freeswing.printing.pages import pages_pdf
    from freeswing.starter import filmed
    from freeswing.starter.above import KINDS_ABOVE, above_session

    kind = answers.kind or USUAL_KIND
    if kind not in KINDS_ABOVE:
        raise InputError(
            f"--above --kind {kind}: a film from above shows x, y and yaw alone, which are the "
            f"swing of parallel strings: {', '.join(KINDS_ABOVE)}"
        )
    chosen = _chosen(answers, paper, ("phone",))
    return {
        "target.toml": filmed.tag_target(chosen).encode("utf-8"),
        "session.toml": above_session(name, chosen, KINDS[kind].cables).encode("utf-8"),
        "print.pdf": pages_pdf(filmed.pages(chosen)[:1], paper),
    }


def _chosen(answers: Answers, paper: str, cameras: tuple[str, ...]) -> Filmed:
    """What was chosen, or is usual.

    Raises:
        InputError: where the tags do not fit on the paper.
    """
    from freeswing.cdpr.files.documents import InputError
    from freeswing.starter import filmed

    chosen = filmed.Filmed(
        answers.cameras or cameras,
        answers.rate_hz or USUAL_RATE_HZ,
        answers.tag_m or USUAL_TAG_M,
        paper,
    )
    largest = filmed.largest_tag_m(paper)
    if chosen.tag_m > largest:
        raise InputError(
            f"--tag-m {chosen.tag_m:g}: four of them do not fit on {paper}; at most {largest:.3f}, "
            "or --paper a3"
        )
    return chosen


def _filmed(name: str, answers: Answers, paper: str, console: Console) -> dict[str, bytes]:
    """target.toml, session.toml and what to print, by their names."""
    from freeswing.printing.pages import pages_pdf
    from freeswing.starter import filmed
    from freeswing.starter.markers import role

    chosen = _chosen(answers, paper, ("left", "right"))
    runs = [(f"swing-{k + 1:02d}", role(k, FILMED_RUNS)) for k in range(FILMED_RUNS)]
    if KINDS[answers.kind or USUAL_KIND].is_bench:
        console.say(
            "a bench needs no calibrated cameras: one phone above it does (--above), or what a "
            "sensor recorded (--mocap FILE ..)"
        )
    if len(chosen.cameras) == 1:
        console.say(
            "one camera: depth along its view is known several times worse than across; a second "
            "phone from the side is worth more than any other change"
        )
    return {
        "target.toml": filmed.tag_target(chosen).encode("utf-8"),
        "session.toml": filmed.filmed_session(name, chosen, runs).encode("utf-8"),
        "print.pdf": pages_pdf(filmed.pages(chosen), paper),
    }


def _recorded(name: str, answers: Answers, paper: str, console: Console) -> dict[str, bytes]:
    """target.toml, session.toml, and recordings to copy, by their names."""
    from freeswing.cdpr.files.documents import InputError
    from freeswing.starter import files
    from freeswing.starter.markers import look_over

    stems = [file.stem for file in answers.recordings]
    if len(set(stems)) < len(stems):
        raise InputError("--mocap: two recordings have the same name; rename one")
    found = look_over(answers.recordings)
    what = ", ".join(found.names) or "poses"
    console.say(f"{len(found.files)} recordings of {what} at {found.rate_hz:g} Hz")
    if found.names:
        console.say(f"the markers keep their distances to {1e3 * found.spread_m:.2f} mm")
    span = "; ".join(
        f"{axis} {low:.2f} to {high:.2f} m"
        for axis, low, high in zip("xyz", found.low_m, found.high_m, strict=True)
    )
    console.say(f"the reference point is seen at {span}")
    if len(found.runs) > len(found.files):
        console.say(f"{len(found.runs)} free swings in them: each is a run of its own")
    bench = _cables(answers) if KINDS[answers.kind or USUAL_KIND].is_bench else None
    texts = {"session.toml": files.recorded_session(name, found, bench).encode("utf-8")}
    if found.names:
        texts["target.toml"] = files.marker_target(found).encode("utf-8")
    return texts | {f"runs/{file.name}": file.read_bytes() for file in found.files}


def _signals(name: str, answers: Answers, paper: str, console: Console) -> dict[str, bytes]:
    """session.toml and recordings to copy, by their names, of a bench's signals."""
    from freeswing.cdpr.files.documents import InputError
    from freeswing.starter.bench_signals import look_over_signals, signals_session

    if len({file.stem for file in answers.recordings}) < len(answers.recordings):
        raise InputError("--mocap: two recordings have the same name; rename one")
    found = look_over_signals(answers.recordings)
    console.say(f"{len(found.files)} recordings of {found.words} at {found.rate_hz:g} Hz")
    for sentence in found.taken_for:
        console.say(sentence)
    texts = {"session.toml": signals_session(name, found, _cables(answers)).encode("utf-8")}
    return texts | {f"runs/{file.name}": file.read_bytes() for file in found.files}


def _next(folder: Path, written: dict[str, bytes]) -> list[str]:
    """What is left to do, and the next command."""
    steps = []
    if "print.pdf" in written:
        above = b"planar = true" in written["session.toml"]
        steps.append(
            f"print {folder / 'print.pdf'} at 100 % and measure its ruler; glue the platform's "
            f"sheet flat{'' if above else ', hang the base tags upright'}"
        )
    marked = [file for file in FILES if b"nan" in written.get(file, b"")]
    steps.append(f"replace every nan in {' and '.join(marked)} by what you measure")
    if "print.pdf" in written:
        steps.append("put the films where session.toml says")
    numbered = [f"{k}. {step}" for k, step in enumerate(steps, start=1)]
    return [*numbered, f"{len(steps) + 1}. freeswing check {folder}"]
