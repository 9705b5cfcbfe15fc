"""What the report is made of: the result files of a session, as they stand."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from freeswing.cdpr.files.documents import InputError

RESULTS = ("calibration", "tracking", "identification", "diagnosis", "motion")
FILES = {kind: (f"{kind}.json",) for kind in RESULTS} | {
    "motion": ("diagnosis_motion.json", "motion.json")
}
ESTIMATE_ORDER = ("ml_full", "ml_free", "fidim_full", "fidim_free")
Document = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Material:
    """The result documents of one session; an empty mapping where a file is absent.

    Attributes:
        title: the session's name.
        calibration: `results/calibration.json`.
        tracking: `results/tracking.json`.
        identification: `results/identification.json`.
        diagnosis: `results/diagnosis.json`.
        motion: measured and predicted samples of the validation runs, by diagnosis
            (`results/diagnosis_motion.json`) or else by identification (`results/motion.json`).
        notes: findings to show beside the results, such as those of `freeswing check`.
    """

    title: str
    calibration: Document = field(default_factory=dict)
    tracking: Document = field(default_factory=dict)
    identification: Document = field(default_factory=dict)
    diagnosis: Document = field(default_factory=dict)
    motion: Document = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def estimates(self) -> dict[str, Document]:
        """The estimates that are there, best first."""
        given = self.identification.get("estimates") or {}
        return {name: given[name] for name in ESTIMATE_ORDER if given.get(name)}

    @property
    def documents(self) -> dict[str, Document]:
        """The result documents that are there, by kind."""
        return {name: document for name in RESULTS if (document := getattr(self, name))}


def read_material(title: str, results: Path, notes: tuple[str, ...] = ()) -> Material:
    """The results found in the folder `results`.

    Raises:
        InputError: where a result file is not one that this version wrote.
    """
    found = {
        kind: next((one for name in names if (one := read_result(results / name, kind))), {})
        for kind, names in FILES.items()
    }
    return Material(title, **found, notes=notes)


def read_result(path: Path, kind: str) -> Document:
    """A result file, or an empty mapping where there is none.

    Raises:
        InputError: where it is not JSON or its `format` is not `freeswing-<kind>/1`.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, RecursionError) as failure:
        raise InputError(f"{path}: cannot be read ({failure}); delete it and run again") from None
    expected = f"freeswing-{kind}/1"
    if not isinstance(document, dict) or document.get("format") != expected:
        raise InputError(f"{path}: its format is not {expected}; delete it and run again")
    return document
