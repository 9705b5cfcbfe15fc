"""Panel: the cameras. Coverage, reprojection, millimetres on the platform, the rig in space."""

from __future__ import annotations

from typing import Any

from freeswing.report.material import Document, Material
from freeswing.report.words import number, plain


class Cameras:
    """How well the cameras are known and how much of the swing they saw."""

    name = "cameras"
    title = "The cameras"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Calibration by camera and tracking by run."""
        calibration, tracking = material.calibration, material.tracking
        if not calibration and not tracking:
            return None
        return {
            "cameras": [_plain_entries(entry) for entry in calibration.get("cameras") or []],
            "runs": [_plain_entries(entry) for entry in tracking.get("runs") or []],
        }


def _plain_entries(entry: Document) -> dict[str, str]:
    return {
        key: _shown(value) for key, value in entry.items() if not isinstance(value, list | dict)
    }


def _shown(value: object) -> str:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return number(value)
    return plain(str(value)) if value is not None else "–"
