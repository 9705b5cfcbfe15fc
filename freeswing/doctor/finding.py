"""One line that the doctor says about a session, and how runs are named in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Level = Literal["error", "warning", "note"]


@dataclass(frozen=True, slots=True)
class Finding:
    """What was found, where, and what to do.

    Attributes:
        level: `error` keeps a command from a result, `warning` costs accuracy, `note` is to know.
        subject: the file, run or camera.
        text: what was measured, with its number.
        remedy: what to do, or "".
    """

    level: Level
    subject: str
    text: str
    remedy: str = ""

    def line(self) -> str:
        """The finding as one line."""
        return f"{self.level:7} {self.sentence()}"

    def sentence(self) -> str:
        """The finding without its level."""
        ending = f"; {self.remedy}" if self.remedy else ""
        return f"{self.subject}: {self.text}{ending}"

    def entry(self) -> dict[str, str]:
        """The finding for a result file."""
        return {
            "level": self.level,
            "subject": self.subject,
            "text": self.text,
            "remedy": self.remedy,
        }


def named_runs(names: Sequence[str]) -> str:
    """The first by name, and how many more there are."""
    more = f" (and {len(names) - 1} more run{'s' * (len(names) > 2)})" if len(names) > 1 else ""
    return f"run {names[0]}{more}"


def counted(findings: int) -> str:
    """How many findings there are, for a reader."""
    return f"{findings} finding{'' if findings == 1 else 's'}"
