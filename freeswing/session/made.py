"""What a step gives to be written: documents, other files, and why they must not be used."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from freeswing.cdpr.files.documents import replace_file, write_json
from freeswing.results.codec import Document

# A file's bytes, at once or in pieces as long as they are asked for.
Content = bytes | Callable[[], Iterable[bytes]]


@dataclass(frozen=True, slots=True)
class Made:
    """All that a step or a command leaves on disk.

    Attributes:
        documents: by their file's name below the results folder, the main one first.
        files: others, by their path.
        refused: why what was made must not be used; it is written all the same, to explain.
    """

    documents: tuple[tuple[str, Document], ...]
    files: tuple[tuple[Path, Content], ...] = ()
    refused: str | None = None


def write_made(
    folder: Path, made: Made, finished: Callable[[Document], Document] = lambda main: main
) -> Path:
    """Write everything, each file once, the main document last; its path.

    Args:
        folder: of the results.
        made: what to write.
        finished: gives the main document its last touch when all others are on disk.

    Raises:
        InputError: where a file cannot be written.
    """
    for path, content in made.files:
        replace_file(path, content if isinstance(content, bytes) else content())
    (main, document), *beside = made.documents
    for name, other in reversed(beside):
        write_json(folder / name, other.to_json())
    write_json(folder / main, finished(document).to_json())
    return folder / main
