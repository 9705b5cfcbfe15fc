"""Where a deviation of Izz comes from: what each thing that is uncertain adds to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.ident.bench.fit_rounds import Solved
from freeswing.ident.bench.modal import SQUARE
from freeswing.ident.bench.objects import moments, moments_slope
from freeswing.ident.bench.swing import COMMON, IZZ
from freeswing.ident.bench.told.classic_formula import radii

SAMPLES = "noise of the samples, drag and starts"
MASS = "the platform's mass"
WIRE_ENDS = "where the wires' ends are"
BESIDE_IZZ = [4, 5, 7, 8, 9]  # of a body's ten numbers: Ixx Iyy Ixy Ixz Iyz
ACROSS = "{name}: its moments and products beside Izz"


@dataclass(frozen=True, slots=True)
class Share:
    """One line of an error budget.

    Attributes:
        what: it comes from.
        std_kg_m2: what it adds, in quadrature, while all else stays as uncertain as it is.
    """

    what: str
    std_kg_m2: float

    def document(self) -> dict[str, Any]:
        """The entry of `budget`."""
        return {"what": self.what, "std_kg_m2": self.std_kg_m2}


def sources(solved: Solved) -> dict[str, Array]:
    """What may be uncertain, and its places in the covariance of the shared unknowns.

    Source:
        JCGM 100:2008 (GUM), sec. 5.2: sources of a budget may be correlated.
    """
    unknowns, found = solved.solution.unknowns, {}
    for block in unknowns.shared:
        places = unknowns.columns(block.name)
        head, _, name = block.name.partition(".")
        if head == "platform":
            found[MASS] = places[:1]
            found["the platform's centre of mass"] = places[1:4]
            found[ACROSS.format(name="the platform")] = places[BESIDE_IZZ]
        elif head == "load":
            found[f"{name}: its mass"] = places[:1]
            found[f"{name}: its centre of mass"] = places[1:4]
            found[ACROSS.format(name=name)] = places[BESIDE_IZZ]
        elif head == "wires":
            known = found.get("wire lengths", np.zeros(0, dtype=np.int64))
            found["wire lengths"] = np.concatenate([known, places])
        elif head == COMMON:
            found["sway against the stated wire lengths"] = places
        elif head == "channel":
            found[f"channel {name}: gains"] = places
        elif head == SQUARE:
            found["amplitude: how far it really swung"] = places
        elif head == "missing" and not block.mask.any():
            known = found.get(WIRE_ENDS, np.zeros(0, dtype=np.int64))
            found[WIRE_ENDS] = np.concatenate([known, places])
        elif head == "scatter":
            found["scatter between runs"] = places
    return found


def budget(solved: Solved, block: str) -> list[Share]:
    """The error budget of a body's Izz about P, largest first, without what adds nothing.

    A source adds what knowing it exactly, all else left as it is, would take away.

    Source:
        Rasmussen, Williams 2006, Gaussian Processes for Machine Learning, eq. A.6 (conditioning).
    """
    found, unknowns = solved.solution, solved.solution.unknowns
    slope = np.zeros(len(found.covariance))
    slope[unknowns.columns(block)] = moments_slope(found.value(block))[IZZ]
    answer = found.covariance @ slope
    total = float(slope @ answer)
    shares, every = [], []
    for what, places in sources(solved).items():
        gone = _explained(found.covariance, answer, places)
        every.append(places)
        if gone > 1e-6 * total:
            shares.append(Share(what, float(np.sqrt(gone))))
    left = total - _explained(found.covariance, answer, np.concatenate(every))
    shares.append(Share(SAMPLES, float(np.sqrt(max(left, 0.0)))))
    bent = bent_std(solved, block)
    if bent > 0.0:
        shares.append(Share("centres of mass beside the middle, squared", bent))
    return sorted(shares, key=lambda one: -one.std_kg_m2)


def _explained(covariance: Array, answer: Array, places: Array) -> float:
    spread = np.sqrt(np.diag(covariance)[places])
    places = places[spread > 0.0]
    if not len(places):
        return 0.0
    scale = np.sqrt(np.diag(covariance)[places])
    inner = covariance[np.ix_(places, places)] / np.outer(scale, scale)
    side = answer[places] / scale
    return float(side @ np.linalg.pinv(inner, rcond=1e-9, hermitian=True) @ side)


def bent_std(solved: Solved, block: str) -> float:
    """What a centre of mass held in the middle hides of Izz about P to second order, kg m2.

    Yaw tells I - M c^2 (1 - s / (R r)), c being the common centre's distance from the middle and s
    inertia over mass (sec. "Loads" of docs/decisions/benches.md): no slope at c = 0, only c^2.
    """
    if block not in solved.held or not solved.held[block][1:3].any():
        return 0.0
    platform = solved.solution.value("platform")
    own = solved.solution.value(block)
    # A load shows by what it changes: of the platform's m c^2 the part that it displaces.
    mass = own[0] if block == "platform" else own[0] * platform[0] / (own[0] + platform[0])
    spread = np.sqrt(np.diag(solved.solution.covariance_of("platform"))[1:3])
    if block != "platform":
        spread = np.hypot(spread, np.sqrt(np.diag(solved.solution.covariance_of(block))[1:3]))
    top, bottom, _ = radii(solved.swings[0])
    total = moments(platform)
    share = abs(1.0 - total[IZZ] / total[0] / (top * bottom))
    square = 3.0 * float(np.sum(spread**4)) + 2.0 * float(np.prod(spread**2))
    return float(mass * share * np.sqrt(square))
