"""An estimate whose deviations hold one more cause."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.ident.estimate import Estimate
from freeswing.ident.fidim.essential_parameters import undetermined


def wider(entry: Estimate, share: Array, key: str, said: Callable[[float], str]) -> Estimate:
    """The estimate with a cause's covariance added.

    Args:
        entry: without it.
        share: what the cause does to the inertia, (9, 9), units of the numbers squared.
        key: under which the result tells its deviations, (9,).
        said: the note, told by how many times deviations grow for it at most.

    Source:
        JCGM 100:2008, eq. (13): independent causes add by variance.
    """
    before = entry.consistency.sentence()
    covariance = entry.covariance + share
    growth = float(np.sqrt(np.diag(covariance) / np.diag(entry.covariance)).max())
    told = replace(
        entry,
        covariance=covariance,
        essential=~undetermined(entry.values, np.sqrt(np.diag(covariance))),
        notes=(*(note for note in entry.notes if note != before), said(growth)),
        extra={**entry.extra, key: np.sqrt(np.diag(share)).tolist()},
    )
    after = told.consistency.sentence()
    return replace(told, notes=(*told.notes, after)) if after else told
