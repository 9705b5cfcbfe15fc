"""Which results are out of date, and which belong together.

A result remembers the content of everything that it was made of. Where that is no longer what is
there, it is out of date; where two results remember different contents of one file, they tell of
different data and are not shown, or used, side by side.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from freeswing.results.files import read_provenance
from freeswing.session.provenance import hashes
from freeswing.session.session_file import Session
from freeswing.session.stages import DIAGNOSE, IDENTIFY, STAGES, Stage

_BESIDE = {"motion.json": IDENTIFY, "diagnosis_motion.json": DIAGNOSE}
_NAMED = 3  # changed files that a sentence names


@dataclass(frozen=True, slots=True)
class Stale:
    """A result that is out of date.

    Attributes:
        file: its name.
        stage: the command that makes it again.
        changed: inputs that are others now, gone or new.
        mixed: whether another result remembers other contents of the same files.
    """

    file: str
    stage: str
    changed: tuple[str, ...]
    mixed: bool

    def sentence(self) -> str:
        """For people, with what to do."""
        named = ", ".join(self.changed[:_NAMED])
        more = f" and {len(self.changed) - _NAMED} more" if len(self.changed) > _NAMED else ""
        return (
            f"{self.file} is out of date: {named}{more} changed since; "
            f"run freeswing {self.stage} (or freeswing run)"
        )


def stale_results(session: Session) -> tuple[Stale, ...]:
    """The results of a session that are out of date, with what changed.

    Results that do not say what they were made of (other programs', older versions') are left out.
    """
    told = {file: _told(session, file) for file, _ in _results()}
    found = []
    for file, stage in _results():
        made = told[file]
        changed = _changed(made, session, stage) if made else ()
        if changed:
            others = [one for name, one in told.items() if name != file]
            mixed = any(_contradict(made, other) for other in others)
            found.append(Stale(file, stage.name, changed, mixed))
    return tuple(found)


def _told(session: Session, file: str) -> dict[str, Any]:
    """The inputs that a result remembers; empty where it remembers none."""
    return dict(read_provenance(session.results / file).inputs or {})


def _results() -> list[tuple[str, Stage]]:
    return [*((stage.result, stage) for stage in STAGES), *_BESIDE.items()]


def _changed(made: Mapping[str, Any], session: Session, stage: Stage) -> tuple[str, ...]:
    """Names of inputs whose content is another one now, the results' own last."""
    now = hashes(session, stage.inputs(session))
    names = [name for name in {**made, **now} if made.get(name) != now.get(name)]
    return tuple(sorted(names, key=lambda name: (name.startswith("results/"), name)))


def _contradict(first: Mapping[str, Any], second: Mapping[str, Any]) -> bool:
    return any(second[name] != content for name, content in first.items() if name in second)
