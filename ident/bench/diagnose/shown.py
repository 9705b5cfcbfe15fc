"""Which causes the runs of a bench would show at all: what they do not is no finding either way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.ident.bench.diagnose.causes import Cause
from freeswing.ident.bench.diagnose.search import Ground, joint_rows
from freeswing.ident.bench.diagnose.weigh import Fit
from freeswing.ident.bench.objects import moments, moments_slope
from freeswing.ident.bench.swing import IZZ
from freeswing.ident.likelihood.unknowns import Mask, Unknowns


@dataclass(frozen=True, slots=True)
class Shown:
    """How well runs would tell a cause beside all else that they have to tell.

    Attributes:
        cause: which.
        std: of its numbers, (k,).
        usual: their typical sizes, (k,).
        moves: of the platform's Izz about P, by its value, what a fit without them answers with to
            their usual sizes, (k,).
    """

    cause: Cause
    std: Array
    usual: Array
    moves: Array

    @property
    def told(self) -> Mask:
        """Which numbers the runs tell to their usual size, (k,)."""
        return self.std < self.usual

    @property
    def worst(self) -> int:
        """Which number is told worst."""
        return int(np.argmax(self.std / self.usual))

    @property
    def words(self) -> str:
        """The number that is told worst, how well, and what it would do unseen."""
        worst = self.worst
        name = self.cause.parameters[worst].name
        part = f" of {self.cause.part}" if self.cause.part else ""
        known = f"{name}{part} is told to +- {self.std[worst]:.2g}"
        if self.told.all():
            return known
        return (
            f"{known}; a usual one of {self.usual[worst]:.2g} moves the platform's Izz by "
            f"{100.0 * abs(self.moves[worst]):.2g} %"
        )


def shown(ground: Ground, last: Fit, causes: Sequence[Cause]) -> tuple[Shown, ...]:
    """How well each cause would be told, were it alone added to a fit.

    Args:
        ground: of all fits.
        last: the fit that it would be added to, with the noise that this one has.
        causes: that the fit does not have.

    Source:
        Bjoerck 1996, Numerical Methods for Least Squares Problems, sec. 2.8: covariance by R;
        Schmidt 1966: how estimates answer to what is not among them.
    """
    if not causes:
        return ()
    rows, mine, added, unknowns = joint_rows(ground, last, causes)
    platform = unknowns.block("platform")
    slope = np.zeros(rows.shape[1] - 1)
    places = _columns(unknowns, "platform")
    slope[places] = (moments_slope(platform.value)[IZZ] * platform.scale)[platform.mask]
    izz, found = float(moments(platform.value)[IZZ]), []
    for cause in causes:
        own, block = added[cause.block], unknowns.block(cause.block)
        kept = np.r_[mine, own]
        inverse = np.linalg.pinv(np.asarray(np.linalg.qr(rows[:, kept], mode="r")))
        variances = np.sum(inverse[-len(own) :] ** 2, axis=1)
        answer = inverse[-len(own) :] @ (inverse.T @ slope[kept]) / variances
        std = np.sqrt(variances) * block.scale
        found.append(Shown(cause, std, block.scale, answer / izz))
    return tuple(found)


def _columns(unknowns: Unknowns, name: str) -> Array:
    """Places of a block's estimated numbers among all that are estimated and shared."""
    estimated = np.concatenate([block.mask for block in unknowns.shared])
    places = (np.cumsum(estimated) - 1)[unknowns.place(name)]
    return places[unknowns.block(name).mask]
