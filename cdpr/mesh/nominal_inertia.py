"""Nominal inertia of the platform from a closed CAD mesh (trimesh)."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from freeswing.cdpr.files.documents import InputError, read_bytes
from freeswing.cdpr.mesh.separate_bodies import problem_of_bodies
from freeswing.cdpr.robot import Platform

METRES_PER_UNIT = {
    "m": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
    "in": 0.0254,
}
USUAL_UNITS = ("mm", "m", "in", "cm")  # of CAD exports, the most usual first
MESH_SUFFIXES = (".stl", ".obj", ".ply", ".off")
MOST_MESH_BYTES = 256 * 2**20
LARGEST_PLATFORM_M = 100.0  # cameras over stadiums hang from less: it is mm or in read as m
# A body's length over the span of its cables' attachments: a unit that the user stated is doubted
# beyond 30 (mm for m is 1000, in for m 39), none stated already beyond 8; platforms have 1 to 3.
DOUBTED_STATED = 30.0
DOUBTED_UNSTATED = 8.0


def platform_from_mesh(
    path: Path | str,
    unit: str | None = None,
    *,
    mass_kg: float | None = None,
    density_kg_m3: float | None = None,
    span_m: float | None = None,
) -> Platform:
    """Mass, centre of mass and specific inertia about P of a homogeneous closed body.

    The mesh's origin is P and its axes are the platform's. Centre of mass and specific inertia do
    not depend on the mass; without `mass_kg` and `density_kg_m3` the mass stays unknown.

    Args:
        path: the mesh.
        unit: of its numbers, one of `METRES_PER_UNIT`; metres when None.
        mass_kg: mass, where known.
        density_kg_m3: density, instead of the mass.
        span_m: size of what it must match, such as the span of the cables' attachments.

    Raises:
        InputError: when the mesh cannot be read, is not closed, is inside out, has bodies that
            overlap, or its unit is unknown or implausible.
    """
    stated, unit = unit is not None, unit or "m"
    if unit not in METRES_PER_UNIT:
        raise InputError(f"{path}: mesh_unit {unit!r} must be one of {', '.join(METRES_PER_UNIT)}")
    if mass_kg is not None and density_kg_m3 is not None:
        raise InputError(f"{path}: give mass_kg or density_kg_m3, not both")
    mesh = _load(Path(path))
    # STL has no unit and `convert_units` would leave the density: scale the vertices instead.
    mesh.apply_scale(METRES_PER_UNIT[unit])
    _check_body(path, mesh, unit)
    if span_m:
        _check_size(path, float(np.max(mesh.extents)), unit, stated, span_m)
    mesh.density = 1.0
    volume, com = float(mesh.volume), np.array(mesh.center_mass, dtype=np.float64)
    inertia = np.array(mesh.moment_inertia) / volume + com @ com * np.eye(3) - np.outer(com, com)
    return Platform(
        mass_kg=mass_kg if density_kg_m3 is None else density_kg_m3 * volume,
        com_m=com,
        specific_inertia_m2=inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]],
    )


def _load(path: Path):
    import io

    import trimesh

    if path.suffix.lower() not in MESH_SUFFIXES:
        raise InputError(f"{path}: mesh files read here are {', '.join(MESH_SUFFIXES)}")
    data = _as_utf8(read_bytes(path, MOST_MESH_BYTES))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            mesh = trimesh.load_mesh(io.BytesIO(data), file_type=path.suffix.lower()[1:])
    except Exception as error:  # a damaged mesh can raise anything in its parser
        raise InputError(
            f"{path}: not a readable mesh ({type(error).__name__}: {error})"
        ) from error
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
        raise InputError(f"{path}: holds no triangles")
    if not np.isfinite(mesh.vertices).all():
        raise InputError(f"{path}: holds a vertex that is not finite")
    mesh.merge_vertices()
    return mesh


def _as_utf8(data: bytes) -> bytes:
    """Text of other encodings as UTF-8 (names in a header may have accents); binary as it is."""
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        is_text = b"\0" not in data[:4096] and b"\n" in data[:4096]
        return data.decode("latin-1").encode("utf-8") if is_text else data
    return data


def _check_size(path: Path | str, size_m: float, unit: str, stated: bool, span_m: float) -> None:
    """Question a unit in which the body is not of its cables' size, and say which would be."""
    limit = DOUBTED_STATED if stated else DOUBTED_UNSTATED
    if 1 / limit <= size_m / span_m <= limit:
        return
    raw = size_m / METRES_PER_UNIT[unit]
    fitting = [u for u in USUAL_UNITS if 1 / limit <= raw * METRES_PER_UNIT[u] / span_m <= limit]
    likely = fitting[0] if fitting else "mm"
    told = f'mesh_unit = "{unit}"' if stated else "no mesh_unit (metres are then taken)"
    raise InputError(
        f"{path}: the body is {size_m:g} m long with {told}, but the cables are attached over "
        f'{span_m:.3g} m; mesh_unit = "{likely}" would make it '
        f"{raw * METRES_PER_UNIT[likely]:.3g} m: say the unit of the export"
    )


def _check_body(path: Path | str, mesh, unit: str) -> None:
    if not mesh.is_watertight:
        edges = len(mesh.edges_unique)
        raise InputError(
            f"{path}: the surface of {len(mesh.faces)} triangles and {edges} edges is not closed, "
            "so it has no volume; close the holes in the CAD program and export again"
        )
    if not mesh.is_winding_consistent:
        raise InputError(f"{path}: some triangles face inwards; make the normals consistent")
    size = float(np.max(mesh.extents))
    if not 1e-3 <= size <= LARGEST_PLATFORM_M:
        raise InputError(
            f"{path}: the body is {size:g} m long with mesh_unit = {unit!r}, "
            f"expected 0.001 to {LARGEST_PLATFORM_M:g} m; set mesh_unit to the unit of the export"
        )
    if not mesh.volume > 0.0:
        raise InputError(
            f"{path}: the volume is {mesh.volume:g} m3: the triangles wind inwards; "
            "flip the normals and export again"
        )
    problem = problem_of_bodies(mesh)
    if problem:
        raise InputError(f"{path}: {problem}")
