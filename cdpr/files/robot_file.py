"""robot.toml to and from `Robot`; every problem of a file is named at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.drive import Drive
from freeswing.cdpr.driven.formula import Formula
from freeswing.cdpr.files.documents import (
    InputError,
    Problems,
    Reader,
    dump_toml,
    inside,
    load_toml,
)
from freeswing.cdpr.files.drive_file import (
    Named,
    cable_table,
    drive_table,
    read_motors,
    read_shape,
)
from freeswing.cdpr.mesh.nominal_inertia import METRES_PER_UNIT, platform_from_mesh
from freeswing.cdpr.robot import POSE_COORDINATES, STANDARD_GRAVITY_M_S2, Cable, Platform, Robot
from freeswing.cdpr.tolerances import Tolerances

Array = NDArray[np.float64]

MOST_CABLES = 8
# Driven ones may be more than pose and limits need: r = n - 6 spare ones, by a QP above 2.
MOST_DRIVEN = 24
# A tenth of the Earth's in mm/s2, and four times Jupiter's.
LARGEST_GRAVITY_M_S2 = 100.0
AXIS_TOLERANCE = 1e-6
SWIVEL_KEYS = ("swivel_x", "swivel_y", "swivel_z")
INERTIA_TOLERANCE = 1e-9


def robot_path(path: Path | str) -> Path:
    """The file that is meant: `path`, or robot.toml in it where it is a folder."""
    path = Path(path)
    return path / "robot.toml" if path.is_dir() else path


def read_robot(path: Path | str) -> Robot:
    """Read robot.toml; a mesh named in it is read too, from the file's folder or below.

    Raises:
        InputError: naming every problem of the file with its key.
    """
    problems = Problems()
    reader = Reader(load_toml(path, "robot", problems), problems)
    name = reader.string("name")
    gravity = _read_gravity(reader)
    named = read_shape(reader.child("shape", required=False))
    tables = reader.children("cables")
    driving = reader.child("drive", required=False)
    read = [_read_cable(table, named, is_driven=driving is not None) for table in tables]
    cables, points = [values for values, _ in read], [formulas for _, formulas in read]
    _check_cables(reader, cables, MOST_CABLES if driving is None else MOST_DRIVEN)
    free = _read_free_coordinates(reader, len(cables))
    attachments = np.array([values[3] for values in cables]).reshape(-1, 3)
    platform = _read_platform(
        reader.child("platform", required=False), Path(path).parent, _span(attachments)
    )
    tolerances = _read_tolerances(reader.child("tolerances", required=False))
    drive = None
    if driving is not None:
        motors = read_motors(driving, tables, named)
        drive = Drive(named.shape, *_columns(points), motors)
        _check_driven(reader, platform)
    reader.finish()
    for table in tables:
        table.finish()
    problems.raise_if_any(path)
    return Robot(
        name=name,
        cables=tuple(Cable(*values) for values in cables),
        gravity_m_s2=gravity,
        free_coordinates=free,
        platform=platform,
        drive=drive,
        tolerances=tolerances,
    )


def _read_tolerances(reader: Reader | None) -> Tolerances:
    """What a robot's own builders know better than the usual table."""
    if reader is None:
        return Tolerances()
    given = {
        name: reader.optional_number(name, above=1.0 if name == "gross" else 0.0)
        for name in Tolerances().numbers()
    }
    reader.finish()
    known = {name: value for name, value in given.items() if value is not None}
    return Tolerances() if reader.problems else Tolerances(**known, declared=tuple(known))


def _columns(points: list[Points]) -> tuple[tuple[Point, ...], tuple[Point, ...]]:
    """Formulas of all entries, and of all attachments."""
    return tuple(entry for entry, _ in points), tuple(attachment for _, attachment in points)


def _check_driven(reader: Reader, platform: Platform) -> None:
    """The dynamics of a driven robot need its mass and inertia."""
    if not reader.problems and (platform.mass_kg is None or platform.specific_inertia_m2 is None):
        reader.add("platform", "a driven robot needs mass_kg and inertia_kg_m2")


