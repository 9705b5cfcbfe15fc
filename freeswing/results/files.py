"""Result files on disk: read as what they are, or refused with what to do."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from freeswing.cdpr.files.documents import InputError
from freeswing.results.codec import Document

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


def read_provenance(path: Path) -> Mapping[str, Any]:
    """What a result file says it was made of; empty where it is absent or says nothing."""
    try:
        made = json.loads(path.read_text(encoding="utf-8"))["provenance"]
        return made if isinstance(made, dict) else {}
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return {}
