"""An identified platform for other programs: URDF, MJCF and plain JSON."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement, fromstring, indent, tostring

import numpy as np

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.robot import INERTIA_NAMES, Array, Robot
from freeswing.results.platform import Platform

_NOT_XML = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


@dataclass(frozen=True, slots=True)
class Inertia:
    """A platform's inertia in kg and m.

    Attributes:
        mass_kg: mass.
        com_m: P to centre of mass, platform frame, (3,).
        tensor_kg_m2: inertia tensor about the centre of mass, platform axes, (3, 3).
    """

    mass_kg: float
    com_m: Array
    tensor_kg_m2: Array


def inertia_from(parameters: Mapping[str, float], mass_kg: float) -> Inertia:
    """From specific inertia about P (`INERTIA_NAMES`) by Huygens-Steiner.

    Raises:
        DataError: where no body can have it (other programs refuse it too), with the moments.
    """
    values = np.array([parameters[name] for name in INERTIA_NAMES])
    com, (xx, yy, zz, xy, xz, yz) = values[:3], values[3:]
    about_p = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    about_com = about_p - (com @ com * np.eye(3) - np.outer(com, com))
    moments = np.linalg.eigvalsh(about_com)
    if not (mass_kg > 0.0 and moments[0] > 0.0 and moments[0] + moments[1] >= moments[2]):
        told = ", ".join(f"{mass_kg * value:.4g}" for value in moments)
        raise DataError(
            f"the principal moments about the centre of mass are {told} kg m2 (mass {mass_kg:g} "
            "kg): no body can have them (each must be positive and at most the sum of the other "
            "two), so nothing is exported; record more swings, or see identify --consistent"
        )
    return Inertia(mass_kg, com, mass_kg * about_com)


def urdf(robot: Robot, inertia: Inertia) -> str:
    """The platform's link, whose frame is the platform's, fixed to a root without mass.

    Readers such as KDL ignore the inertia of a root link.
    """
    root = Element("robot", name=_named(robot.name))
    SubElement(root, "link", name="root")
    joint = SubElement(root, "joint", name="root_platform", type="fixed")
    SubElement(joint, "parent", link="root")
    SubElement(joint, "child", link="platform")
    inertial = SubElement(SubElement(root, "link", name="platform"), "inertial")
    SubElement(inertial, "origin", xyz=_numbers(inertia.com_m), rpy="0 0 0")
    SubElement(inertial, "mass", value=f"{inertia.mass_kg:.9g}")
    names = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2)}
    entries = {**names, "iyz": (1, 2)}
    tensor = {name: f"{inertia.tensor_kg_m2[place]:.9g}" for name, place in entries.items()}
    SubElement(inertial, "inertia", tensor)
    return _text(root)


def mjcf(robot: Robot, inertia: Inertia) -> str:
    """A free body on spatial tendons from the pulleys' entry points (pulley radii are left out)."""
    root = Element("mujoco", model=_named(robot.name))
    SubElement(root, "compiler", angle="radian")
    SubElement(root, "option", gravity=_numbers(robot.gravity_m_s2))
    world = SubElement(root, "worldbody")
    for cable in robot.cables:
        SubElement(world, "site", name=f"entry {_named(cable.name)}", pos=_numbers(cable.entry_m))
    body = SubElement(world, "body", name="platform")
    SubElement(body, "freejoint")
    tensor = inertia.tensor_kg_m2
    full = [tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2]]
    mass, entries = f"{inertia.mass_kg:.9g}", _numbers(np.array(full))
    SubElement(body, "inertial", pos=_numbers(inertia.com_m), mass=mass, fullinertia=entries)
    for cable in robot.cables:
        place = _numbers(cable.attachment_m)
        SubElement(body, "site", name=f"attachment {_named(cable.name)}", pos=place)
    tendons = SubElement(root, "tendon")
    for cable in robot.cables:
        tendon = SubElement(tendons, "spatial", name=f"cable {_named(cable.name)}")
        SubElement(tendon, "site", site=f"entry {_named(cable.name)}")
        SubElement(tendon, "site", site=f"attachment {_named(cable.name)}")
    return _text(root)


def plain(robot: Robot, inertia: Inertia) -> Platform:
    """The same numbers as a document."""
    return Platform(
        robot=robot.name,
        mass_kg=inertia.mass_kg,
        com_m=tuple(inertia.com_m.tolist()),
        inertia_about_com_kg_m2=tuple(tuple(row) for row in inertia.tensor_kg_m2.tolist()),
    )


def _numbers(values: Array) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def _named(name: str) -> str:
    """A name without the characters that XML 1.0 cannot hold."""
    return _NOT_XML.sub("_", name)


def _text(root: Element) -> str:
    """The document, after it was read back: what other programs get is what was meant.

    Raises:
        ValueError: where the text does not parse to the same elements.
    """
    indent(root)
    text = tostring(root, encoding="unicode") + "\n"
    again = [(element.tag, element.attrib) for element in fromstring(text).iter()]
    if again != [(element.tag, element.attrib) for element in root.iter()]:
        raise ValueError(f"the written {root.tag} document does not read back as it was meant")
    return text
