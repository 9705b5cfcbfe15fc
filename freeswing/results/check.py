"""results/check.json: what `freeswing check` found."""

from __future__ import annotations

from typing import ClassVar

from freeswing.results.codec import Document, Entry, entry


@entry
class Found(Entry):
    """One finding: error, warning or note; of what; and what to do."""

    level: str = ""
    subject: str = ""
    text: str = ""
    remedy: str = ""


@entry
class Check(Document):
    """All findings of a session."""

    kind: ClassVar[str] = "check"

    findings: tuple[Found, ...] = ()
