"""Panel: what to do next: the command, the swing to record, the part to measure."""

from __future__ import annotations

from typing import Any

from freeswing import __version__
from freeswing.report.material import Material
from freeswing.report.panels.answer import best_parameters, known_mass_kg
from freeswing.report.panels.ladder import told_once
from freeswing.report.words import HALF_WIDTH_95, plain, unit_of

FEWEST_IDENTIFY = 3
POORLY_KNOWN = 0.1  # of a value: a ten times smaller interval needs other swings, not more of them


class Advice:
    """The next steps, the most telling first."""

    name = "next"
    title = "What to do next"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Sentences, each with its command where there is one."""
        return {"steps": steps(material), "cite": CITE}


CITE = (
    f"To cite: freeswing {__version__}, and for the method Idà, Briot, Carricato, Mechanism and "
    "Machine Theory 167 (2022) 104504; see CITATION.cff."
)


def steps(material: Material) -> list[tuple[str, str]]:
    """What to do, and the command that does it or an empty text."""
    place = material.folder
    found = [*_missing(material, place), *_effects(material, place), *_swings(material, place)]
    if not found:
        found.append(("Nothing has to be done: the model explains the runs kept apart.", ""))
    if material.estimates:
        found.append(
            (
                "Take the result to another program.",
                f"freeswing export {place} --urdf{_mass(material)}",
            )
        )
    return found


def _mass(material: Material) -> str:
    """The option that states the mass: as far as it is known."""
    parameters, _ = best_parameters(material)
    mass_kg = known_mass_kg(material, parameters)
    return f" --mass-kg {mass_kg:.5g}" if mass_kg else " --mass-kg M"


def _missing(material: Material, place: str) -> list[tuple[str, str]]:
    found = [(text, f"freeswing run {place}") for text in material.warnings]
    if not material.estimates:
        found.append(("Nothing is identified yet.", f"freeswing run {place}"))
    elif material.diagnosis is None:
        told = material.why_absent("diagnosis")
        command = "" if told else f"freeswing diagnose {place}"
        found.append((told or "Missing effects have not been looked for.", command))
    findings = material.check.findings if material.check else ()
    for one in findings:
        if one.level != "note":
            found.append((f"{one.subject}: {one.text}. {one.remedy}", f"freeswing check {place}"))
    return found


def _effects(material: Material, place: str) -> list[tuple[str, str]]:
    diagnosis = material.diagnosis
    if diagnosis is None:
        return []
    found = [
        (f"To tell {plain(one.effect)} from its rivals: {one.experiment}", "")
        for one in told_once(diagnosis.candidates)
        if one.experiment
    ]
    for effect in diagnosis.accepted:
        found.append(
            (
                f"Look for the cause of the {plain(effect.effect)} on the robot, and remove it or "
                "correct robot.toml; then repeat the swings and compare.",
                f"freeswing compare {place} AFTER",
            )
        )
    if diagnosis.unexplained is not None and diagnosis.unexplained.present:
        found.append((f"Find what does this: {diagnosis.unexplained.signature}", ""))
    return found


def _swings(material: Material, place: str) -> list[tuple[str, str]]:
    identification = material.identification
    if identification is None or not material.estimates:
        return []
    count = sum(one.role == "identify" for one in identification.swings)
    found = []
    if 0 < count < FEWEST_IDENTIFY:
        found.append(
            (
                f"Record more swings: {count} were fitted, {FEWEST_IDENTIFY} or more from other "
                "places are wanted.",
                f"freeswing excite {place}/robot.toml",
            )
        )
    best = material.estimates[identification.best or ""]
    weak = [
        plain(unit_of(one.name)[0])
        for one in best.parameters
        if one.essential and one.value and one.std
        if HALF_WIDTH_95 * one.std > POORLY_KNOWN * abs(one.value)
    ]
    if weak:
        found.append(
            (
                f"Known to no better than {100 * POORLY_KNOWN:.0f} %: {', '.join(weak)}. Swings "
                "from poses that turn the platform more tell them.",
                f"freeswing excite {place}/robot.toml",
            )
        )
    return found
