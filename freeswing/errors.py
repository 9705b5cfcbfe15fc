"""Exit statuses, and the short names by which docs/errors.md explains failures.

A failure is named after the room that raised it, so that each has a name without being given one:
the innermost of the program's own modules on the way to it decides.
"""

from __future__ import annotations

from types import TracebackType

from freeswing.cdpr.files.problems import DataError, InputError

DONE, NO_RESULT, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130

# Rooms below `freeswing.`; the longest that fits gives the name.
NAMES = {
    "calib": "calibration",
    "calib.board": "board-footage",
    "calib.camera": "lens",
    "calib.exchange": "other-cameras",
    "calib.footage": "footage",
    "calib.scene": "scene",
    "calib.tags": "tags",
    "cdpr": "model",
    "cdpr.driven": "driven-robot",
    "cdpr.effects": "effect",
    "cdpr.files": "recording",
    "cdpr.files.documents": "file",
    "cdpr.files.problems": "keys",
    "cdpr.files.robot_file": "keys",
    "cdpr.markers": "markers",
    "cdpr.measured": "samples",
    "cdpr.mesh": "mesh",
    "commands": "usage",
    "commands.session.check": "findings",
    "commands.session.run": "usage",
    "demo": "demo",
    "export": "export",
    "front": "usage",
    "doctor": "findings",
    "excite": "plan",
    "homing": "homing",
    "ident": "fit",
    "ident.bench": "bench",
    "ident.diagnose": "diagnosis",
    "ident.drive": "driven-fit",
    "ident.signals": "no-free-swing",
    "printing": "print",
    "report": "result-file",
    "results": "result-file",
    "servo": "control",
    "session": "session",
    "starter": "new",
    "vision": "tracking",
    "vision.look": "tags",
    "workers": "cluster",
}
DISK, MEMORY, UNFORESEEN = "disk", "memory", "unforeseen"


def exit_status(failure: BaseException) -> int:
    """2 for a file or a flag that is wrong, 1 for data that cannot give a result."""
    unusable_file = isinstance(failure, OSError) and failure.filename is not None
    return WRONG_INPUT if isinstance(failure, InputError) or unusable_file else NO_RESULT


def short_name(failure: BaseException) -> str:
    """The name of a failure, as docs/errors.md lists it."""
    if isinstance(failure, OSError):
        return DISK
    if isinstance(failure, MemoryError):
        return MEMORY
    if not _is_foreseen(failure):
        return UNFORESEEN
    cause = failure.__cause__
    if isinstance(cause, InputError | DataError):  # said again with more around it
        return short_name(cause)
    return name_of_module(_raised_in(failure.__traceback__))


def name_of_module(module: str) -> str:
    """The name of what a module raises."""
    words = module.removeprefix("freeswing.").split(".")
    for count in range(len(words), 0, -1):
        name = NAMES.get(".".join(words[:count]))
        if name is not None:
            return name
    return UNFORESEEN


def describe(failure: BaseException) -> str:
    """One plain sentence for a failure; what is not ours to explain says how to learn more."""
    if isinstance(failure, InputError | DataError):
        return str(failure)
    if isinstance(failure, OSError) and failure.strerror:
        where = f"{failure.filename}: " if failure.filename else ""
        return f"{where}{failure.strerror}"
    if isinstance(failure, MemoryError):
        return "the data do not fit into memory: shorten the windows or take fewer runs"
    if _is_foreseen(failure):
        return f"{failure}"
    kind = type(failure).__name__
    return f"{kind}: {failure} (not foreseen; --verbose shows where it happened)"


def _is_foreseen(failure: BaseException) -> bool:
    return isinstance(failure, ValueError) and type(failure).__module__ != "numpy.linalg"


def _raised_in(trace: TracebackType | None) -> str:
    """The innermost module of the program on the way to a failure."""
    found = ""
    while trace is not None:
        module = trace.tb_frame.f_globals.get("__name__", "")
        if module.startswith("freeswing."):
            found = module
        trace = trace.tb_next
    return found