def write_robot(path: Path | str, robot: Robot) -> None:
    """Write robot.toml; the file is replaced whole."""
    free = robot.free_coordinates
    platform = {
        "mass_kg": robot.platform.mass_kg,
        "com_m": robot.platform.com_m,
        "specific_inertia_m2": robot.platform.specific_inertia_m2,
    }
    cables = [
        {
            "name": cable.name,
            "entry_m": cable.entry_m,
            "pulley_radius_m": float(cable.pulley_radius_m),
            "attachment_m": cable.attachment_m,
            **{key: getattr(cable, key) for key in SWIVEL_KEYS},
            **({} if robot.drive is None else cable_table(robot.drive, index)),
        }
        for index, cable in enumerate(robot.cables)
    ]
    table = {
        "format": "freeswing-robot/1",
        "name": robot.name,
        "gravity_m_s2": robot.gravity_m_s2,
        "free_coordinates": "auto" if free is None else list(free),
        "platform": platform if any(v is not None for v in platform.values()) else None,
        "tolerances": _own_tolerances(robot.tolerances) or None,
        **({} if robot.drive is None else drive_table(robot.drive)),
        "cables": cables,
    }
    dump_toml(path, table)


def _own_tolerances(known: Tolerances) -> dict[str, float]:
    """Those that are stated or differ from the usual ones."""
    usual = Tolerances().numbers()
    return {
        name: value
        for name, value in known.numbers().items()
        if name in known.declared or value != usual[name]
    }


CableValues = tuple[str, Array, float, Array, Array, Array, Array]
Point = tuple[Formula, ...]
Points = tuple[Point, Point]


def _read_gravity(reader: Reader) -> Array:
    gravity = reader.optional_vector("gravity_m_s2", 3)
    if gravity is None:
        return np.array([0.0, 0.0, -STANDARD_GRAVITY_M_S2])
    size = float(np.linalg.norm(gravity))
    if size == 0.0:
        reader.add("gravity_m_s2", "is zero; a suspended platform swings only under gravity")
    elif size > LARGEST_GRAVITY_M_S2:
        reader.add("gravity_m_s2", f"{size:g} m/s2 are no gravity: this looks like mm/s2 or cm/s2")
    return gravity


def _read_cable(reader: Reader, named: Named, *, is_driven: bool) -> tuple[CableValues, Points]:
    name = reader.string("name")
    entry_formulas, entry = named.point(reader, "entry_m")
    radius = 0.0
    if not is_driven or "pulley_radius_m" in reader:
        radius = reader.number("pulley_radius_m", minimum=0.0)
    attachment_formulas, attachment = named.point(reader, "attachment_m")
    axes = _read_swivel(reader, is_eyelet=radius == 0.0)
    return (name, entry, radius, attachment, *axes), (entry_formulas, attachment_formulas)


def _read_swivel(reader: Reader, *, is_eyelet: bool) -> tuple[Array, Array, Array]:
    """The swivel frame; of an eyelet it is not used, so it may be absent or arbitrary."""
    if is_eyelet:
        axes = [reader.optional_vector(key, 3) for key in SWIVEL_KEYS]
        rows = np.array([axis for axis in axes if axis is not None])
        is_frame = len(rows) == 3 and np.allclose(rows @ rows.T, np.eye(3), atol=AXIS_TOLERANCE)
        x, y, z = rows if is_frame else np.eye(3)
        return x, y, z
    x, y, z = (reader.unit_vector(key, tolerance=AXIS_TOLERANCE) for key in SWIVEL_KEYS)
    pairs = {
        "swivel_x, swivel_y": (x, y),
        "swivel_y, swivel_z": (y, z),
        "swivel_z, swivel_x": (z, x),
    }
    products = {keys: float(a @ b) for keys, (a, b) in pairs.items()}
    for keys, product in products.items():
        if abs(product) > AXIS_TOLERANCE:
            reader.add(
                keys,
                f"not perpendicular: their dot product is {product:.3g}, "
                f"must be 0 within {AXIS_TOLERANCE:g}",
            )
    if float(np.cross(x, y) @ z) < -0.5:
        reader.add(
            "swivel_z",
            "x, y, z are left-handed (x cross y = -z); turn the sign of the axis that is wrong",
        )
    return x, y, z


def _check_cables(reader: Reader, cables: list[CableValues], most: int) -> None:
    if len(cables) > most or ("cables" in reader and not cables):
        reader.add("cables", f"{len(cables)} cables, must be 1 to {most}")
        return
    names = [values[0] for values in cables]
    for count, name in enumerate(names):
        if name and name in names[:count]:
            first = names.index(name) + 1
            reader.add(f"cables[{count + 1}].name", f"{name!r} is already cables[{first}]'s")


