"""Nominal inertia of the platform from a closed CAD mesh (trimesh)."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from freeswing.cdpr.files.documents import InputError, read_bytes
from freeswing.cdpr.robot import Platform

METRES_PER_UNIT = {
    "m": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
    "in": 0.0254,
}
MESH_SUFFIXES = (".stl", ".obj", ".ply", ".off")
MOST_MESH_BYTES = 256 * 2**20
LARGEST_PLATFORM_M = 100.0


def platform_from_mesh(
    path: Path | str,
    unit: str = "m",
    *,
    mass_kg: float | None = None,
    density_kg_m3: float | None = None,
) -> Platform:
    """Mass, centre of mass and specific inertia about P of a homogeneous closed body.

    The mesh's origin is P and its axes are the platform's. Centre of mass and specific inertia do
    not depend on the mass; without `mass_kg` and `density_kg_m3` the mass stays unknown.

    Raises:
        InputError: when the mesh cannot be read, is not closed, is inside out, or its unit is
            unknown or implausible.
    """
    if unit not in METRES_PER_UNIT:
        raise InputError(f"{path}: mesh_unit {unit!r} must be one of {', '.join(METRES_PER_UNIT)}")
    if mass_kg is not None and density_kg_m3 is not None:
        raise InputError(f"{path}: give mass_kg or density_kg_m3, not both")
    mesh = _load(Path(path))
    # STL has no unit and `convert_units` would leave the density: scale the vertices instead.
    mesh.apply_scale(METRES_PER_UNIT[unit])
    _check_body(path, mesh, unit)
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
    data = read_bytes(path, MOST_MESH_BYTES)
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
