"""Panel: provenance. Versions, hashes of every input, settings."""

from __future__ import annotations

from typing import Any

from freeswing.report.material import Material
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
            if document.provenance
        ]
        return {"results": results} if results else None


def _result(kind: str, provenance: Table) -> dict[str, Any]:
    seconds = provenance.get("seconds")
    return {
        "kind": kind,
        "made": str(provenance.get("made", "")),
        "seconds": f"{seconds:.1f} s" if isinstance(seconds, int | float) else "",
        "versions": _pairs(provenance.get("versions")),
        "settings": _pairs(provenance.get("settings")),
        "inputs": _pairs(provenance.get("inputs")),
        "outputs": _pairs(provenance.get("outputs")),
    }


def _pairs(mapping: Table | None) -> list[tuple[str, str]]:
    return [(str(key), str(value)) for key, value in (mapping or {}).items()]
