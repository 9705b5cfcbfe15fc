"""Whether what runs differ by in Izz is chance, or goes with what each of them carries."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import fdtr

from freeswing.cdpr.robot import Array
from freeswing.ident.bench.fit_rounds import Solved
from freeswing.ident.bench.swing import BenchSwing
from freeswing.ident.diagnose.decision import ACCEPTED


def is_systematic(solved: Solved) -> bool:
    """Whether scatter between runs goes with what they carry, more surely than chance has it.

    Rehanging and twisting scatter runs of one kind as much as kinds. What the model lacks (a hold
    of yaw, a radius, a mass) is the same in all runs of a kind; so is what held numbers are off by,
    which may be as much as is believed of them and is counted in every deviation.
    """
    if not solved.scatter_std > 0.0 or "scatter" not in solved.solution.unknowns:
        return False
    values, believed = solved.solution.value("scatter"), solved.held_scatter
    return by_kind(values, kinds(solved.swings), believed) > ACCEPTED


def kinds(swings: Sequence[BenchSwing]) -> list[int]:
    """Runs that carry the same, by number, (r,)."""
    names: dict[tuple[object, ...], int] = {}
    carried = [
        (
            *np.round(swing.known, 9).tolist(),
            *((one.block, *np.round(one.turn, 9).ravel().tolist()) for one in swing.riding),
        )
        for swing in swings
    ]
    return [names.setdefault(one, len(names)) for one in carried]


def by_kind(values: Array, kinds: Sequence[int], believed: Array | None = None) -> float:
    """Probability that chance spreads the kinds' means less than they are; 0: it cannot be told.

    Args:
        values: of the runs, (r,).
        kinds: which of them are alike, (r,).
        believed: covariance of what numbers held as believed add to the values, (r, r), or None.

    Source:
        Fisher 1925, Statistical Methods for Research Workers, ch. 7: analysis of variance; with
        `believed`, Hotelling's T-squared of the kinds' means beside their common one (Anderson
        2003, An Introduction to Multivariate Statistical Analysis, sec. 5.3).
    """
    groups, which = np.unique(np.asarray(kinds), return_inverse=True)
    between, within = len(groups) - 1, len(values) - len(groups)
    if between < 1 or within < 1:
        return 0.0
    member = np.eye(len(groups))[which]  # (r, k)
    means = member / member.sum(axis=0)
    left = float(np.sum((values - member @ (means.T @ values)) ** 2)) / within
    apart = (means[:, 1:] - means[:, :1]).T
    covariance = left * apart @ apart.T
    if believed is not None:
        covariance = covariance + apart @ believed @ apart.T
    differences = apart @ values
    if not np.linalg.det(covariance) > 0.0:
        return float(np.any(differences != 0.0))
    squared = float(differences @ np.linalg.solve(covariance, differences))
    return float(fdtr(between, within, squared / between))


def scatter_sentence(solved: Solved) -> str:
    """What runs scatter by, and whether it is chance; empty where they do not."""
    if not solved.scatter_std > 0.0:
        return ""
    size = f"{solved.scatter_std:.2g} kg m2 in Izz beyond their noise"
    if not is_systematic(solved):
        return f"runs scatter by {size} (rehanging, twisting, placing): every deviation counts it"
    return (
        f"runs differ by {size}, and this goes with what they carry, which no chance does: the "
        "model lacks something (a clamp or wires that hold yaw, a radius, a mass or its place). "
        "Deviations count all that Izz changes by when it is taken for one thing instead, the mass "
        "left to the runs: DO NOT RELY on more. Record three runs or more with the known mass at "
        "different places, then freeswing diagnose"
    )
