"""Notes of the same kind told once: forty sentences on markers are read by nobody."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable

RUN = re.compile(r"^run (\S+): (.*)$", re.DOTALL)
# What differs from note to note of a kind: a marker or camera's name, a coordinate, numbers.
NAME = re.compile(r"\b(marker|camera|tag|cable) \S+")
COORDINATE = re.compile(r"\b(x|y|z|phi|theta|chi)\b")
NUMBER = re.compile(r"-?\d[\d.]*(?:e[-+]?\d+)?")
SIZE = re.compile(NUMBER.pattern + r"(?= (?:um|mm|mrad|px|%))")


def grouped(notes: Iterable[str]) -> list[str]:
    """The notes in their order, those of one kind on several runs as one sentence.

    The one with the largest first size stands for its kind; the other runs follow it.
    """
    kinds: dict[str, list[tuple[str, str]]] = {}
    for note in dict.fromkeys(notes):
        found = RUN.match(note)
        run, text = found.groups() if found else ("", note)
        kinds.setdefault(_kind(text) if run else text, []).append((run, text))
    return [_told(alike) for alike in kinds.values()]


def _kind(text: str) -> str:
    for pattern in (NAME, NUMBER, COORDINATE):
        text = pattern.sub("#", text)
    return text


def _told(alike: list[tuple[str, str]]) -> str:
    run, text = max(alike, key=lambda one: _size(one[1]))
    if not run:
        return text
    others = Counter(name for name, _ in alike)
    others.subtract([run])
    again = others.pop(run)
    listed = [*([f"{run} again"] if again else [])]
    listed += [name if count == 1 else f"{name} ({count})" for name, count in others.items()]
    beside = f" (the largest; alike: {', '.join(listed)})" if listed else ""
    return f"run {run}: {text}{beside}"


def _size(text: str) -> float:
    found = SIZE.search(text)
    return float(found.group()) if found else 0.0
