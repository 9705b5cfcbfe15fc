"""What runs contradict of a bench's files: what is off, what it may be, and what it cannot be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.ident.bench.fit_rounds import Solved
from freeswing.ident.bench.mass_verdict import CONTRADICTED
from freeswing.ident.bench.priors.wire_priors import UNSTATED_LENGTH_STD_M
from freeswing.ident.bench.runs import BenchRun
from freeswing.ident.bench.swing import COMMON, IZZ
from freeswing.ident.bench.told.budget import MASS, budget
from freeswing.ident.bench.told.classic_formula import radii

WORTH_WEIGHING = 0.002  # of Izz: the best fixtures of industry reach as much
WEIGH = (
    "Weigh the platform with all that hangs on it: if the declared mass was wrong, all is settled; "
    "if it was right, measure R"
)
OPPOSITE = (
    "Hang the known mass on opposite sides of the middle in turn: then no centre of mass can be it"
)
SHORTER = "under a weight they become longer, and the runs want the contrary"


@dataclass(frozen=True, slots=True)
class Reason:
    """One thing that by itself would explain what runs contradict.

    Attributes:
        name: as results have it.
        says: what would be off, and by how much.
        excluded: why it is not that; empty: it may be.
    """

    name: str
    says: str
    excluded: str = ""


def payload_reasons(solved: Solved) -> tuple[Reason, ...]:
    """What the runs with a known mass cannot tell from another platform mass, and what is not it.

    They see (m g R_top R_bottom / L + torsion) T^2 / 4 pi^2 rise by the known mass times its
    squared distance; sway hangs on g / L and the clock alone, so that both drop out of yaw over
    sway. Empty where runs agree with the robot file.

    Source:
        du Bois, Lieven, Adhikari 2009, Error analysis in trifilar inertia measurements, eq. 1.
    """
    mass = solved.mass
    if mass is None or not mass.contradicted:
        return ()
    share = mass.fitted_kg / mass.declared_kg - 1.0
    percent, half = 100.0 * share, 50.0 * share
    top, bottom, length = radii(solved.swings[0])
    gravity = float(np.linalg.norm(solved.swings[0].model.robot.gravity_m_s2))
    spring = 1e3 * (mass.fitted_kg - mass.declared_kg) * gravity * top * bottom / length
    hold = float(f"{spring:.2g}")  # 270, not 2.7e+02
    sway = _sway_excludes(solved, share)
    found = [
        Reason("platform_mass", f"the platform's mass ({percent:+.1f} %)"),
        Reason(
            "wire_radii",
            f"R_top R_bottom ({percent:+.1f} %: both radii {500.0 * share * top:+.1f} mm)",
        ),
        Reason("wire_length", f"L ({-percent:+.1f} %)", sway),
        Reason("frame_rate", f"the frame rate ({half:+.1f} %)", sway),
        Reason(
            "payload_distance",
            f"the payloads' distances from the middle ({-half:+.1f} %{_distances(solved, half)})",
        ),
        Reason("payload_mass", f"the payloads' masses ({-percent:+.1f} %)"),
        Reason("torsion_spring", f"wires or a clamp that hold yaw by {hold:+g} mN m/rad"),
    ]
    if mass.is_small:
        way = 1e3 * share * length
        says = f"wires that stretch, or hooks that yield, by {way:.2g} mm under the platform"
        found.append(Reason("yielding_clamp", says, "" if share > 0.0 else SHORTER))
    centre = _centre(solved)
    if centre:
        found.append(Reason("centre_of_mass", centre))
    return tuple(found)


def surely_contradicted(solved: Solved) -> bool:
    """Whether payload runs exclude the declared mass with all counted that may be off."""
    mass = solved.mass
    if mass is None or not mass.contradicted:
        return False
    std = float(solved.solution.std("platform")[0])
    return abs(mass.fitted_kg - mass.declared_kg) > CONTRADICTED * std


def contradictions(solved: Solved) -> list[str]:
    """What runs contradict of the stated mass and wire lengths, a sentence each."""
    told = (
        group_sentence(solved),
        strained_sentence(solved) or open_sentence(solved),
        wires_sentence(solved),
    )
    return [one for one in told if one]


def group_sentence(solved: Solved) -> str:
    """What runs with a known mass cannot tell apart, where they contradict the robot file."""
    mass, reasons = solved.mass, payload_reasons(solved)
    if mass is None or not reasons:
        return ""
    percent = 100.0 * (mass.fitted_kg / mass.declared_kg - 1.0)
    says, doubt = "contradict", ""
    if not surely_contradicted(solved):
        std = float(solved.solution.std("platform")[0])
        says = "speak against"
        doubt = f", +- {std:.2g} kg with all that may be off, which does not exclude what is stated"
    may_be = "; ".join(one.says for one in reasons if not one.excluded)
    again = "" if _excluded(reasons) else " and L again, then film a clock"
    advice = [WEIGH + (again or " and the payloads' places again")]
    if any(one.name == "centre_of_mass" for one in reasons):
        advice.append(OPPOSITE)
    return (
        f"the payload runs {says} mass_kg = {mass.declared_kg:.4g} kg: they give "
        f"{mass.fitted_kg:.4g} +- {mass.fitted_std_kg:.2g} kg ({percent:+.1f} %{doubt}), which is "
        f"used. What is off is one of these, and they cannot tell which: {may_be}. "
        f"{_excluded(reasons)}{'. '.join(advice)}. The platform's inertia in kg m2 is the same for "
        "the first two, and goes with the payloads' masses and squared distances"
    )


def strained_sentence(solved: Solved) -> str:
    """By how much Izz would differ by the mass that payload runs speak for, where they do."""
    mass = solved.mass
    if mass is None or not mass.strained:
        return ""
    off = abs(mass.fitted_kg - mass.declared_kg) / mass.fitted_std_kg
    part = abs(mass.shift_kg) / float(np.hypot(mass.shift_kg, mass.open_kg))
    found = []
    for block, change in solved.doubts.items():
        body, _, load = block.partition(".")
        if body in ("platform", "load"):
            share = -100.0 * part * change[IZZ] / float(solved.solution.value(block)[IZZ])
            found.append(f"that of {load or 'the platform'} by {share:+.2g} %")
    return (
        f"the payload runs speak against mass_kg = {mass.declared_kg:.4g} kg without excluding it: "
        f"they give {mass.fitted_kg:.4g} +- {mass.fitted_std_kg:.2g} kg, {off:.1f} deviations off. "
        f"The declared mass is used; by theirs Izz would change, {', '.join(found)}, all of which "
        "its deviation counts. Weigh the platform with all that hangs on it, or record more runs "
        "with the known mass"
    )


def open_sentence(solved: Solved) -> str:
    """What a declared mass that nobody says to be well known adds to Izz, where it adds most."""
    mass = solved.mass
    if mass is None or not mass.open_kg:
        return ""
    found = []
    for block in solved.doubts:
        body, _, load = block.partition(".")
        if body in ("platform", "load"):
            largest = budget(solved, block)[0]
            share = largest.std_kg_m2 / abs(float(solved.solution.value(block)[IZZ]))
            if largest.what == MASS and share > WORTH_WEIGHING:
                found.append(f"{100.0 * share:.2g} % of that of {load or 'the platform'}")
    if not found:
        return ""
    return (
        f"mass_kg = {mass.declared_kg:.4g} kg is used, and nothing says how well it is known: the "
        f"payload runs give {mass.fitted_kg:.4g} +- {mass.fitted_std_kg:.2g} kg, and what that "
        f"leaves open is most of Izz's deviation ({', '.join(found)}). Weigh the platform with all "
        "that hangs on it, and say how well: mass_std_kg"
    )


def _excluded(reasons: tuple[Reason, ...]) -> str:
    """A sentence on what it cannot be, or nothing."""
    cannot = [one for one in reasons if one.excluded]
    if not cannot:
        return ""
    return f"It is not {' or '.join(one.says for one in cannot)}: {cannot[0].excluded}. "


def exchange_sentence(runs: Sequence[BenchRun]) -> str:
    """Which runs would not show that wires of different stated lengths are in each other's place.

    Poses show each wire's length, and wires that differ by more than is stated tilt the platform:
    neither yaw nor x and y see that.
    """
    blind = [
        run
        for run in runs
        if run.lengths_m is not None
        and run.coordinates != POSE_COORDINATES
        and not {"phi", "theta"} <= set(run.coordinates)
        and np.ptp(run.lengths_m) > (run.lengths_std_m or UNSTATED_LENGTH_STD_M)
    ]
    if not blind or len(blind) < len(runs):
        return ""
    most = max(float(np.ptp(run.lengths_m)) for run in blind if run.lengths_m is not None)
    return (
        f"cable_lengths_m differ by up to {1e3 * most:.2g} mm, and no run shows which wire has "
        "which length: that two stand in each other's place would not be noticed. Record one run "
        "with full poses, or see with a level to which side the platform leans"
    )


def wires_sentence(solved: Solved) -> str:
    """By what sway contradicts the stated wire lengths, and what that does to Izz."""
    wires = solved.wires
    if wires is None or not wires.contradicted:
        return ""
    found = solved.solution
    answer = found.covariance_of("platform", COMMON)[IZZ, -1]
    change = answer / found.covariance_of(COMMON)[0, 0] * wires.shift_m
    share = 100.0 * change / float(found.value("platform")[IZZ])
    longer = "longer" if wires.shift_m > 0.0 else "shorter"
    rate = -50.0 * wires.shift_m / wires.stated_m
    return (
        f"the sway contradicts cable_lengths_m: its period is that of wires "
        f"{1e3 * abs(wires.shift_m):.1f} +- {1e3 * wires.std_m:.1f} mm {longer} than the "
        f"stated {wires.stated_m:.4g} m (+- {1e3 * wires.allowed_m:.2g} mm on the average), and "
        f"sway's are used: Izz changes by {share:+.2f} % with them, all of which its deviation "
        f"counts. Ends, knots and hooks that do not bend shorten wires; a frame rate off by "
        f"{rate:+.2f} % would look the same. Measure the wires from bend to bend, and film a clock"
    )


def _sway_excludes(solved: Solved, share: float) -> str:
    """Why neither L nor the clock is it, where sway was seen well enough; else nothing."""
    wires = solved.wires
    if wires is None:
        return ""
    # Wires that sway contradicts are already as sway has them; others stay as they are stated.
    left = 0.0 if wires.contradicted else wires.shift_m
    allowed = (abs(left) + CONTRADICTED * wires.std_m) / wires.stated_m
    if abs(share) <= allowed:
        return ""
    return (
        f"sway hangs on them alike, and leaves {100.0 * allowed:.2g} % of the "
        f"{100.0 * abs(share):.2g} % that it would take"
    )


def _distances(solved: Solved, half_percent: float) -> str:
    """The same in mm, from the nearest known mass to the farthest."""
    places = [
        float(np.linalg.norm(swing.known[1:3] / swing.known[0]))
        for swing in solved.swings
        if swing.known[0] > 0.0
    ]
    if not places:
        return ""
    ends = [-10.0 * half_percent * place for place in (min(places), max(places))]
    same = f"{ends[0]:+.1f}" == f"{ends[1]:+.1f}"
    return f": {ends[0]:+.1f} mm" if same else f": {ends[0]:+.1f} to {ends[1]:+.1f} mm"


def _centre(solved: Solved) -> str:
    """How far a centre of mass that is held would have to be off, the likeliest way; or nothing.

    Source:
        Schmidt 1966: how a fit answers to a number that it holds; Rasmussen, Williams 2006,
        eq. A.6, for the likeliest of those that explain a difference.
    """
    mass, mask = solved.mass, solved.held.get("platform")
    if mass is None or mask is None or not mask[1:3].any():
        return ""
    covariance = solved.solution.covariance_of("platform")
    shared, own = covariance[0, 1:3], covariance[1:3, 1:3]
    explained = float(shared @ np.linalg.lstsq(own, shared, rcond=None)[0])
    if not explained > 0.0:
        return ""
    shift = shared / explained * (mass.declared_kg - mass.fitted_kg)
    # With the centre there the fit would answer with the declared mass.
    x, y = 1e3 * shift
    believed = 1e3 * float(np.sqrt(np.max(np.diag(own))))
    return (
        f"the platform's centre of mass (x {x:+.0f}, y {y:+.0f} mm from where it is held, believed "
        f"to {believed:.2g} mm)"
    )
