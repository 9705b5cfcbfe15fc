"""Panel: provenance. Versions, hashes of every input, settings."""

from __future__ import annotations

from typing import Any

from freeswing.report.material import Material
from freeswing.results import codec
from freeswing.results.codec import Table


class Provenance:
    """Enough to make the same numbers again."""

    name = "provenance"
    title = "Provenance"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Settings, versions and input hashes of each result file."""
        results = [
            _result(kind, document.provenance)
            for kind, document in material.documents.items()
            if document.provenance.is_kept
        ]
        return {"results": results} if results else None


def _result(kind: str, told: codec.Provenance) -> dict[str, Any]:
    return {
        "kind": kind,
        "made": told.made or "",
        "seconds": "" if told.seconds is None else f"{told.seconds:.1f} s",
        "versions": _pairs(told.versions),
        "settings": _pairs(told.settings),
        "inputs": _pairs(told.inputs),
        "outputs": _pairs(told.outputs),
    }


def _pairs(mapping: Table | None) -> list[tuple[str, str]]:
    return [(str(key), str(value)) for key, value in (mapping or {}).items()]