def _read_free_coordinates(reader: Reader, n_cables: int) -> tuple[str, ...] | None:
    n_free = max(6 - n_cables, 0)
    value = reader.raw("free_coordinates", required=False)
    if value is None or value == "auto":
        return None if n_free else ()
    names = reader.strings("free_coordinates")
    for name in names:
        if name not in POSE_COORDINATES:
            allowed = ", ".join(POSE_COORDINATES)
            reader.add("free_coordinates", f"{name[:40]!r} is not one of {allowed}")
    if len(set(names)) < len(names):
        reader.add("free_coordinates", f"{list(names)} names a coordinate twice")
    if isinstance(value, list) and n_cables and len(value) != n_free:
        reader.add(
            "free_coordinates",
            f"{len(value)} coordinates, must be 6 - n = {n_free} with {n_cables} cables",
        )
    return names


def _span(points: Array) -> float | None:
    """The largest distance between two points (n, 3), None where there is none."""
    if len(points) < 2 or not np.isfinite(points).all():
        return None
    return float(np.linalg.norm(points[:, None] - points[None], axis=-1).max()) or None


def _read_platform(reader: Reader | None, folder: Path, span_m: float | None) -> Platform:
    if reader is None:
        return Platform()
    mass = reader.optional_number("mass_kg", above=0.0)
    reader.optional_number("mass_std_kg", above=0.0)  # of benches, which read it for themselves
    density = reader.optional_number("density_kg_m3", above=0.0)
    com = reader.optional_vector("com_m", 3)
    inertia = reader.optional_vector("specific_inertia_m2", 6)
    inertia = _over_mass(reader, mass, inertia)
    com = np.zeros(3) if com is None and "inertia_kg_m2" in reader else com
    mesh = reader.optional_string("mesh")
    unit = reader.optional_string("mesh_unit", choices=tuple(METRES_PER_UNIT))
    reader.finish()
    if mass is not None and density is not None:
        reader.add("density_kg_m3", "give mass_kg or density_kg_m3, not both")
    if mesh is None and (density is not None or unit is not None):
        reader.add("mesh", "missing; mesh_unit and density_kg_m3 say nothing without it")
    _check_inertia(reader, com, inertia)
    if mesh and not reader.problems:  # read even where nothing is taken from it: it may be wrong
        try:
            path = inside(folder, mesh)
            solid = platform_from_mesh(
                path, unit, mass_kg=mass, density_kg_m3=density, span_m=span_m
            )
        except InputError as error:
            reader.add("mesh", str(error))
        else:
            mass = solid.mass_kg
            com = solid.com_m if com is None else com
            inertia = solid.specific_inertia_m2 if inertia is None else inertia
            _check_inertia(reader, com, inertia)
    return Platform() if reader.problems else Platform(mass, com, inertia)


def _over_mass(reader: Reader, mass: float | None, specific: Array | None) -> Array | None:
    """The specific inertia, of `inertia_kg_m2` where that is given instead."""
    whole = reader.optional_vector("inertia_kg_m2", 6)
    if whole is None:
        return specific
    if specific is not None:
        reader.add("inertia_kg_m2", "give it or specific_inertia_m2, not both")
    if mass is None:
        reader.add("inertia_kg_m2", "needs mass_kg beside it")
        return specific
    return whole / mass


def _check_inertia(reader: Reader, com: Array | None, inertia: Array | None) -> None:
    """Record a specific inertia that no distribution of mass can have.

    The second moments of mass about P, E[p p^T] = tr(I')/2 - I', less those of the centre of mass,
    are a covariance: positive semi-definite (Wensing, Kim, Slotine 2018).
    """
    if inertia is None or not np.isfinite(inertia).all():
        return
    xx, yy, zz, xy, xz, yz = inertia
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    moments = 0.5 * np.trace(tensor) * np.eye(3) - tensor
    about = "P"
    if com is not None and np.isfinite(com).all():
        moments, about = moments - np.outer(com, com), "the centre of mass"
    least = float(np.linalg.eigvalsh(moments)[0])
    if least < -INERTIA_TOLERANCE * max(1.0, float(np.abs(tensor).max())):
        reader.add(
            "specific_inertia_m2",
            f"no body has it: the least second moment of mass about {about} is {least:.4g} m2, "
            "must be >= 0 (the tensor is about P, over the mass; check com_m and the order "
            "xx yy zz xy xz yz)",
        )
