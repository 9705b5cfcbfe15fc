"""Where distances do not tell which marker is off: how much of that is borne, and what is said."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.markers.layouts_aligned import Alignment
from freeswing.cdpr.measured.target import Target

Array = NDArray[np.float64]


# Another marker that may be the one that is off, and would move the platform by more than this: no
# result is better than one that claims tenths of a millimetre. Less is said as a warning (of one
# recording of Bologna alone, 3.4 mm of one marker explains what 1.7 and 1.0 mm of two do).
MOST_OPEN_M = 5e-3


def refuse_undecided(target: Target, onto: Alignment) -> None:
    """Passes a layout whose wrong marker is known, or does not matter.

    Raises:
        DataError: where which marker is off cannot be told, and the answer matters.
    """
    if onto.rival_m > MOST_OPEN_M:
        raise DataError(
            f"{open_question(target, onto)}; which, the distances between them do not tell: "
            "measure position_m of these markers again, or add a marker"
        )


def open_question(target: Target, onto: Alignment) -> str:
    """The ways in which the markers may be off, none of which their distances exclude."""
    ways = (", ".join(_off(target, change)) for change in (onto.change_m, onto.rival_change_m))
    return f"the markers do not lie as target.toml says: {' or '.join(ways)} off"


def _off(target: Target, change: Array) -> Iterator[str]:
    sizes = np.linalg.norm(np.nan_to_num(change), axis=1)
    for k in np.argsort(-sizes)[:2]:
        if sizes[k] > 0.25 * sizes.max():
            yield f"{target.marker_names[k]} by {1e3 * sizes[k]:.1f} mm"
