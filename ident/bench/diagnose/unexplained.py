"""What no cause explains: power near the swing that white noise of neighbouring samples lacks."""

from __future__ import annotations

from typing import Any

from freeswing.ident.bench.diagnose.weigh import Fit
from freeswing.ident.bench.noise import left_worst


def remaining(one: Fit) -> dict[str, Any]:
    """The entry `unexplained`: the coordinate that is left worst, its size and frequency."""
    left = left_worst(one.swings, one.solution)
    if left is None:
        return {"present": False, "signature": "", "evidence": {}}
    return {
        "present": True,
        "signature": f"{left.sentence}: none of the effects that were tried explains it",
        "evidence": {
            "coordinate": left.name,
            "rms": left.rms,
            "frequency_hz": left.strongest_hz,
            "colour": left.colour,
        },
    }
