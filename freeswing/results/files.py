"""Result files on disk: read as what they are, or refused with what to do."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TypeVar

from freeswing.cdpr.files.documents import InputError
from freeswing.results.codec import Document, Provenance

D = TypeVar("D", bound=Document)


def read_document(path: Path, kind: type[D]) -> D | None:
    """A result file, or None where there is none.

    Raises:
        InputError: where it is not JSON, of another kind, or a value is not what its key says.
    """
    try:
        return kind.from_json(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        return None
    except (OSError, ValueError, RecursionError) as failure:
        raise InputError(
            f"{path}: not a result of this version ({str(failure)[:200]}); delete it and run again"
        ) from None


def read_provenance(path: Path) -> Provenance:
    """What a result file says it was made of; nothing where it is absent or says nothing."""
    try:
        return Provenance.from_json(json.loads(path.read_text(encoding="utf-8"))["provenance"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return Provenance.from_json({})
